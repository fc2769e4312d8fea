//! Least squares: light as a plane over an element.

use glam::{DVec2, DVec3};
use scene::{Rgb, luminance};

use crate::Elements;
use crate::solution::ElementLight;

/// Gradients of the planes through the origin that fit weighted samples best, one for each channel. Zero where the
/// samples do not span a plane.
pub fn slope<const N: usize>(samples: impl Iterator<Item = (DVec2, [f64; N], f64)>) -> [DVec2; N] {
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    let mut moments = [DVec2::ZERO; N];
    for (at, values, weight) in samples {
        uu += weight * at.x * at.x;
        uv += weight * at.x * at.y;
        vv += weight * at.y * at.y;
        for (moment, value) in moments.iter_mut().zip(values) {
            *moment += at * (weight * value);
        }
    }
    let determinant = uu * vv - uv * uv;
    if determinant <= 1e-12 * uu * vv {
        return [DVec2::ZERO; N];
    }
    moments.map(|m| DVec2::new(m.x * vv - m.y * uv, m.y * uu - m.x * uv) / determinant)
}

/// Gradients along u and v, per metre, of the plane through the origin that fits samples of a colour best. A sample is its place,
/// metres, its colour and its weight. Zero where they do not span a plane.
pub fn colour_slope(samples: impl Iterator<Item = (DVec2, Rgb, f64)>) -> (Rgb, Rgb) {
    let [r, g, b] = slope(samples.map(|(at, value, weight)| (at, value.to_array(), weight)));
    (Rgb::new(r.x, g.x, b.x), Rgb::new(r.y, g.y, b.y))
}

/// Sets every inner node to the plane that fits its children's planes best, and records how far they stray from it.
/// Children have higher ids than their parents.
pub fn fit_inner_nodes(elements: &Elements, light: &mut [ElementLight]) {
    for node in (0..light.len()).rev() {
        let Some(patch) = elements.patch_of(node as u32) else { continue };
        if elements.nodes[node].child_count == 0 {
            continue;
        }
        let frame = &elements.patches[patch as usize];
        let parent = &elements.nodes[node];
        let children =
            || elements.children(node as u32).map(|child| (&elements.nodes[child as usize], light[child as usize]));
        let irradiance = children().map(|(child, light)| light.irradiance * child.area).sum::<Rgb>() / parent.area;
        let place =
            |centre: DVec3| DVec2::new(frame.u.dot(centre - parent.centre), frame.v.dot(centre - parent.centre));
        // A child counts as the four points of its plane at ±1/√12 of its cell, which have the cell's second moments.
        let samples = children().flat_map(|(child, light)| {
            let reach = (child.cell_max - child.cell_min) / 12f64.sqrt();
            [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(x, y)| {
                let offset = reach * DVec2::new(x, y);
                let value = light.irradiance + light.gradient_u * offset.x + light.gradient_v * offset.y;
                (place(child.centre) + offset, value - irradiance, child.area)
            })
        });
        let (gradient_u, gradient_v) = colour_slope(samples);
        let mut square = 0.0;
        for (child, light) in children() {
            let at = place(child.centre);
            let half = (child.cell_max - child.cell_min) / 2.0;
            let step = luminance((light.irradiance - irradiance - gradient_u * at.x - gradient_v * at.y).abs());
            let twist_u = luminance((light.gradient_u - gradient_u).abs()) * half.x;
            let twist_v = luminance((light.gradient_v - gradient_v).abs()) * half.y;
            // The mean square of a slope over its cell is a third of that at the border.
            let inside = (twist_u * twist_u + twist_v * twist_v) / 3.0 + light.deviation * light.deviation;
            square += (step * step + inside) * child.area / parent.area;
        }
        let deviation = square.sqrt();
        light[node] = ElementLight { irradiance, gradient_u, gradient_v, deviation };
    }
}
