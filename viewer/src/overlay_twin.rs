//! The panels, painted over the picture on the CPU: the twin of `overlay_pass.rs`, in sRGB values as egui blends them.

use std::collections::HashMap;

use egui::{Color32, ColorImage, ImageData, Pos2, TextureId, epaint::Primitive, epaint::Vertex};

use crate::painting::Painting;

/// The textures that paintings have brought.
#[derive(Default)]
pub(crate) struct OverlayTwin {
    textures: HashMap<TextureId, ColorImage>,
}

impl OverlayTwin {
    /// Takes over the textures that a painting brings.
    pub fn take_textures(&mut self, painting: &Painting) {
        for (id, delta) in painting.textures.set.iter().flat_map(|(id, deltas)| deltas.iter().map(move |d| (id, d))) {
            let ImageData::Color(image) = &delta.image;
            match (delta.pos, self.textures.get_mut(id)) {
                (Some([left, top]), Some(texture)) => {
                    for (y, row) in image.pixels.chunks_exact(image.size[0].max(1)).enumerate() {
                        let first = (top + y) * texture.size[0] + left;
                        if let Some(target) = texture.pixels.get_mut(first..first + row.len()) {
                            target.copy_from_slice(row);
                        }
                    }
                }
                _ => {
                    self.textures.insert(*id, image.as_ref().clone());
                }
            }
        }
    }

    /// Paints over pixels, in rows of a width, and frees what the painting no longer needs.
    pub fn paint(&mut self, painting: &Painting, width: u32, pixels: &mut [[u8; 3]]) {
        let scale = painting.pixels_per_point;
        for clipped in &painting.primitives {
            let Primitive::Mesh(mesh) = &clipped.primitive else { continue };
            let Some(texture) = self.textures.get(&mesh.texture_id) else { continue };
            let clip = clipped.clip_rect * scale;
            let mut canvas = Canvas { pixels, width: width as usize, clip: [clip.min, clip.max], texture };
            for corners in mesh.indices.chunks_exact(3) {
                let corner = |i: usize| mesh.vertices.get(corners[i] as usize).copied();
                if let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) {
                    canvas.triangle(
                        [a, b, c].map(|vertex| Vertex { pos: (vertex.pos.to_vec2() * scale).to_pos2(), ..vertex }),
                    );
                }
            }
        }
        for id in &painting.textures.free {
            self.textures.remove(id);
        }
    }
}

/// What triangles are painted on.
struct Canvas<'a> {
    pixels: &'a mut [[u8; 3]],
    width: usize,
    /// Corners of the rectangle that is painted on, pixels.
    clip: [Pos2; 2],
    texture: &'a ColorImage,
}

impl Canvas<'_> {
    /// Paints a triangle whose corners are in pixels.
    fn triangle(&mut self, [a, mut b, mut c]: [Vertex; 3]) {
        let doubled = |p: Pos2, q: Pos2, r: Pos2| (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
        if doubled(a.pos, b.pos, c.pos) < 0.0 {
            (b, c) = (c, b);
        }
        let area = doubled(a.pos, b.pos, c.pos);
        if area.is_nan() || area <= 0.0 {
            return;
        }
        let height = self.pixels.len() / self.width;
        let [low, high] = self.clip;
        // Pixels whose middles are within the rectangle.
        let range = |least: f32, most: f32, low: f32, high: f32, count: usize| {
            let first = (least.max(low) - 0.5).ceil().max(0.0) as usize;
            let end = ((most.min(high) - 0.5).ceil().max(0.0) as usize).min(count);
            first..end
        };
        let bounds = |of: &dyn Fn(&Vertex) -> f32| {
            let values = [&a, &b, &c].map(of);
            (
                values.iter().copied().fold(f32::INFINITY, f32::min),
                values.iter().copied().fold(f32::NEG_INFINITY, f32::max),
            )
        };
        let (left, right) = bounds(&|vertex| vertex.pos.x);
        let (top, bottom) = bounds(&|vertex| vertex.pos.y);
        for y in range(top, bottom, low.y, high.y, height) {
            for x in range(left, right, low.x, high.x, self.width) {
                let place = Pos2::new(x as f32 + 0.5, y as f32 + 0.5);
                let edges = [(b.pos, c.pos), (c.pos, a.pos), (a.pos, b.pos)];
                let shares = edges.map(|(from, to)| doubled(from, to, place));
                // A pixel on an edge belongs to the triangle below it or to the right: to one of two neighbours.
                let inside = shares.iter().zip(edges).all(|(&share, (from, to))| {
                    let is_first = to.y < from.y || to.y == from.y && to.x > from.x;
                    share > 0.0 || share == 0.0 && is_first
                });
                if inside {
                    let [u, v, w] = shares.map(|share| share / area);
                    let mix = |of: &dyn Fn(&Vertex) -> f32| of(&a) * u + of(&b) * v + of(&c) * w;
                    let texel = self.texel(mix(&|vertex| vertex.uv.x), mix(&|vertex| vertex.uv.y));
                    let channel = |i: usize| mix(&|vertex| f32::from(vertex.color[i])) * f32::from(texel[i]) / 255.0;
                    let pixel = &mut self.pixels[y * self.width + x];
                    let rest = 1.0 - channel(3) / 255.0;
                    // Colours come multiplied by their opacity.
                    *pixel = std::array::from_fn(|i| (channel(i) + f32::from(pixel[i]) * rest + 0.5) as u8);
                }
            }
        }
    }

    /// The texel at a place, 0..=1 each way: glyphs are painted texel by pixel.
    fn texel(&self, u: f32, v: f32) -> Color32 {
        let [width, height] = self.texture.size;
        let index = |place: f32, count: usize| ((place * count as f32) as usize).min(count.saturating_sub(1));
        self.texture.pixels.get(index(v, height) * width + index(u, width)).copied().unwrap_or(Color32::WHITE)
    }
}

#[cfg(test)]
mod tests {
    use egui::{ClippedPrimitive, Mesh, Rect, TexturesDelta, pos2, vec2};

    use super::*;

    fn painted(rectangle: Rect, clip: Rect, colour: Color32) -> Vec<[u8; 3]> {
        let mut mesh = Mesh::default();
        mesh.add_colored_rect(rectangle, colour);
        let primitives = vec![ClippedPrimitive { clip_rect: clip, primitive: Primitive::Mesh(mesh) }];
        let mut overlay = OverlayTwin::default();
        overlay.textures.insert(TextureId::default(), ColorImage::filled([1, 1], Color32::WHITE));
        let mut pixels = vec![[100; 3]; 8 * 8];
        let painting = Painting { primitives, textures: TexturesDelta::default(), pixels_per_point: 1.0 };
        overlay.paint(&painting, 8, &mut pixels);
        pixels
    }

    /// The diagonal that two triangles share is painted once.
    #[test]
    fn every_pixel_of_a_rectangle_is_painted_once() {
        let everywhere = Rect::from_min_size(Pos2::ZERO, vec2(8.0, 8.0));
        let half = Color32::from_rgba_premultiplied(50, 0, 0, 128);
        let pixels = painted(Rect::from_min_max(pos2(1.0, 2.0), pos2(7.0, 8.0)), everywhere, half);
        for (i, pixel) in pixels.iter().enumerate() {
            let inside = (1..7).contains(&(i % 8)) && i / 8 >= 2;
            assert_eq!(*pixel, if inside { [100, 50, 50] } else { [100; 3] }, "{i}");
        }
    }

    #[test]
    fn what_is_clipped_or_outside_is_not_painted() {
        let clip = Rect::from_min_max(pos2(3.0, 3.0), pos2(5.0, 5.0));
        let huge = Rect::from_min_max(pos2(-1e6, -1e6), pos2(1e6, 1e6));
        let pixels = painted(huge, clip, Color32::WHITE);
        assert_eq!(pixels.iter().filter(|pixel| **pixel == [255; 3]).count(), 4);
        for odd in [f32::NAN, f32::INFINITY] {
            painted(Rect::from_min_max(pos2(odd, 0.0), pos2(4.0, odd)), clip, Color32::WHITE);
        }
    }
}
