//! The principal axes of a convex outline, and light that is taken for linear over it: by what it is at places on them.

use glam::{DVec2, DVec3};
use scene::{Rgb, luminance};

use crate::Patch;

/// Width of an outline, as a part of its length, below which light is taken for the same all across it.
const NARROW: f64 = 0.25;

/// How long axes are, in the root mean square of what lies along them, where there are two. At 1 the places are those of Gauss' rule over
/// a rectangle, but on the edges of a triangle, which may be contacts; shorter ones tell slopes less well.
const INWARDS: f64 = 0.9;

/// The middle of a convex outline, and its principal axes.
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipalAxes {
    centre: DVec3,
    /// About as long as the root mean square of what lies along them, metres: two, or the longer one alone if the outline is narrow.
    axes: Vec<DVec3>,
}

/// Irradiance that is linear over an outline, W·m⁻²: in the middle, and by how much it is more at the end of each axis.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearLight {
    middle: Rgb,
    slopes: [Rgb; 2],
}

impl PrincipalAxes {
    /// Those of an outline in a patch's plane; none without an area.
    pub fn new(outline: &[DVec3], patch: &Patch) -> Option<Self> {
        let (centre, axes) = principal_axes(outline, patch)?;
        Some(Self { centre, axes })
    }

    /// The corners of the rectangle between the axes' ends, or the ends of a single one: every slope is told by all of them. They lie within
    /// the outline, as does the ellipse whose half-axes are √2 times the root mean square (Kannan, Lovász & Simonovits 1995, theorem 4.1).
    pub fn places(&self) -> impl Iterator<Item = DVec3> {
        let place = |number| self.axes.iter().enumerate().map(|(i, &axis)| axis * side(number, i)).sum::<DVec3>();
        (0..1 << self.axes.len()).map(move |number| self.centre + place(number))
    }

    /// Light that is taken for linear, by what it is at the places; `light` is asked by the place's number. `scatter` is what that is
    /// off by for chance, root mean square, luminance, W·m⁻²: of a slope the part counts that its square exceeds chance by, as in a Wiener
    /// filter whose signal is told from what is seen.
    pub fn linear_light(&self, light: impl Fn(u32) -> Rgb, scatter: f64) -> LinearLight {
        let mut looked = [Rgb::ZERO; 4];
        let looked = &mut looked[..1 << self.axes.len()];
        (0..).zip(&mut *looked).for_each(|(place, found)| *found = light(place));
        let count = looked.len() as f64;
        let slope = |axis: usize| {
            let slope = (0..).zip(&*looked).map(|(place, &light)| light * side(place, axis)).sum::<Rgb>() / count;
            let (square, chance) = (luminance(slope).powi(2), scatter * scatter / count);
            if square > chance { slope * (1.0 - chance / square) } else { Rgb::ZERO }
        };
        let slopes = [0, 1].map(|axis| if axis < self.axes.len() { slope(axis) } else { Rgb::ZERO });
        LinearLight { middle: looked.iter().sum::<Rgb>() / count, slopes }
    }

    /// Such light at a position, W·m⁻².
    pub fn at(&self, light: &LinearLight, position: DVec3) -> Rgb {
        let along =
            |(&axis, &slope): (&DVec3, &Rgb)| slope * (axis.dot(position - self.centre) / axis.length_squared());
        light.middle + self.axes.iter().zip(&light.slopes).map(along).sum::<Rgb>()
    }
}

/// On which side of an axis a place is: ahead, 1, or behind, −1.
fn side(place: u32, axis: usize) -> f64 {
    if place >> axis & 1 == 0 { 1.0 } else { -1.0 }
}

fn principal_axes(outline: &[DVec3], patch: &Patch) -> Option<(DVec3, Vec<DVec3>)> {
    let corners: Vec<DVec2> = outline.iter().map(|&corner| patch.along(corner - outline[0])).collect();
    let (mut area, mut first, mut second) = (0.0, DVec2::ZERO, [0.0; 3]);
    for edge in corners.get(1..)?.windows(2) {
        let (a, b) = (edge[0], edge[1]);
        let part = a.perp_dot(b) / 2.0;
        let sum = a + b;
        area += part;
        first += sum * (part / 3.0);
        let moment = |a: f64, b: f64, c: f64, d: f64, s: f64, t: f64| (a * b + c * d + s * t) * part / 12.0;
        second[0] += moment(a.x, a.x, b.x, b.x, sum.x, sum.x);
        second[1] += moment(a.x, a.y, b.x, b.y, sum.x, sum.y);
        second[2] += moment(a.y, a.y, b.y, b.y, sum.y, sum.y);
    }
    let middle = first / area;
    let [xx, xy, yy] = [
        second[0] / area - middle.x * middle.x,
        second[1] / area - middle.x * middle.y,
        second[2] / area - middle.y * middle.y,
    ];
    let (mean, half) = ((xx + yy) / 2.0, ((xx - yy) / 2.0).hypot(xy));
    let way = DVec2::from_angle(xy.atan2((xx - yy) / 2.0) / 2.0);
    let [long, short] = [mean + half, mean - half].map(|square| square.max(0.0).sqrt());
    if !(long.is_finite() && long > 0.0) {
        return None;
    }
    let in_space = |way: DVec2| patch.u * way.x + patch.v * way.y;
    let axes = if short > NARROW * long {
        vec![in_space(way) * (INWARDS * long), in_space(way.perp()) * (INWARDS * short)]
    } else {
        vec![in_space(way) * long]
    };
    Some((outline[0] + in_space(middle), axes))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use proptest::prelude::*;

    use super::*;

    fn patch() -> Patch {
        Patch { polygon: 0, root: 0, origin: DVec3::ZERO, u: DVec3::X, v: DVec3::Y }
    }

    #[test]
    fn principal_axes_of_nothing_a_strip_and_a_rectangle() {
        assert_eq!(principal_axes(&[], &patch()), None);
        assert_eq!(principal_axes(&[DVec3::ONE; 3], &patch()), None);
        let rectangle = |x: f64, y: f64| [(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)].map(|(x, y)| DVec3::new(x, y, 7.0));
        // Gauss' points of a side lie at 1/√12 of it from the middle.
        let gauss = 1.0 / 12f64.sqrt();
        let (centre, axes) = principal_axes(&rectangle(1.0, 3.0), &patch()).unwrap();
        assert!(centre.distance(DVec3::new(0.5, 1.5, 7.0)) < 1e-12);
        assert!((axes[0].y.abs() - INWARDS * 3.0 * gauss).abs() < 1e-12 && axes[0].x.abs() < 1e-12);
        assert!((axes[1].x.abs() - INWARDS * gauss).abs() < 1e-12 && axes.len() == 2);
        let (_, axes) = principal_axes(&rectangle(5.0, 1.0), &patch()).unwrap();
        assert!(axes.len() == 1 && axes[0].x.abs() > 1.0);
    }

    /// Slopes of 10 and 0.4 from places that scatter by 1, their slopes by a half: what is left of the first is hardly less, of the second
    /// nothing.
    #[test]
    fn slopes_count_as_far_as_they_exceed_chance() {
        let square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let axes = PrincipalAxes::new(&square, &patch()).unwrap();
        let [steep, slight] = [0, 1].map(|axis| axes.axes[axis] / axes.axes[axis].length_squared());
        let light = |place: DVec3| Rgb::splat(20.0 + (steep * 10.0 + slight * 0.4).dot(place - axes.centre));
        let looked: Vec<Rgb> = axes.places().map(light).collect();
        let found = |scatter: f64| axes.linear_light(|place| looked[place as usize], scatter);
        let LinearLight { middle, slopes } = found(1.0);
        assert!((middle - 20.0).length() < 1e-9);
        assert_eq!(slopes[1], Rgb::ZERO);
        assert!((slopes[0].x - (10.0 - 0.25 / 10.0)).abs() < 1e-9);
        assert!((found(0.0).slopes[1].x - 0.4).abs() < 1e-9);
        let flat = axes.linear_light(|_| Rgb::ONE, 0.0);
        assert_eq!(flat, LinearLight { middle: Rgb::ONE, slopes: [Rgb::ZERO; 2] });
    }

    /// Angles at which corners lie on a circle.
    fn angles() -> impl Strategy<Value = Vec<f64>> {
        prop::collection::vec(0.0..std::f64::consts::TAU, 3..9)
    }

    proptest! {
        #[test]
        fn looks_lie_within_convex_outlines(mut angles in angles(), squeeze in 0.05..1.0f64) {
            angles.sort_by(f64::total_cmp);
            let outline: Vec<DVec3> =
                angles.iter().map(|angle| DVec3::new(angle.cos(), angle.sin() * squeeze, 2.0)).collect();
            let Some(axes) = PrincipalAxes::new(&outline, &patch()) else { return Ok(()) };
            for place in axes.places() {
                for (i, &corner) in outline.iter().enumerate() {
                    let edge = outline[(i + 1) % outline.len()] - corner;
                    prop_assert!(edge.cross(place - corner).z > -1e-9);
                }
            }
            if axes.axes.len() == 2 {
                let light = |place: DVec3| Rgb::new(1.0, 2.0, 3.0) * (4.0 + place.x - 2.0 * place.y);
                let looked: Vec<Rgb> = axes.places().map(light).collect();
                let linear = axes.linear_light(|place| looked[place as usize], 0.0);
                prop_assert!((axes.at(&linear, outline[0]) - light(outline[0])).length() < 1e-9);
            }
        }
    }
}
