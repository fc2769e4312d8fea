// Pass (d): from radiance to what a display shows (Hardt & Teller, section 2.7, and what a display needs besides).

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var picture: texture_2d<f32>;

// One triangle that covers the picture.
@vertex
fn corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn pixel(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let colour = textureLoad(picture, vec2<u32>(position.xy), 0);
    let shown = select(colour.rgb, tone_curve(colour.rgb * frame.exposure), frame.is_light == 1u);
    return vec4(encode_srgb(shown), colour.a);
}
