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
    padding: u32,
    // Pixels.
    size: vec2<f32>,
}

// Where the tone curve leaves the straight line.
const SHOULDER: f32 = 0.6;

// Identity up to a shoulder, then an exponential approach to 1 with a continuous slope.
fn tone_curve(linear: vec3<f32>) -> vec3<f32> {
    let room = 1.0 - SHOULDER;
    let above = SHOULDER + room * (1.0 - exp(-(linear - SHOULDER) / room));
    return select(above, max(linear, vec3(0.0)), linear <= vec3(SHOULDER));
}

// The sRGB transfer function (IEC 61966-2-1).
fn encode_srgb(linear: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, 12.92 * linear, linear <= vec3(0.0031308));
}
