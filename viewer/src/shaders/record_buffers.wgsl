// The records of a bake (`records.rs`) in storage buffers.

// Eight rows a triangle.
@group(1) @binding(0) var<storage, read> triangles: array<vec4<u32>>;
@group(1) @binding(1) var<storage, read> elements: array<vec4<f32>>;
// Three corners of three numbers a triangle.
@group(1) @binding(2) var<storage, read> corners: array<f32>;
// The table of sRGB, texels and texture coordinates, as `texture_records.rs` lays them out, then the environment.
@group(1) @binding(3) var<storage, read> textures: array<u32>;

// A row of a triangle's record.
fn record(id: u32, row: u32) -> vec4<u32> {
    return triangles[8u * id + row];
}

// The radiance of a leaf element by the solver's constant light.
fn element(index: u32) -> vec3<f32> {
    return elements[index].rgb;
}

// A corner of a triangle, metres.
fn position(index: u32) -> vec3<f32> {
    return vec3(corners[3u * index], corners[3u * index + 1u], corners[3u * index + 2u]);
}

fn texture_word(index: u32) -> u32 {
    return textures[index];
}
