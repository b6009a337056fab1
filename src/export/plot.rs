//! Curves over 0..=1 as an SVG: the trunk support weight over a morph (2017 CAVW, Fig. 10), with what it may change by.

use std::fmt::Write as _;

/// Values at evenly spread times, 0..=1 both.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// What it is called in the plot.
    pub name: String,
    /// One at least.
    pub values: Vec<f32>,
}

impl Curve {
    /// Steepest change between neighbours, for the whole length: 1 is from 0 to 1 in one straight line.
    #[must_use]
    pub fn steepest(&self) -> f32 {
        let steps = self.values.len().max(2) - 1;
        self.values.windows(2).fold(0.0_f32, |most, pair| most.max((pair[1] - pair[0]).abs())) * steps as f32
    }

    /// The same of the straight line from its first value to its last.
    #[must_use]
    pub fn straight(&self) -> f32 {
        let ends = self.values.first().zip(self.values.last());
        ends.map_or(0.0, |(first, last)| (last - first).abs())
    }
}

const SIZE: (f32, f32) = (640.0, 400.0);
const EDGE: f32 = 48.0;
const COLORS: [&str; 4] = ["#b3261e", "#1e5bb3", "#2e7d32", "#7b5ea7"];

/// The curves in one plot. For the first, the straight line from its start to its end is dashed, and at its steepest place a
/// stroke shows `bound` times the straight line's slope.
#[must_use]
pub fn plot(title: &str, curves: &[Curve], bound: f32) -> String {
    let (width, height) = SIZE;
    let x = |t: f32| EDGE + t * (width - 2.0 * EDGE);
    let y = |v: f32| height - EDGE - v * (height - 2.0 * EDGE);
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">"
    );
    let _ = writeln!(out, "<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>");
    let _ = writeln!(out, "<text x=\"{EDGE}\" y=\"24\" font-size=\"14\">{}</text>", escaped(title));
    for k in 0..=4 {
        let v = k as f32 / 4.0;
        let _ = writeln!(
            out,
            "<path d=\"M{:.1} {:.1}H{:.1}\" stroke=\"#dddddd\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{:.0} %</text>",
            x(0.0),
            y(v),
            x(1.0),
            x(0.0) - 6.0,
            y(v) + 4.0,
            v * 100.0
        );
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{:.0} %</text>",
            x(v),
            height - EDGE + 18.0,
            v * 100.0
        );
    }
    if let Some(first) = curves.first() {
        let (start, end) = (first.values[0], first.values[first.values.len() - 1]);
        let _ = writeln!(
            out,
            "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"#888888\" stroke-dasharray=\"6 4\" fill=\"none\"/>",
            x(0.0),
            y(start),
            x(1.0),
            y(end)
        );
        let steps = (first.values.len().max(2) - 1) as f32;
        let changes = first.values.windows(2).enumerate();
        let place =
            changes.max_by(|a, b| (a.1[1] - a.1[0]).abs().total_cmp(&(b.1[1] - b.1[0]).abs()).then(b.0.cmp(&a.0)));
        if let Some((i, pair)) = place {
            let (t, v) = ((i as f32 + 0.5) / steps, (pair[0] + pair[1]) * 0.5);
            let slope = (end - start) * bound;
            let _ = writeln!(
                out,
                "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"#f2a33a\" stroke-width=\"2\" fill=\"none\"/>",
                x(t - 0.1),
                y(v - slope * 0.1),
                x(t + 0.1),
                y(v + slope * 0.1)
            );
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"#a86500\">bound: {bound} x the straight line</text>",
                x(t + 0.11).min(x(0.6)),
                y(v + slope * 0.1) - 6.0
            );
        }
    }
    for (curve, (k, color)) in curves.iter().zip(COLORS.iter().cycle().enumerate()) {
        let steps = (curve.values.len().max(2) - 1) as f32;
        let points: Vec<String> =
            curve.values.iter().enumerate().map(|(i, v)| format!("{:.2},{:.2}", x(i as f32 / steps), y(*v))).collect();
        let _ = writeln!(
            out,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>",
            points.join(" ")
        );
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{color}\">{}: steepest {:.2}</text>",
            x(0.02),
            height - EDGE - 8.0 - 16.0 * (curves.len() - 1 - k) as f32,
            escaped(&curve.name),
            curve.steepest()
        );
    }
    out.push_str("</svg>\n");
    out
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_values_and_the_plot_is_xml() {
        let curve = Curve { name: "a <b>".to_owned(), values: vec![1.0, 0.9, 0.4, 0.4] };
        assert!((curve.steepest() - 1.5).abs() < 1e-6 && (curve.straight() - 0.6).abs() < 1e-6);
        let svg = plot("oak & elm", &[curve], 2.0);
        assert!(svg.contains("oak &amp; elm") && svg.contains("a &lt;b&gt;: steepest 1.50"));
        assert!(usvg::Tree::from_str(&svg, &usvg::Options::default()).is_ok());
        assert!(plot("", &[], 2.0).ends_with("</svg>\n"));
    }
}
