// All passes in one, for browsers: what is seen, its light, and what a display makes of it.

@group(0) @binding(0) var<uniform> frame: Frame;

// Whether the API counts rows of pixels from below, as WebGL2 does.
override ROWS_GO_UP: bool = false;

struct Corner {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
}

// Three corners a triangle, none shared: which of a triangle's corners a flat attribute is taken from differs between
// WebGPU and WebGL2, and so all three say the same.
@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    // Relative to the eye first, so that the rounding of a far origin does not reach the picture.
    return Corner(frame.clip_from_eye * vec4(position(index) - frame.eye, 1.0), index / 3u);
}

// Back sides are black.
@fragment
fn pixel(
    @builtin(position) place: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
    @builtin(front_facing) front: bool
) -> @location(0) vec4<f32> {
    if !front {
        return vec4(0.0, 0.0, 0.0, 1.0);
    }
    let row = select(place.y, frame.size.y - place.y, ROWS_GO_UP);
    let colour = colour_at(triangle, vec2(place.x, row));
    if frame.is_light == 1u {
        return vec4(encode_srgb(tone_curve(colour * frame.exposure)), 1.0);
    }
    return vec4(encode_srgb(colour), 1.0);
}
