// The picture of polygon hardware: colours of the corners, interpolated, and shown.

@group(0) @binding(0) var<uniform> frame: Frame;

struct Corner {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) radiance: vec3<f32>,
    // 1 where its back is the other side of the same surface.
    @location(1) sheet: f32,
}

@vertex
fn corner(
    @location(0) position: vec3<f32>,
    @location(1) radiance: vec3<f32>,
    @location(2) sheet: f32
) -> Corner {
    return Corner(frame.clip_from_eye * vec4(position - frame.eye, 1.0), radiance, sheet);
}

// Back sides are black, but for those of sheets: their other side is seen there.
@fragment
fn pixel(in: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    if !front && in.sheet > 0.5 { discard; }
    let radiance = select(vec3(0.0), in.radiance, front);
    return vec4(encode_srgb(tone_curve(radiance * frame.exposure)), 1.0);
}
