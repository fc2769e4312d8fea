// What all passes of a frame share: its uniform (`frame.rs`) and the way to the display (`scene::exposure`).

struct Frame {
    // World axes, origin at the eye, to clip space with reversed infinite depth.
    clip_from_eye: mat4x4<f32>,
    // Metres.
    eye: vec3<f32>,
    // Distance of the picture plane in pixels: height / (2 tan(fov / 2)).
    focal: f32,
    right: vec3<f32>,
    // The factor 2^EV.
    exposure: f32,
    up: vec3<f32>,
    // 1 where the picture is light that the tone map exposes, 0 for a diagram.
    is_light: u32,
    forward: vec3<f32>,
    // The tone curve, by its number in `scene::ToneCurve`.
    curve: u32,
    // Pixels.
    size: vec2<f32>,
    // Place of the environment's first word among the textures; 0 for none.
    sky: u32,
    // Triangles of the bake, for the forward pass alone: the one after them is the sky.
    triangles: u32,
}

// Where the tone curve leaves the straight line.
const SHOULDER: f32 = 0.6;

// The frame's tone curve, as `scene::ToneCurve` has it.
fn tone_curve(linear: vec3<f32>) -> vec3<f32> {
    let x = max(linear, vec3(0.0));
    if frame.curve == 1u {
        return min(x, vec3(1.0));
    }
    if frame.curve == 2u {
        let y = min(x, vec3(1e3));
        return min(y * (2.51 * y + 0.03) / (y * (2.43 * y + 0.59) + 0.14), vec3(1.0));
    }
    let room = 1.0 - SHOULDER;
    let above = SHOULDER + room * (1.0 - exp(-(x - SHOULDER) / room));
    return select(above, x, x <= vec3(SHOULDER));
}

// The sRGB transfer function (IEC 61966-2-1).
fn encode_srgb(linear: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, 12.92 * linear, linear <= vec3(0.0031308));
}
