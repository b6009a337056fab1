//! Clusters of plants by their distances, and their dendrogram as a picture (2018 TOG, Fig. 10).
//!
//! Single linkage, as in the paper: the distance of two clusters is that of their nearest members. Its merges are the
//! edges of a least spanning tree (Prim 1957), taken from short to long: quadratic in plants, as the matrix is.

use std::fmt::Write as _;

/// Two clusters that become one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Merge {
    /// The clusters: plants below their number, then earlier merges.
    pub of: [usize; 2],
    /// How far they are apart.
    pub distance: f64,
}

/// The merges of some plants by their distances, nearest first.
#[must_use]
pub fn linkage(matrix: &[Vec<f64>]) -> Vec<Merge> {
    let count = matrix.len();
    let mut edges: Vec<(f64, usize, usize)> = Vec::new();
    // For each plant outside of the tree its nearest in it.
    let mut near: Vec<(f64, usize)> = (0..count).map(|i| (matrix[0][i], 0)).collect();
    let mut outside: Vec<usize> = (1..count).collect();
    while let Some(place) = (0..outside.len()).min_by(|&a, &b| near[outside[a]].0.total_cmp(&near[outside[b]].0)) {
        let next = outside.swap_remove(place);
        edges.push((near[next].0, near[next].1.min(next), near[next].1.max(next)));
        for &i in &outside {
            if matrix[next][i] < near[i].0 {
                near[i] = (matrix[next][i], next);
            }
        }
    }
    edges.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut cluster: Vec<usize> = (0..count).collect();
    let mut merges = Vec::with_capacity(edges.len());
    for (distance, a, b) in edges {
        let of = [cluster[a].min(cluster[b]), cluster[a].max(cluster[b])];
        let merged = count + merges.len();
        cluster.iter_mut().filter(|c| of.contains(c)).for_each(|c| *c = merged);
        merges.push(Merge { of, distance });
    }
    merges
}

/// Height of a line, width of the tree and of the names, pixels.
const LINE: usize = 20;
const TREE: f64 = 480.0;
const NAMES: usize = 240;
const MARGIN: f64 = 16.0;

/// Draws the merges of some plants, one name a line, as an SVG.
#[must_use]
pub fn dendrogram(names: &[String], merges: &[Merge], unit: &str) -> String {
    let count = names.len();
    // Plants in the order in which the tree has them.
    let mut order: Vec<usize> = Vec::new();
    let mut open: Vec<usize> =
        if merges.is_empty() { (0..count).rev().collect() } else { vec![count + merges.len() - 1] };
    while let Some(cluster) = open.pop() {
        match cluster.checked_sub(count).and_then(|m| merges.get(m)) {
            Some(merge) => open.extend([merge.of[1], merge.of[0]]),
            None => order.push(cluster),
        }
    }
    let longest = merges.last().map_or(1.0, |m| m.distance).max(f64::MIN_POSITIVE);
    let (width, height) = (TREE as usize + NAMES + 3 * MARGIN as usize, LINE * (count + 2));
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"13\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fcfcf8\"/>\n"
    );
    let right = MARGIN + TREE;
    let x = |distance: f64| right - TREE * distance / longest;
    // Right end and height of each cluster's line.
    let mut ends = vec![(right, 0.0); count];
    for (line, &plant) in order.iter().enumerate() {
        let y = (line * LINE + LINE) as f64;
        if let Some(end) = ends.get_mut(plant) {
            end.1 = y;
        }
        let name = names.get(plant).map_or("", String::as_str);
        let _ =
            writeln!(out, "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"#222\">{}</text>", right + 8.0, y + 4.0, escaped(name));
    }
    for merge in merges {
        let [a, b] = merge.of.map(|c| ends.get(c).copied().unwrap_or((right, 0.0)));
        let at = x(merge.distance);
        let _ = writeln!(
            out,
            "<path d=\"M{:.1} {:.1}H{at:.1}V{:.1}H{:.1}\" fill=\"none\" stroke=\"#476a3c\" stroke-width=\"1.5\"/>",
            a.0, a.1, b.1, b.0
        );
        ends.push((at, (a.1 + b.1) * 0.5));
    }
    let y = (LINE * (count + 1)) as f64;
    for i in 0..=4 {
        let distance = longest * f64::from(i) / 4.0;
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" fill=\"#777\" font-size=\"11\">{distance:.3}</text>",
            x(distance).max(MARGIN + 12.0)
        );
    }
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{y:.1}\" fill=\"#777\" font-size=\"11\">{}</text>\n</svg>",
        right + 24.0,
        escaped(unit)
    );
    out
}

fn escaped(text: &str) -> String {
    text.chars()
        .filter(|c| !c.is_control())
        .map(|c| match c {
            '<' => "&lt;".to_owned(),
            '>' => "&gt;".to_owned(),
            '&' => "&amp;".to_owned(),
            '"' => "&quot;".to_owned(),
            other => other.to_string(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_are_merged_first() {
        // On a line: 0, 1, 10, 12, 30.
        let places = [0.0_f64, 30.0, 1.0, 12.0, 10.0];
        let matrix: Vec<Vec<f64>> = places.iter().map(|a| places.iter().map(|b| (a - b).abs()).collect()).collect();
        let merges = linkage(&matrix);
        let told: Vec<([usize; 2], f64)> = merges.iter().map(|m| (m.of, m.distance)).collect();
        assert_eq!(told, [([0, 2], 1.0), ([3, 4], 2.0), ([5, 6], 9.0), ([1, 7], 18.0)]);
        let names: Vec<String> = ["a", "b & <c>", "d", "e", "f"].map(String::from).into();
        let svg = dendrogram(&names, &merges, "m");
        assert!(svg.contains("b &amp; &lt;c&gt;") && svg.matches("<path").count() == 4);
        assert!(usvg::Tree::from_str(&svg, &usvg::Options::default()).is_ok());
        assert!(linkage(&[vec![0.0]]).is_empty() && dendrogram(&names[..1], &[], "m").contains("<svg"));
    }
}
