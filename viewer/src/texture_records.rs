//! Textures as the interpolant pass reads them: one array of words for all of them.
//!
//! | words | content |
//! |---|---|
//! | 0..256 | the linear value of every 8-bit sRGB one, as f32: the same table for the shader and its twin |
//! | then | the texels of all textures, row after row, red in the lowest byte |
//! | then | by triangle with a texture, u and v of its three corners, as f32 |

use glam::{DVec2, Vec2, Vec3};
use scene::{Baked, TextureMap, decode_srgb};

/// Where a triangle's texture lies in the words.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TexturePlace {
    /// The word of the first texel; 0 for no texture.
    pub texels: u32,
    /// Width, and height in the upper half.
    pub size: u32,
    /// The word of the first corner's u.
    pub corners: u32,
}

/// The words, and by triangle of the bake where its texture is. Both are empty where a bake has no textures, and there
/// are no words beyond what u32 counts.
pub(crate) fn texture_words(baked: &Baked) -> (Vec<u32>, Vec<TexturePlace>) {
    let scene = &baked.scene;
    let maps: Vec<Option<(u32, TextureMap)>> = scene.polygon_ids().map(|polygon| scene.texture_map(polygon)).collect();
    let texels: u64 = scene.textures.iter().map(|texture| texture.texels.len() as u64).sum();
    if maps.iter().all(Option::is_none) || 256 + texels + 6 * baked.triangles.len() as u64 > u64::from(u32::MAX) {
        return (Vec::new(), Vec::new());
    }
    let mut words: Vec<u32> = (0..=255).map(|value| decode_srgb(value).to_bits()).collect();
    let mut textures = Vec::new();
    for texture in &scene.textures {
        textures.push((words.len() as u32, texture.width | texture.height << 16));
        words.extend(texture.texels.iter().map(|&[r, g, b]| u32::from_le_bytes([r, g, b, 0])));
    }
    let places = (0..).zip(&baked.triangles).map(|(id, triangle)| {
        let Some((texture, map)) = maps[triangle.polygon as usize] else { return TexturePlace::default() };
        let corners = baked.corners(id).map(|corner| map.at(corner));
        // Whole repeats make no difference, but cost digits in f32.
        let repeats = corners.iter().copied().fold(DVec2::INFINITY, DVec2::min).floor();
        let (texels, size) = textures[texture as usize];
        let place = TexturePlace { texels, size, corners: words.len() as u32 };
        words.extend(corners.iter().flat_map(|&corner| (corner - repeats).as_vec2().to_array()).map(f32::to_bits));
        place
    });
    let places = places.collect();
    (words, places)
}

/// The linear colour of a triangle's texture at barycentrics (s, t), bilinear and repeated; 1 without one. The shader's
/// `texture_colour`, operation for operation.
#[inline]
pub(crate) fn texture_colour(words: &[u32], place: TexturePlace, s: f32, t: f32) -> Vec3 {
    if place.texels == 0 {
        return Vec3::ONE;
    }
    let word = |index: u32| f32::from_bits(words[index as usize]);
    let corner = |i: u32| Vec2::new(word(place.corners + 2 * i), word(place.corners + 2 * i + 1));
    let a = corner(0);
    let uv = a + (corner(1) - a) * s + (corner(2) - a) * t;
    let (width, height) = ((place.size & 0xffff) as i32, (place.size >> 16) as i32);
    let (x, x_part) = whole_and_part((uv.x - whole_and_part(uv.x).0 as f32) * width as f32 - 0.5);
    let (y, y_part) = whole_and_part((uv.y - whole_and_part(uv.y).0 as f32) * height as f32 - 0.5);
    // From -1 to the size, and repeated: a division would take longer than all else.
    let wrapped = |at: i32, size: i32| {
        if at < 0 {
            at + size
        } else if at < size {
            at
        } else {
            at - size
        }
    };
    let columns = [wrapped(x, width), wrapped(x + 1, width)];
    let row = |y: i32| {
        let first = place.texels as usize + (wrapped(y, height) * width) as usize;
        let texel = |column: i32| {
            let [r, g, b, _] = words[first + column as usize].to_le_bytes();
            Vec3::new(word(r.into()), word(g.into()), word(b.into()))
        };
        texel(columns[0]) * (1.0 - x_part) + texel(columns[1]) * x_part
    };
    row(y) * (1.0 - y_part) + row(y + 1) * y_part
}

/// The next whole number down, and what is above it: `floor` is a call where a processor need not have it.
#[inline]
fn whole_and_part(x: f32) -> (i32, f32) {
    let towards_0 = x as i32;
    let whole = towards_0 - i32::from(towards_0 as f32 > x);
    (whole, x - whole as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_room::{room, textured_room};

    #[test]
    fn without_textures_there_are_no_words() {
        assert_eq!(texture_words(&Baked::default()), (vec![], vec![]));
        assert_eq!(texture_words(&room()), (vec![], vec![]));
        assert_eq!(texture_colour(&[], TexturePlace::default(), 0.3, 0.3), Vec3::ONE);
    }

    /// Against the texture's own samples.
    #[test]
    fn colours_are_the_samples_of_the_texture() {
        let baked = textured_room();
        let (words, places) = texture_words(&baked);
        let mut textured = 0;
        for (id, (triangle, place)) in (0..).zip(baked.triangles.iter().zip(&places)) {
            let Some((texture, map)) = baked.scene.texture_map(triangle.polygon) else { continue };
            textured += 1;
            let [a, b, c] = baked.corners(id);
            for (s, t) in [(0.1f32, 0.2f32), (0.7, 0.1), (0.33, 0.34)] {
                let point = a + (b - a) * f64::from(s) + (c - a) * f64::from(t);
                let exact = baked.scene.textures[texture as usize].sample(map.at(point).as_vec2());
                let ours = texture_colour(&words, *place, s, t);
                assert!((ours - exact).abs().max_element() < 1e-3, "{ours} {exact}");
            }
        }
        assert!(textured > 0);
    }
}
