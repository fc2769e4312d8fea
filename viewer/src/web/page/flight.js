// The camera in the hand: where it is, what the hands do and how long, to where it is then.
//
// Speed follows the keys, and the view the mouse, with a lag that falls off exponentially. Both are solved in closed
// form, so that a second is a second in however many frames. It is the motion of the program's own window
// (`controls.rs`), number for number.

import { add, axes, cross, dot, length, minus, scale, unit } from "./camera.js";

/** Radians that the view turns per pixel of motion: half a turn across a screen of a thousand pixels. */
const TURN_PER_PIXEL = Math.PI / 1000;

/** The steepest view up or down, radians: short of the vertical, where the picture would spin. */
const STEEPEST = 0.49 * Math.PI;

/** What haste multiplies and tarrying divides the speed by. */
const HASTE = 4;

/** What one notch of the wheel multiplies the speed by; around a point it divides the distance. */
const SPEED_PER_NOTCH = 1.25;

/** Seconds in which a scene is crossed, along its diagonal, at the speed that a flight starts with. */
const CROSSING = 8;

/** Seconds in which the speed, and the view, come nearer to what is asked for by a factor e. */
const SPEED_LAG = 0.08;
const LOOK_LAG = 0.025;

/** Speed, as a part of the flight's own, and angle, radians, below which nobody sees a motion. */
const STILL = 1e-3;
const TURNED = 1e-5;

/** A camera at rest in a scene of a size in metres. */
export function atRest(camera, sceneSize) {
  return { camera, speed: (sceneSize || 1) / CROSSING, velocity: [0, 0, 0], turning: [0, 0], around: null };
}

/** The same flight, at rest at another camera. */
export function at(flight, camera) {
  return { ...flight, camera, velocity: [0, 0, 0], turning: [0, 0] };
}

/** Whether nothing moves, unless hands do. */
export function isStill({ velocity, turning }) {
  return length(velocity) === 0 && length(turning) === 0;
}

/**
 * Where a flight is `seconds` later.
 *
 * @param {object} flight as {@link atRest} makes it
 * @param {object} steering motion to the right, along the scene's up, and forward, each -1 to 1; look, pixels to the
 *   right and down; wheel, notches away from the hand; fast and slow; around, the point that the look goes around, if
 *   it goes around one
 */
export function step(flight, steering, seconds) {
  const quicker = SPEED_PER_NOTCH ** steering.wheel;
  const begun = steering.around
    ? { ...flight, camera: nearer(flight.camera, steering.around, 1 - 1 / quicker) }
    : { ...flight, speed: flight.speed * quicker };
  return glide(turn(begun, steering, seconds), steering, seconds);
}

/** A camera that is nearer to a point by a part of the distance. */
function nearer(camera, point, part) {
  const way = scale(minus(point, camera.eye), part);
  return { ...camera, eye: add(camera.eye, way), target: add(camera.target, way) };
}

/** Follows the mouse, in place or around a point. */
function turn(flight, { look, around: asked }, seconds) {
  const around = length(look) > 0 ? asked : flight.around;
  const wanted = add(flight.turning, scale(look, TURN_PER_PIXEL));
  const lag = Math.exp(-seconds / LOOK_LAG);
  const left = length(wanted) * lag < TURNED ? [0, 0] : scale(wanted, lag);
  const now = minus(wanted, left);
  const followed = { ...flight, turning: left, around };
  if (length(now) === 0) return followed;
  const { eye, target, up } = flight.camera;
  const forward = turned(minus(target, eye), unit(up), now);
  const camera = { ...flight.camera, target: add(eye, forward) };
  if (!around) return { ...followed, camera };
  // The point stays where it is in the camera's axes, and so in the picture.
  const place = axes(flight.camera).map((axis) => dot(axis, minus(eye, around)));
  const moved = axes(camera).reduce((point, axis, i) => add(point, scale(axis, place[i])), around);
  return { ...followed, camera: { ...camera, eye: moved, target: add(moved, forward) } };
}

/** A view direction after turning to the right about `up` and down, radians; its length is kept. */
function turned(forward, up, [right, down]) {
  const elevation = Math.asin(Math.max(-1, Math.min(1, dot(unit(forward), up))));
  // A camera that was steeper already may stay where it is, but not climb.
  const steepest = Math.max(STEEPEST, Math.abs(elevation));
  const climbed = Math.max(-steepest, Math.min(steepest, elevation - down));
  const level = unit(minus(forward, scale(up, dot(forward, up))));
  const heading = add(scale(level, Math.cos(right)), scale(cross(level, up), Math.sin(right)));
  return scale(add(scale(heading, Math.cos(climbed)), scale(up, Math.sin(climbed))), length(forward));
}

/** Moves at a velocity that v' = (wanted - v) / lag brings to the one that is asked for. */
function glide(flight, { motion, fast, slow }, seconds) {
  const haste = fast === slow ? 1 : fast ? HASTE : 1 / HASTE;
  const { eye, target, up } = flight.camera;
  const forward = minus(target, eye);
  const right = unit(cross(forward, up));
  const way = add(add(scale(right, motion[0]), scale(unit(up), motion[1])), scale(unit(forward), motion[2]));
  // Two keys are no faster than one; a finger may ask for less.
  const wanted = scale(way, (flight.speed * haste) / Math.max(1, length(way)));
  const lag = Math.exp(-seconds / SPEED_LAG);
  const rest = minus(flight.velocity, wanted);
  const moved = add(eye, add(scale(wanted, seconds), scale(rest, SPEED_LAG * (1 - lag))));
  let velocity = add(wanted, scale(rest, lag));
  if (length(wanted) === 0 && length(velocity) < STILL * flight.speed) velocity = [0, 0, 0];
  return { ...flight, velocity, camera: { ...flight.camera, eye: moved, target: add(moved, forward) } };
}
