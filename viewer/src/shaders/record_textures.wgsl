// The records of a bake (`records.rs`) in pictures, row after row of texels, where a browser has no storage buffers.

// A texel a row of a triangle's record.
@group(1) @binding(0) var triangles: texture_2d<u32>;
@group(1) @binding(1) var elements: texture_2d<f32>;
// A texel a corner.
@group(1) @binding(2) var corners: texture_2d<f32>;
// A texel a word.
@group(1) @binding(3) var textures: texture_2d<u32>;

// Texels in a row of each picture, a power of two; `webgl2.js` says the same.
const WIDTH = 2048u;

fn texel_of(index: u32) -> vec2<u32> {
    return vec2(index % WIDTH, index / WIDTH);
}

// A row of a triangle's record.
fn record(id: u32, row: u32) -> vec4<u32> {
    return textureLoad(triangles, texel_of(8u * id + row), 0);
}

// The radiance of a leaf element by the solver's constant light.
fn element(index: u32) -> vec3<f32> {
    return textureLoad(elements, texel_of(index), 0).rgb;
}

// A corner of a triangle, metres.
fn position(index: u32) -> vec3<f32> {
    return textureLoad(corners, texel_of(index), 0).xyz;
}

fn texture_word(index: u32) -> u32 {
    return textureLoad(textures, texel_of(index), 0).x;
}
