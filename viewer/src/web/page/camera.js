// Cameras: as vectors, as the numbers that the shaders read, and as a part of the page's address.
//
// A camera is {eye, target, up, fov}: metres, and the full vertical opening angle in degrees.

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const minus = (a, b) => a.map((x, i) => x - b[i]);
export const scale = (a, factor) => a.map((x) => x * factor);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(...a);
export const unit = (a) => scale(a, 1 / (length(a) || 1));

/** Unit vectors to the right, up and forward. */
export function axes(camera) {
  const forward = unit(minus(camera.target, camera.eye));
  const right = unit(cross(forward, camera.up));
  return [right, cross(right, forward), forward];
}

/** Whether the numbers are numbers, and the view has a direction that `up` is not parallel to. */
export function isValid({ eye, target, up, fov }) {
  const numbers = [eye, target, up].every((v) => v?.length === 3 && v.every(Number.isFinite));
  return numbers && fov > 0 && fov < 180 && length(cross(unit(minus(target, eye)), unit(up))) > 1e-6;
}

/**
 * What the shaders know of a frame: the uniform of `frame.wgsl`.
 *
 * @param {object} frame camera, width and height in pixels, ev, curve (its number), and whether the tone map exposes it
 *   (light)
 * @param {{sky: number, triangles: number}} head of the bake: where its environment lies, and how many triangles it has
 * @param {{near: number, reversed: boolean}} depth distance of the near plane, metres; whether depth is 1 there and 0
 *   far away, or goes from -1 to 1
 * @returns {ArrayBuffer}
 */
export function uniform({ camera, width, height, ev, curve, light }, { sky, triangles }, { near, reversed }) {
  const [right, up, forward] = axes(camera);
  const half = Math.tan((camera.fov * Math.PI) / 360);
  const depths = reversed ? [0, 0, 0, near] : [...forward, -2 * near];
  const rows = [[...scale(right, height / (half * width)), 0], [...scale(up, 1 / half), 0], depths, [...forward, 0]];
  const buffer = new ArrayBuffer(144);
  const [numbers, words] = [new Float32Array(buffer), new Uint32Array(buffer)];
  for (let column = 0; column < 4; column++) numbers.set(rows.map((row) => row[column]), 4 * column);
  numbers.set([...camera.eye, height / (2 * half)], 16);
  numbers.set([...right, 2 ** ev], 20);
  numbers.set(up, 24);
  words[27] = light ? 1 : 0;
  numbers.set(forward, 28);
  words[31] = curve;
  numbers.set([width, height], 32);
  words.set([sky, triangles], 34);
  return buffer;
}

/**
 * What an address says of a view: {camera, ev, mode, curve}, each undefined where it says nothing, or nothing valid.
 */
export function fromAddress(hash) {
  const said = new URLSearchParams(hash.replace(/^#/, ""));
  const vector = (name) => said.get(name)?.split(",").map(Number);
  const number = (name) => (said.get(name) ? Number(said.get(name)) : undefined);
  const camera = {
    eye: vector("eye"),
    target: vector("target"),
    up: vector("up") ?? [0, 0, 1],
    fov: number("fov") ?? 60,
  };
  const ev = number("ev");
  return {
    camera: isValid(camera) ? camera : undefined,
    ev: Number.isFinite(ev) ? ev : undefined,
    mode: said.get("mode") ?? undefined,
    curve: said.get("curve") ?? undefined,
  };
}

/** A view as the end of an address. Tenths of a millimetre: below a pixel. */
export function toAddress({ camera, ev, mode, curve }) {
  const short = (x) => String(Number(x.toFixed(4)));
  const vector = (v) => v.map(short).join(",");
  const vectors = ["eye", "target", "up"].map((name) => `${name}=${vector(camera[name])}`).join("&");
  return `#${vectors}&fov=${short(camera.fov)}&ev=${short(ev)}&mode=${mode}&curve=${curve}`;
}
