//! Pictures of leaves that turn: the green of pictures that came with a source, or are the user's own, takes another colour.
//!
//! Made leaves are drawn anew in their autumn colours; a picture has only its texels. What is green of it is leaf, and what is
//! not (twigs, blossom, blades that have turned already) stays as it is. Green becomes the colour it is told, as much lighter
//! or darker as the texel is than the picture's green in the mean, so veins and shadows stay. Not channel by channel: the noise of a
//! dark one would grow by as much as the colours differ.
//!
//! Limits: a leaf turns as a whole, and not from its margin or between its veins; red leaves stay red.

use glam::Vec3;

use super::srgb::{decode, encode};
use super::{ALPHA_CUTOFF, Maps};
use crate::preset::plan::LeafTurn;

/// By how much of itself a texel is greener than it is red or blue where all of it is leaf.
const GREEN: f32 = 0.2;
/// Share of a picture that is green at least, for it to turn.
const LEAST: f32 = 0.02;
/// Relative luminance of linear sRGB (IEC 61966-2-1).
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// The picture of a leaf with its green turned; `picture` says which of the colours between two it takes. As it was where hardly any of
/// it is green.
#[must_use]
pub fn turned_leaf(mut maps: Maps, turn: &LeafTurn, picture: u32) -> Maps {
    let to: &dyn Fn(Vec3) -> Vec3 = match turn {
        LeafTurn::Lighter { gain } => &|color| color * Vec3::from_array(*gain),
        LeafTurn::Colors { .. } => {
            let Some(mean) = mean_green(&maps) else { return maps };
            let tint = Vec3::from_array(turn.color(picture)) / mean;
            &move |color| tint * color.dot(LUMINANCE)
        }
    };
    for texel in &mut maps.color {
        let color = linear(*texel);
        let share = green(color);
        if share > 0.0 {
            let [r, g, b] = color.lerp(to(color), share).to_array().map(encode);
            *texel = [r, g, b, texel[3]];
        }
    }
    maps
}

/// Whether enough of a picture is green for it to turn.
#[must_use]
pub fn has_green(maps: &Maps) -> bool {
    mean_green(maps).is_some()
}

/// The mean luminance of what is green of a picture; none where next to nothing is.
fn mean_green(maps: &Maps) -> Option<f32> {
    let solid = maps.color.iter().filter(|texel| f32::from(texel[3]) >= ALPHA_CUTOFF * 255.0);
    let (mut all, mut leaf, mut sum) = (0.0_f64, 0.0_f64, 0.0_f64);
    for texel in solid {
        let color = linear(*texel);
        let share = f64::from(green(color));
        all += 1.0;
        leaf += share;
        sum += share * f64::from(color.dot(LUMINANCE));
    }
    (leaf > all * f64::from(LEAST)).then(|| (sum / leaf) as f32).filter(|mean| *mean > 0.0)
}

fn linear([r, g, b, _]: [u8; 4]) -> Vec3 {
    Vec3::new(decode(r), decode(g), decode(b))
}

/// How far a colour is a living leaf's, 0..=1.
fn green(color: Vec3) -> f32 {
    let by = (color.y - color.x.max(color.z)) / color.y.max(1e-6);
    let way = (by * (1.0 / GREEN)).clamp(0.0, 1.0);
    way * way * (3.0 - 2.0 * way)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a leaf's green, light and dark, of a brown twig and of a red fruit; the last column is clear.
    const ROWS: [[u8; 3]; 4] = [[110, 150, 60], [50, 80, 25], [90, 70, 45], [190, 30, 40]];

    fn picture(rows: &[[u8; 3]]) -> Maps {
        let color: Vec<_> = rows.iter().flat_map(|&[r, g, b]| [[r, g, b, 255], [r, g, b, 0]]).collect();
        let (normal, orm) = (vec![[128, 128, 255]; color.len()], vec![[255, 150, 100]; color.len()]);
        Maps { width: 2, height: rows.len() as u32, color, normal, orm }
    }

    const MAPLE: LeafTurn = LeafTurn::Colors { first: [0.47, 0.06, 0.01], last: [0.53, 0.25, 0.02] };

    #[test]
    fn green_turns_and_twigs_and_fruit_stay() {
        let was = picture(&ROWS);
        let now = turned_leaf(was.clone(), &MAPLE, 0);
        assert_eq!((&now.normal, &now.orm, now.color[4..].to_vec()), (&was.normal, &was.orm, was.color[4..].to_vec()));
        // The colour that is told, in the mean of the light row and the dark one; both of its hue.
        let rows = [linear(now.color[0]), linear(now.color[2])];
        let mean = (rows[0] + rows[1]) * 0.5;
        assert!((mean - Vec3::new(0.47, 0.06, 0.01)).abs().max_element() < 0.01, "{mean}");
        assert!(rows.iter().all(|c| (c.y / c.x - 0.06 / 0.47).abs() < 0.02), "{rows:?}");
        let light = |maps: &Maps| linear(maps.color[0]).dot(LUMINANCE) / linear(maps.color[2]).dot(LUMINANCE);
        assert!((light(&now) / light(&was) - 1.0).abs() < 0.1);
        // What is clear beside a leaf turns with it, or mips would have green rims; alpha is as it was.
        assert_eq!((now.color[1], now.color[1][3]), ([now.color[0][0], now.color[0][1], now.color[0][2], 0], 0));
    }

    #[test]
    fn pictures_take_colours_between_two() {
        let red = |picture_: u32| linear(turned_leaf(picture(&ROWS[..1]), &MAPLE, picture_).color[0]).y;
        assert!((red(0) - 0.06).abs() < 0.01 && (red(1) - 0.155).abs() < 0.01, "{} {}", red(0), red(1));
        let spring = turned_leaf(picture(&ROWS), &LeafTurn::Lighter { gain: [1.5, 1.35, 1.1] }, 0);
        let gain = linear(spring.color[0]) / linear([110, 150, 60, 255]);
        assert!((gain - Vec3::new(1.5, 1.35, 1.1)).abs().max_element() < 0.03, "{gain}");
        assert_eq!(spring.color[4..], picture(&ROWS).color[4..]);
    }

    #[test]
    fn a_picture_without_green_stays_as_it_is() {
        for rows in [&ROWS[2..], &[[0, 0, 0], [255, 255, 255]]] {
            assert_eq!(turned_leaf(picture(rows), &MAPLE, 0), picture(rows));
        }
    }
}
