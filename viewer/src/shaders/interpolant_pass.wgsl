// Pass (c): the light at every pixel of the visibility buffer.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var visibility: texture_2d<u32>;
// Radiance or display-linear colour; the fourth number is 1 where something was hit.
@group(0) @binding(2) var picture: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn interpolate(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if any(vec2<f32>(pixel) >= frame.size) {
        return;
    }
    let seen = textureLoad(visibility, pixel, 0).x;
    let place = vec2<f32>(pixel) + 0.5;
    var colour = vec3(0.0);
    if seen == 0u {
        colour = background(place);
    } else if seen < 0x80000000u {
        // Back sides are black.
        colour = colour_at(seen - 1u, place);
    }
    textureStore(picture, pixel, vec4(colour, f32(seen != 0u)));
}
