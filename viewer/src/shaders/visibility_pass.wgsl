// Passes (a) and (b): which triangle is seen at a pixel, and where on it (Hardt & Teller, sections 2.4 and 2.5).
//
// What the paper got from a 256 x 256 texture of its own coordinates is a perspective-correct vertex attribute here.

@group(0) @binding(0) var<uniform> frame: Frame;

struct Corner {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat, either) triangle: u32,
    @location(1) @interpolate(perspective, center) barycentrics: vec2<f32>,
}

@vertex
fn corner(@builtin(vertex_index) index: u32, @location(0) position: vec3<f32>) -> Corner {
    let number = index % 3u;
    var out: Corner;
    // Relative to the eye first, so that the rounding of a far origin does not reach the picture.
    out.clip = frame.clip_from_eye * vec4(position - frame.eye, 1.0);
    out.triangle = index / 3u;
    out.barycentrics = vec2(f32(number == 1u), f32(number == 2u));
    return out;
}

// The triangle's id plus one, the top bit set on back sides; and the barycentrics, 16 bits each.
@fragment
fn pixel(in: Corner, @builtin(front_facing) front: bool) -> @location(0) vec2<u32> {
    return vec2(in.triangle + select(0x80000001u, 1u, front), pack2x16unorm(in.barycentrics));
}
