// Passes (a) and (b): which triangle is seen at a pixel (Hardt & Teller, sections 2.4 and 2.5).
//
// Where on it, whoever evaluates the pixel finds out.

@group(0) @binding(0) var<uniform> frame: Frame;

struct Corner {
    @invariant @builtin(position) clip: vec4<f32>,
    // That of the triangle's first corner; the top bit set where its back is the other side of the same surface.
    @location(0) @interpolate(flat) triangle: u32,
}

@vertex
fn corner(@location(0) position: vec3<f32>, @location(1) triangle: u32) -> Corner {
    // Relative to the eye first, so that the rounding of a far origin does not reach the picture.
    return Corner(frame.clip_from_eye * vec4(position - frame.eye, 1.0), triangle);
}

// The triangle's id plus one, the top bit set on back sides. Where that of a sheet would be seen its other side is.
@fragment
fn pixel(in: Corner, @builtin(front_facing) front: bool) -> @location(0) u32 {
    let id = in.triangle & 0x7fffffffu;
    if !front && id != in.triangle { discard; }
    return id + select(0x80000001u, 1u, front);
}
