// The light at a point of the picture (Hardt & Teller, section 2.6), wherever the records are fetched from: the source
// before this one says what `record`, `position`, `element` and `texture_word` are. `twin.rs` says the same in Rust.

// Rows of a triangle's record (`records.rs`), four words each. The first three words are numbers: the coefficients of
// the interpolant / pi, which is the radiance of a white surface; reflectance; emitted radiance.
const A = 0u;
const B2 = 1u;
const C2 = 2u;
const D = 3u;
const E2 = 4u;
const F = 5u;
const REFLECTANCE = 6u;
const EMITTED = 7u;

// Rows by their fourth word: the leaf element, the classes of the edges, and the texture's first word of texels (0 for
// no texture), its width with its height in the upper half, its first word of the corners' coordinates, and whether its back
// is the other side of the same surface.
const ELEMENT = 0u;
const EDGES = 1u;
const TEXELS = 2u;
const TEXTURE_SIZE = 3u;
const TEXTURE_CORNERS = 4u;
const SHEET = 5u;

fn numbers(id: u32, row: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(record(id, row).xyz);
}

fn word(id: u32, row: u32) -> u32 {
    return record(id, row).w;
}

// Whether any triangle has a texture: without, nothing of it is evaluated.
override TEXTURED: bool;
// One pipeline is made per mode: what the others need costs nothing then.
override MODE: u32;
const SHADED = 0u;
const GOURAUD = 1u;
const IDS = 2u;
const BARYCENTRICS = 3u;
const ELEMENTS = 4u;
const MESH = 5u;
const DISCONTINUITIES = 6u;
const FALSE_COLOR = 7u;
const LIGHT = 8u;
const SPLIT = 9u;

// Where the ray through a pixel meets the plane of a triangle that faces the eye (Moeller and Trumbore 1997).
fn barycentrics(id: u32, pixel: vec2<f32>) -> vec2<f32> {
    let a = position(3u * id);
    let ab = position(3u * id + 1u) - a;
    let ac = position(3u * id + 2u) - a;
    let eye = frame.eye - a;
    let ray = ray_through(pixel);
    return vec2(dot(cross(ac, eye), ray), dot(cross(eye, ab), ray)) / max(dot(cross(ac, ab), ray), 1e-30);
}

// The direction, of any length, from the eye through a place in the picture.
fn ray_through(pixel: vec2<f32>) -> vec3<f32> {
    let x = pixel.x - 0.5 * frame.size.x;
    let y = 0.5 * frame.size.y - pixel.y;
    return frame.right * x + frame.up * y + frame.forward * frame.focal;
}

// What is seen past all triangles: the environment in pictures of light, and nothing in others.
fn background(pixel: vec2<f32>) -> vec3<f32> {
    if frame.sky == 0u || frame.is_light == 0u {
        return vec3(0.0);
    }
    return sky_along(ray_through(pixel));
}

// The radiance of the environment in a direction, bilinear (`sky_records.rs`).
fn sky_along(direction: vec3<f32>) -> vec3<f32> {
    let sides = texture_word(frame.sky);
    let size = vec2<i32>(i32(sides & 0xffffu), i32(sides >> 16u));
    // At the very zenith any column will do.
    let azimuth = atan2(direction.x, direction.y + 1e-30);
    let polar = atan2(length(direction.xy), direction.z);
    let place = vec2(azimuth / 6.2831853 + 0.5, polar / 3.14159265) * vec2<f32>(size) - 0.5;
    let part = place - floor(place);
    let first = vec2<i32>(floor(place));
    let upper = sky_texel(size, first) * (1.0 - part.x) + sky_texel(size, first + vec2(1, 0)) * part.x;
    let lower = sky_texel(size, first + vec2(0, 1)) * (1.0 - part.x) + sky_texel(size, first + vec2(1, 1)) * part.x;
    return upper * (1.0 - part.y) + lower * part.y;
}

// A texel of the environment; columns from -1 to the width repeat.
fn sky_texel(size: vec2<i32>, place: vec2<i32>) -> vec3<f32> {
    let inside = clamp(place.y, 0, size.y - 1) * size.x + wrapped(place.x, size.x);
    let texel = texture_word(frame.sky + 1u + u32(inside));
    let mantissas = vec3(texel, texel >> 9u, texel >> 18u) & vec3(511u);
    return vec3<f32>(mantissas) * exp2(f32(texel >> 27u) - 24.0);
}

fn colour_at(id: u32, pixel: vec2<f32>) -> vec3<f32> {
    let st = clamp(barycentrics(id, pixel), vec2(0.0), vec2(1.0));
    if MODE == GOURAUD || (MODE == SPLIT && pixel.x < 0.5 * frame.size.x) {
        return gouraud(id, st);
    } else if MODE == IDS {
        return id_colour(id);
    } else if MODE == BARYCENTRICS {
        return vec3(st, 0.0);
    } else if MODE == ELEMENTS {
        return overlay(tone_curve(element(word(id, ELEMENT)) * frame.exposure), id, pixel);
    } else if MODE == MESH {
        return overlay(tone_curve(interpolant(id, st) * frame.exposure), id, pixel);
    } else if MODE == DISCONTINUITIES {
        return overlay(0.35 * tone_curve(interpolant(id, st) * frame.exposure), id, pixel);
    } else if MODE == FALSE_COLOR {
        return false_color(id, st, pixel);
    } else if MODE == LIGHT {
        return light(id, st) + numbers(id, EMITTED);
    }
    return interpolant(id, st);
}

// The radiance of a white surface: A s^2 + 2B st + 2C s + D t^2 + 2E t + F, clamped at 0.
fn light(id: u32, st: vec2<f32>) -> vec3<f32> {
    let quadratic = (numbers(id, A) * st.x + numbers(id, B2) * st.y + numbers(id, C2)) * st.x
        + (numbers(id, D) * st.y + numbers(id, E2)) * st.y + numbers(id, F);
    return max(quadratic, vec3(0.0));
}

// What the surface makes of the light, and what it emits.
fn interpolant(id: u32, st: vec2<f32>) -> vec3<f32> {
    return light(id, st) * numbers(id, REFLECTANCE) * texture_colour(id, st) + numbers(id, EMITTED);
}

// Linear between the values at the corners: F, A + 2C + F and D + 2E + F.
fn gouraud(id: u32, st: vec2<f32>) -> vec3<f32> {
    let linear = (numbers(id, A) + numbers(id, C2)) * st.x + (numbers(id, D) + numbers(id, E2)) * st.y + numbers(id, F);
    return max(linear, vec3(0.0)) * numbers(id, REFLECTANCE) * texture_colour(id, st) + numbers(id, EMITTED);
}

// The linear colour of the triangle's texture, bilinear and repeated; 1 without one.
fn texture_colour(id: u32, st: vec2<f32>) -> vec3<f32> {
    if !TEXTURED {
        return vec3(1.0);
    }
    let texels = word(id, TEXELS);
    if texels == 0u {
        return vec3(1.0);
    }
    let corners = word(id, TEXTURE_CORNERS);
    let a = texture_corner(corners);
    let uv = a + (texture_corner(corners + 2u) - a) * st.x + (texture_corner(corners + 4u) - a) * st.y;
    let sides = word(id, TEXTURE_SIZE);
    let size = vec2<i32>(i32(sides & 0xffffu), i32(sides >> 16u));
    let place = (uv - floor(uv)) * vec2<f32>(size) - 0.5;
    let part = place - floor(place);
    let first = vec2<i32>(floor(place));
    let upper = texel(texels, size, first) * (1.0 - part.x) + texel(texels, size, first + vec2(1, 0)) * part.x;
    let lower = texel(texels, size, first + vec2(0, 1)) * (1.0 - part.x) + texel(texels, size, first + vec2(1, 1)) * part.x;
    return upper * (1.0 - part.y) + lower * part.y;
}

fn texture_corner(place: u32) -> vec2<f32> {
    return vec2(bitcast<f32>(texture_word(place)), bitcast<f32>(texture_word(place + 1u)));
}

// A texel in linear light; columns and rows from -1 to the size repeat.
fn texel(texels: u32, size: vec2<i32>, place: vec2<i32>) -> vec3<f32> {
    let inside = wrapped(place.y, size.y) * size.x + wrapped(place.x, size.x);
    let colour = texture_word(texels + u32(inside));
    let places = vec3(colour, colour >> 8u, colour >> 16u) & vec3(255u);
    return bitcast<vec3<f32>>(vec3(texture_word(places.x), texture_word(places.y), texture_word(places.z)));
}

// One by one: GLSL ES 3.00 selects no vectors of integers.
fn wrapped(at: i32, size: i32) -> i32 {
    let above = select(at, at - size, at >= size);
    return select(above, above + size, above < 0);
}

// A colour that neighbouring ids do not share: the id hashed (Jarzynski and Olano 2020, "pcg").
fn id_colour(id: u32) -> vec3<f32> {
    let state = id * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    let hash = (word >> 22u) ^ word;
    // Not below 0.04: a hit must not look like the background.
    return 0.04 + 0.96 * vec3<f32>(vec3(hash, hash >> 8u, hash >> 16u) & vec3(255u)) / 255.0;
}

// Illuminance: ten stops around middle grey on a ramp of even lightness, with lines at 1, 2 and 5 times powers of ten
// lux.
fn false_color(id: u32, st: vec2<f32>, pixel: vec2<f32>) -> vec3<f32> {
    let here = luminance(id, st);
    let place = clamp(log2(here * frame.exposure / 0.18) / 10.0 + 0.5, 0.0, 1.0);
    let part = place * 9.0;
    let index = min(u32(part), 8u);
    let colour = mix(RAMP[index], RAMP[index + 1u], part - f32(index));
    // Change of the logarithm from pixel to pixel.
    let right = luminance(id, barycentrics(id, pixel + vec2(1.0, 0.0)));
    let below = luminance(id, barycentrics(id, pixel + vec2(0.0, 1.0)));
    let change = length(log(vec2(right, below) / here));
    let lux = LUX * here;
    let digits = lux / pow(10.0, floor(log(lux) / log(10.0)));
    let away = abs(log(vec4(digits) / vec4(1.0, 2.0, 5.0, 10.0)));
    let pixels = min(min(away.x, away.y), min(away.z, away.w)) / max(change, 1e-6);
    // Where lines would be denser than pixels there are none.
    let coverage = clamp(1.1 - pixels, 0.0, 1.0) * clamp(2.0 - change / 0.35, 0.0, 1.0);
    return mix(colour, vec3(select(0.0, 1.0, place < 0.4)), 0.7 * coverage);
}

// Luminance of a white surface, W / (sr m^2), above the darkest that has a logarithm.
fn luminance(id: u32, st: vec2<f32>) -> f32 {
    return max(dot(light(id, st), vec3(0.2126, 0.7152, 0.0722)), 1e-30);
}

// Lux by the luminance of a white surface: pi times the luminous efficacy, `scene::LUMINOUS_EFFICACY`.
const LUX = 3.14159265 * 179.0;

// The colour map "inferno" of matplotlib at ten places, display-linear.
const RAMP = array(
    vec3(0.0000, 0.0000, 0.0012), vec3(0.0110, 0.0037, 0.0545), vec3(0.0704, 0.0037, 0.1470), vec3(0.1878, 0.0116, 0.1529),
    vec3(0.3763, 0.0252, 0.1170), vec3(0.6240, 0.0578, 0.0612), vec3(0.8469, 0.1413, 0.0185), vec3(0.9647, 0.3231, 0.0018),
    vec3(0.9301, 0.6308, 0.0452), vec3(0.9734, 1.0000, 0.3712));

// Draws the edges of the pixel's triangle over a colour, anti-aliased.
fn overlay(colour: vec3<f32>, id: u32, pixel: vec2<f32>) -> vec3<f32> {
    let distances = edge_distances(id, pixel);
    let codes = word(id, EDGES);
    var drawn = colour;
    for (var edge = 0u; edge < 3u; edge += 1u) {
        let line = line_style((codes >> (10u * edge)) & 0x3ffu);
        let coverage = clamp(line.half_width + 0.5 - distances[edge], 0.0, 1.0);
        drawn = mix(drawn, line.colour, coverage * line.opacity);
    }
    return drawn;
}

struct Line {
    colour: vec3<f32>,
    opacity: f32,
    // Pixels, on one side of the edge; the triangle on the other side draws the other half.
    half_width: f32,
}

fn line_style(code: u32) -> Line {
    // The classes of `records.rs`.
    let kind = code & 7u;
    if MODE == MESH {
        // Every edge; those inside a leaf thinner, so that the quadtree stands out.
        return Line(vec3(0.0), select(0.9, 0.6, kind == 0u), select(0.7, 0.3, kind == 0u));
    }
    if MODE == ELEMENTS {
        return Line(vec3(0.0), select(0.0, 0.7, kind == 1u || kind == 2u), 0.5);
    }
    let strength = 0.3 + 0.7 * f32(code >> 3u) / 127.0;
    switch kind {
        case 1u: { return Line(vec3(0.5), 0.35, 0.3); }
        case 2u: { return Line(vec3(1.0), 0.9, 0.6); }
        case 3u: { return Line(vec3(1.0, 0.7, 0.05), strength, 0.9); }
        case 4u: { return Line(vec3(1.0, 0.1, 0.6), strength, 0.9); }
        case 5u: { return Line(vec3(0.05, 0.8, 1.0), strength, 0.9); }
        default: { return Line(vec3(0.0), 0.0, 0.0); }
    }
}

// Distances of a pixel from the lines that the triangle's edges 0-1, 1-2 and 2-0 make in the picture, in pixels.
// The plane through the eye and an edge meets the picture plane in that line; no corner is divided by its depth, so
// corners behind the eye do no harm.
fn edge_distances(id: u32, pixel: vec2<f32>) -> vec3<f32> {
    let place = vec3(pixel.x - 0.5 * frame.size.x, 0.5 * frame.size.y - pixel.y, frame.focal);
    let c = array(seen_corner(3u * id), seen_corner(3u * id + 1u), seen_corner(3u * id + 2u));
    return vec3(line_distance(c[0], c[1], place), line_distance(c[1], c[2], place), line_distance(c[2], c[0], place));
}

fn line_distance(from_corner: vec3<f32>, to_corner: vec3<f32>, place: vec3<f32>) -> f32 {
    let normal = cross(from_corner, to_corner);
    return abs(dot(normal, place)) / max(length(normal.xy), 1e-30);
}

// A corner of a triangle in the camera's axes, metres.
fn seen_corner(index: u32) -> vec3<f32> {
    let p = position(index) - frame.eye;
    return vec3(dot(p, frame.right), dot(p, frame.up), dot(p, frame.forward));
}
