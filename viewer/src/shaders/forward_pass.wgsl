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
    if index / 3u == frame.triangles {
        return Corner(sky_corner(index % 3u), frame.triangles);
    }
    // Relative to the eye first, so that the rounding of a far origin does not reach the picture.
    return Corner(frame.clip_from_eye * vec4(position(index) - frame.eye, 1.0), index / 3u);
}

// One triangle that covers the picture behind all others: less far than what is cleared by the least that a depth buffer
// tells apart, of reversed depth in WebGPU, and of 24 bits in WebGL2.
fn sky_corner(index: u32) -> vec4<f32> {
    let depth = select(1e-30, 0.9999999, ROWS_GO_UP);
    return vec4(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, depth, 1.0);
}

// Back sides are black, but for those of sheets.
@fragment
fn pixel(
    @builtin(position) place: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
    @builtin(front_facing) front: bool
) -> @location(0) vec4<f32> {
    let at = vec2(place.x, select(place.y, frame.size.y - place.y, ROWS_GO_UP));
    var colour = vec3(0.0);
    if triangle == frame.triangles {
        colour = background(at);
    } else if !front && word(triangle, SHEET) != 0u {
        discard; // Its other side is seen there.
    } else if front {
        colour = colour_at(triangle, at);
    }
    if frame.is_light == 1u {
        return vec4(encode_srgb(tone_curve(colour * frame.exposure)), 1.0);
    }
    return vec4(encode_srgb(colour), 1.0);
}
