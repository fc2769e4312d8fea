//! Whether a block is crossed by one edge at most, as far as its boundary tells (Guo 1998, section 4.3).
//!
//! What we do differently: a boundary with less contrast than the classification asks for is even, and passes the tests of
//! luminance; the paper's threshold half-way would part its noise.

use glam::Vec2;

use crate::block::{Block, MOST_ON_BOUNDARY};

/// What a pixel says of itself: luminance as shown, and its object. None if it is not evaluated.
pub(crate) type Look<'a> = dyn Fn([u32; 2]) -> Option<(f32, u32)> + 'a;

/// What the tests say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Simplicity {
    /// One edge at most.
    Simple,
    /// More, or one with a corner.
    Complex,
    /// These pixels of the inner layer must be evaluated to tell.
    Wants(Vec<[u32; 2]>),
}

/// How far a tangent may turn from the chord between two transitions, radians per pixel of its length (Guo's t_m).
const TANGENT: f32 = 0.05 * std::f32::consts::PI;

/// Steps along the inner layer in which the edge must be met again on either side: at a distance of one pixel that is an
/// edge nearly along the boundary.
const REACH: i32 = 3;

/// Least side of a block with an inner layer of its own, steps.
const LEAST_SIDE: u32 = 4;

/// Tests an elementary block whose boundary is known. `values` are its luminance as shown and objects, clockwise, and `is_even`
/// whether its contrast is less than an edge's.
pub(crate) fn simplicity(block: &Block, values: &[(f32, u32)], is_even: bool, look: &Look<'_>) -> Simplicity {
    if !passes_object_test(values) {
        return Simplicity::Complex;
    }
    if is_even {
        return Simplicity::Simple;
    }
    let (threshold, pattern) = pattern(values);
    let pattern = &pattern[..values.len()];
    let count = pattern.len();
    let transitions: Vec<usize> = (0..count).filter(|&i| pattern[i] != pattern[(i + 1) % count]).collect();
    match transitions[..] {
        [] => Simplicity::Simple,
        [first, second] if block.sides().iter().all(|side| *side >= LEAST_SIDE) => {
            first_order(block, pattern, threshold, [first, second], look)
        }
        [_, _] => Simplicity::Simple,
        _ => Simplicity::Complex,
    }
}

/// At most two objects, and each in one piece.
fn passes_object_test(values: &[(f32, u32)]) -> bool {
    let count = values.len();
    (0..count).filter(|&i| values[i].1 != values[(i + 1) % count].1).count() <= 2
}

/// The threshold half-way, and which pixels exceed it: of values smoothed over three (Bartlett), without spans of one pixel
/// (median).
fn pattern(values: &[(f32, u32)]) -> (f32, [bool; MOST_ON_BOUNDARY]) {
    let count = values.len();
    let at = |i: usize| values[i % count].0;
    let (low, high) =
        values.iter().fold((f32::MAX, f32::MIN), |(low, high), value| (low.min(value.0), high.max(value.0)));
    let threshold = 0.5 * (low + high);
    let exceeds = |i: usize| 0.25 * at(i + count - 1) + 0.5 * at(i) + 0.25 * at(i + 1) > threshold;
    let mut pattern = [false; MOST_ON_BOUNDARY];
    for (i, is_above) in pattern[..count].iter_mut().enumerate() {
        let near = [i + count - 1, i, i + 1].map(exceeds);
        *is_above = near.iter().filter(|above| **above).count() >= 2;
    }
    (threshold, pattern)
}

/// Compares the edge's tangents at both ends with the chord between them.
fn first_order(block: &Block, pattern: &[bool], threshold: f32, ends: [usize; 2], look: &Look<'_>) -> Simplicity {
    let inner = Block { low: block.low.map(|place| place + 1), high: block.high.map(|place| place - 1) };
    let place = |[x, y]: [u32; 2]| Vec2::new(x as f32, y as f32);
    let middle = |around: &Block, step: i32| {
        let around_at = |step: i32| place(around.on_boundary(step.rem_euclid(around.perimeter() as i32) as u32));
        0.5 * (around_at(step) + around_at(step + 1))
    };
    let outer = ends.map(|end| middle(block, end as i32));
    let chord = outer[1] - outer[0];
    let allowed = TANGENT * chord.length();
    let mut wanted = Vec::new();
    for (end, outer) in ends.into_iter().zip(outer) {
        let start = nearest_step(&inner, block.on_boundary(end as u32));
        let rises = !pattern[end];
        match transition(&inner, start, threshold, rises, look) {
            Transition::At(step) => {
                let tangent = middle(&inner, step) - outer;
                let turn = tangent.angle_to(chord).abs();
                if turn.min(std::f32::consts::PI - turn) > allowed {
                    return Simplicity::Complex;
                }
            }
            Transition::Nowhere => return Simplicity::Complex,
            Transition::Wants(pixels) => wanted.extend(pixels),
        }
    }
    if wanted.is_empty() { Simplicity::Simple } else { Simplicity::Wants(wanted) }
}

/// Where an edge is met on the inner layer.
enum Transition {
    At(i32),
    Nowhere,
    Wants(Vec<[u32; 2]>),
}

/// Looks for the edge from a step of the inner layer on, in both directions, until it is met; it rises clockwise or falls.
fn transition(inner: &Block, start: i32, threshold: f32, rises: bool, look: &Look<'_>) -> Transition {
    let pixel = |step: i32| inner.on_boundary(step.rem_euclid(inner.perimeter() as i32) as u32);
    let above = |step: i32| look(pixel(step)).map(|(luminance, _)| luminance > threshold);
    for reach in 0..=REACH {
        let missing: Vec<[u32; 2]> =
            [start - reach, start + reach + 1].map(pixel).into_iter().filter(|&pixel| look(pixel).is_none()).collect();
        if !missing.is_empty() {
            return Transition::Wants(missing);
        }
        for step in [start - reach, start + reach] {
            if above(step) == Some(!rises) && above(step + 1) == Some(rises) {
                return Transition::At(step);
            }
        }
    }
    Transition::Nowhere
}

/// The step of a boundary that is nearest to a pixel.
fn nearest_step(around: &Block, pixel: [u32; 2]) -> i32 {
    let distance = |step: u32| {
        let near = around.on_boundary(step);
        near[0].abs_diff(pixel[0]) + near[1].abs_diff(pixel[1])
    };
    (0..around.perimeter()).min_by_key(|&step| distance(step)).unwrap_or(0) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: Block = Block { low: [0, 0], high: [8, 8] };

    /// What the tests say of a block whose every pixel may be looked at.
    fn told(see: impl Fn(f32, f32) -> (f32, u32)) -> Simplicity {
        let look = |[x, y]: [u32; 2]| see(x as f32, y as f32);
        let values: Vec<(f32, u32)> = (0..BLOCK.perimeter()).map(|step| look(BLOCK.on_boundary(step))).collect();
        simplicity(&BLOCK, &values, false, &|pixel| Some(look(pixel)))
    }

    fn light(is_bright: bool) -> (f32, u32) {
        (if is_bright { 0.8 } else { 0.2 }, 1)
    }

    #[test]
    fn straight_edges_at_any_angle_are_simple() {
        assert_eq!(told(|_, _| light(true)), Simplicity::Simple);
        for angle in 0..32 {
            let normal = Vec2::from_angle(angle as f32 * std::f32::consts::PI / 16.0);
            let edge = told(|x, y| light((Vec2::new(x, y) - 4.2).dot(normal) > 0.0));
            assert_eq!(edge, Simplicity::Simple, "{angle}");
        }
    }

    #[test]
    fn corners_bars_and_a_third_object_are_complex() {
        assert_eq!(told(|x, y| light(x > 5.5 && y < 2.5)), Simplicity::Complex, "a corner");
        assert_eq!(told(|x, _| light((2.5..5.5).contains(&x))), Simplicity::Complex, "a bar");
        assert_eq!(told(|x, _| (0.5, x as u32 / 3)), Simplicity::Complex, "three objects");
        assert_eq!(told(|x, _| (0.5, x as u32 / 5)), Simplicity::Simple, "two");
    }

    #[test]
    fn noise_of_one_pixel_is_no_edge_and_faint_noise_none_at_all() {
        let speck = |x: f32, y: f32| light(x > 4.5 || (x, y) == (0.0, 4.0));
        assert_eq!(told(speck), Simplicity::Simple);
        let noise: Vec<(f32, u32)> = (0..32).map(|i| (0.5 + 0.001 * (i * 7 % 5) as f32, 1)).collect();
        assert_eq!(simplicity(&BLOCK, &noise, true, &|_| None), Simplicity::Simple);
    }

    #[test]
    fn of_the_inner_layer_pixels_at_the_transitions_are_asked_for() {
        let values: Vec<(f32, u32)> = (0..32).map(|step| light(BLOCK.on_boundary(step)[0] > 4)).collect();
        let Simplicity::Wants(pixels) = simplicity(&BLOCK, &values, false, &|_| None) else {
            panic!("nothing is known")
        };
        assert_eq!(pixels, [[4, 1], [5, 1], [5, 7], [4, 7]]);
    }
}
