// What is seen at a place of the picture: a ray against every triangle, which a processor does between two frames.

import { add, axes, cross, dot, minus, scale } from "./camera.js";

/**
 * The nearest point of a bake along a ray (Moeller and Trumbore 1997), from either side of its triangles.
 *
 * @param {Float32Array} corners three corners of three numbers a triangle, metres
 * @returns {number} how many times `direction` it is away; infinitely many where nothing is met
 */
export function distance(corners, origin, direction) {
  const corner = (i) => [corners[i], corners[i + 1], corners[i + 2]];
  let nearest = Infinity;
  for (let i = 0; i < corners.length; i += 9) {
    const a = corner(i);
    const [ab, ac] = [minus(corner(i + 3), a), minus(corner(i + 6), a)];
    const across = cross(direction, ac);
    const det = dot(ab, across);
    const from = minus(origin, a);
    const s = dot(from, across) / det;
    if (!(s >= 0 && s <= 1)) continue;
    const along = cross(from, ab);
    const t = dot(direction, along) / det;
    const away = dot(ac, along) / det;
    if (t >= 0 && s + t <= 1 && away > 0 && away < nearest) nearest = away;
  }
  return nearest;
}

/**
 * The point that a camera sees at a place, in parts of the picture from its upper left corner; `otherwise` metres
 * ahead for none.
 */
export function pointAt(corners, camera, [x, y], aspect, otherwise) {
  const [right, up, forward] = axes(camera);
  const half = Math.tan((camera.fov * Math.PI) / 360);
  const direction = add(forward, add(scale(right, (2 * x - 1) * half * aspect), scale(up, (1 - 2 * y) * half)));
  const away = distance(corners, camera.eye, direction);
  return add(camera.eye, scale(direction, Number.isFinite(away) ? away : otherwise));
}
