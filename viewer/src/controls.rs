//! The camera in the hand: a pure function of where it is, what the hands do and how long, to where it is then.
//!
//! Speed follows the keys, and the view the mouse, with a lag that falls off exponentially. Both are solved in closed form, so
//! that a second is a second in however many frames.

use std::f64::consts::PI;

use glam::{DMat3, DVec2, DVec3};
use scene::{Baked, Bvh, Camera, Ray};

/// Radians that the view turns per pixel of mouse motion: half a turn across a screen of a thousand pixels.
const TURN_PER_PIXEL: f64 = PI / 1000.0;

/// The steepest view up or down, radians: short of the vertical, where the picture would spin.
const STEEPEST: f64 = 0.49 * PI;

/// What Shift multiplies and Ctrl divides the speed by.
const HASTE: f64 = 4.0;

/// What one notch of the wheel multiplies the speed by; around a point it divides the distance.
const SPEED_PER_NOTCH: f64 = 1.25;

/// Seconds in which a scene is crossed, along its diagonal, at the speed that a flight starts with.
const CROSSING: f64 = 8.0;

/// Seconds in which the speed comes nearer to the one that keys ask for by a factor e. Shorter jerks, longer slides.
const SPEED_LAG: f64 = 0.08;

/// The same of the view after the mouse: shorter shows every step of the mouse, longer swims.
const LOOK_LAG: f64 = 0.025;

/// Speed, as a part of the flight's own, and angle, radians, below which nobody sees a motion.
const STILL: f64 = 1e-3;
const TURNED: f64 = 1e-5;

/// How far beyond a back side an eye is put, as a part of the scene's size; and how many it passes at most.
const BEYOND: f64 = 0.01;
const WALLS: u32 = 8;

/// Where a walk begins that nobody has given a camera, before [`overview`] brings the scene into its picture: it looks down askew.
pub const ASKEW: Camera =
    Camera { eye: DVec3::ZERO, target: DVec3::new(-1.0, 2.0, -0.5), up: DVec3::Z, vertical_fov: 1.0 };

/// A camera in flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Where it is.
    pub camera: Camera,
    /// How fast keys move it, metres a second.
    pub speed: f64,
    /// Its velocity, metres a second.
    velocity: DVec3,
    /// What the mouse has turned that the view has not followed yet, radians to the right and down.
    turning: DVec2,
    /// The part of `turning` that goes around a point, and the point.
    around: Option<DVec3>,
}

/// What the hands did since the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steering {
    /// Keys held, each -1, 0 or 1: to the right, along the scene's up, forward.
    pub motion: DVec3,
    /// Motion of the mouse while it turns the view, pixels to the right and down.
    pub look: DVec2,
    /// The point that the camera goes around with the mouse, metres; none turns it where it is.
    pub around: Option<DVec3>,
    /// Notches of the wheel, away from the hand.
    pub wheel: f64,
    /// Whether Shift is held.
    pub fast: bool,
    /// Whether Ctrl is held.
    pub slow: bool,
}

impl Steering {
    /// Whether the hands do nothing.
    pub fn is_idle(&self) -> bool {
        self.motion == DVec3::ZERO && self.look == DVec2::ZERO && self.wheel == 0.0
    }
}

impl Flight {
    /// A camera at rest in a scene of a size in metres; it must be valid.
    pub fn new(camera: Camera, scene_size: f64) -> Self {
        let size = if scene_size > 0.0 { scene_size } else { 1.0 };
        Self { camera, speed: size / CROSSING, velocity: DVec3::ZERO, turning: DVec2::ZERO, around: None }
    }

    /// The same flight, at rest at another camera.
    pub fn at(&self, camera: Camera) -> Self {
        Self { camera, velocity: DVec3::ZERO, turning: DVec2::ZERO, ..*self }
    }

    /// Whether nothing moves, unless hands do.
    pub fn is_still(&self) -> bool {
        self.velocity == DVec3::ZERO && self.turning == DVec2::ZERO
    }

    /// Where the flight is `seconds` later.
    pub fn step(&self, steering: &Steering, seconds: f64) -> Self {
        let mut flight = *self;
        match steering.around {
            Some(point) => flight.approach(point, steering.wheel),
            None => flight.speed *= SPEED_PER_NOTCH.powf(steering.wheel),
        }
        flight.turn(steering, seconds);
        flight.glide(steering, seconds);
        flight
    }

    /// Brings the eye nearer to a point by notches of the wheel.
    fn approach(&mut self, point: DVec3, notches: f64) {
        let nearer = (point - self.camera.eye) * (1.0 - SPEED_PER_NOTCH.powf(-notches));
        self.camera = Camera { eye: self.camera.eye + nearer, target: self.camera.target + nearer, ..self.camera };
    }

    /// Follows the mouse, in place or around a point.
    fn turn(&mut self, steering: &Steering, seconds: f64) {
        self.turning += steering.look * TURN_PER_PIXEL;
        if steering.look != DVec2::ZERO {
            self.around = steering.around;
        }
        let lag = (-seconds / LOOK_LAG).exp();
        let left = if self.turning.length() * lag < TURNED { DVec2::ZERO } else { self.turning * lag };
        let now = self.turning - left;
        self.turning = left;
        if now == DVec2::ZERO {
            return;
        }
        let Camera { eye, target, up, .. } = self.camera;
        let forward = turned(target - eye, up, now);
        let turned = Camera { target: eye + forward, ..self.camera };
        self.camera = match self.around {
            None => turned,
            Some(point) => {
                let axes = |camera: &Camera| {
                    let (right, up, forward) = camera.basis();
                    DMat3::from_cols(right, up, forward)
                };
                let eye = point + axes(&turned) * (axes(&self.camera).transpose() * (eye - point));
                Camera { eye, target: eye + forward, ..self.camera }
            }
        };
    }

    /// Moves at a velocity that v' = (wanted - v) / lag brings to the one that keys ask for.
    fn glide(&mut self, steering: &Steering, seconds: f64) {
        let haste = match (steering.fast, steering.slow) {
            (true, false) => HASTE,
            (false, true) => 1.0 / HASTE,
            _ => 1.0,
        };
        let Camera { eye, target, up, .. } = self.camera;
        let forward = target - eye;
        let right = forward.cross(up).normalize();
        let [x, y, z] = steering.motion.to_array();
        let direction = (right * x + up.normalize() * y + forward.normalize() * z).normalize_or_zero();
        let wanted = direction * (self.speed * haste);
        let lag = (-seconds / SPEED_LAG).exp();
        let rest = self.velocity - wanted;
        let eye = eye + wanted * seconds + rest * (SPEED_LAG * (1.0 - lag));
        self.velocity = wanted + rest * lag;
        if wanted == DVec3::ZERO && self.velocity.length() < STILL * self.speed {
            self.velocity = DVec3::ZERO;
        }
        self.camera = Camera { eye, target: eye + forward, ..self.camera };
    }
}

/// A view direction after turning to the right about `up` and down towards it, radians; its length is kept.
fn turned(forward: DVec3, up: DVec3, angles: DVec2) -> DVec3 {
    let up = up.normalize();
    let elevation = PI / 2.0 - forward.angle_between(up);
    // A camera that was steeper already may stay where it is, but not climb.
    let steepest = STEEPEST.max(elevation.abs());
    let climbed = (elevation - angles.y).clamp(-steepest, steepest);
    let level = (forward - up * forward.dot(up)).normalize();
    let heading = level * angles.x.cos() + level.cross(up) * angles.x.sin();
    (heading * climbed.cos() + up * climbed.sin()) * forward.length()
}

/// A camera that looks the way of `camera`, which is valid, and has a ball around a point in its picture, as large as fits in
/// height and width.
pub fn framing(camera: &Camera, middle: DVec3, radius: f64, aspect: f64) -> Camera {
    let half_height = (camera.vertical_fov / 2.0).tan();
    let half_angle = half_height.min(half_height * aspect.max(f64::MIN_POSITIVE)).atan();
    let (.., forward) = camera.basis();
    let distance = radius.max(f64::MIN_POSITIVE) / half_angle.sin();
    Camera { eye: middle - forward * distance, target: middle, ..*camera }
}

/// A camera that sees all of a scene: from outside, or where back sides would hide it, as those of a room do, from behind them.
pub fn overview(baked: &Baked, bvh: &Bvh, camera: &Camera, aspect: f64) -> Camera {
    let (low, high) = baked.scene.bounds();
    // Of nothing any distance is a good one.
    let (middle, size) = ((low + high) / 2.0, Some(baked.scene.size()).filter(|&size| size > 0.0).unwrap_or(1.0));
    let framed = framing(camera, middle, size / 2.0, aspect);
    let (.., forward) = framed.basis();
    let mut eye = framed.eye;
    for _ in 0..WALLS {
        let ray = Ray { origin: eye, direction: forward };
        let back = bvh.closest_hit(&ray, 0.0).filter(|hit| hit.normal.dot(forward) > 0.0);
        let Some(hit) = back.filter(|hit| hit.distance < middle.distance(eye)) else { break };
        eye += forward * (hit.distance + BEYOND * size);
    }
    Camera { eye, target: eye + forward, ..framed }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_room::room;

    fn flight() -> Flight {
        let camera = Camera {
            eye: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(1.0, 4.0, 3.0),
            up: DVec3::Z * 2.0,
            vertical_fov: 1.0,
        };
        Flight { speed: 2.0, ..Flight::new(camera, 16.0) }
    }

    /// A flight `seconds` later, in so many steps, of which the first has the mouse's way.
    fn flown(flight: Flight, steering: Steering, seconds: f64, steps: u32) -> Flight {
        let held = Steering { look: DVec2::ZERO, wheel: 0.0, ..steering };
        let step = |flight: Flight, i| flight.step(if i == 0 { &steering } else { &held }, seconds / f64::from(steps));
        (0..steps).fold(flight, step)
    }

    #[test]
    fn idle_hands_change_nothing() {
        assert!(Steering::default().is_idle() && flight().is_still());
        assert_eq!(flight().step(&Steering::default(), 10.0), flight());
        assert!(Flight::new(flight().camera, 0.0).speed > 0.0);
    }

    #[test]
    fn motion_does_not_depend_on_the_frame_rate() {
        let steering = Steering { motion: DVec3::new(1.0, 0.0, 1.0), ..Steering::default() };
        let [once, often] = [1, 240].map(|steps| flown(flight(), steering, 0.7, steps));
        assert!((once.camera.eye - often.camera.eye).length() < 1e-9, "{once:?} {often:?}");
        assert!((once.velocity - often.velocity).length() < 1e-9);
        let turning = Steering { look: DVec2::new(120.0, 40.0), ..Steering::default() };
        let [once, often] = [1, 240].map(|steps| flown(flight(), turning, 0.05, steps));
        assert!((once.camera.target - often.camera.target).length() < 1e-3, "{once:?} {often:?}");
    }

    #[test]
    fn keys_ease_into_the_speed_and_out_of_it() {
        let steering = Steering { motion: DVec3::new(0.0, 0.0, 1.0), ..Steering::default() };
        let soon = flown(flight(), steering, 0.02, 1);
        assert!(soon.velocity.length() > 0.0 && soon.velocity.length() < 0.5, "{:?}", soon.velocity);
        let late = flown(soon, steering, 5.0, 1);
        assert!((late.velocity - DVec3::Y * 2.0).length() < 1e-9);
        // The lag costs as much way at the start as it gives at the end: a key held for a second moves by the speed.
        let stopped = flown(flown(flight(), steering, 1.0, 50), Steering::default(), 5.0, 500);
        assert!(stopped.is_still());
        assert!((stopped.camera.eye - flight().camera.eye - DVec3::Y * 2.0).length() < 2e-3, "{stopped:?}");
        let way = |steering| (flown(flight(), steering, 50.0, 1).camera.eye - flight().camera.eye).length() / 50.0;
        assert!((way(Steering { fast: true, ..steering }) - 8.0).abs() < 0.05);
        assert!((way(Steering { slow: true, ..steering }) - 0.5).abs() < 0.05);
    }

    #[test]
    fn the_mouse_turns_right_and_down() {
        let look = |x, y| flown(flight(), Steering { look: DVec2::new(x, y), ..Steering::default() }, 1.0, 1);
        let right = look(500.0, 0.0);
        assert!(right.is_still());
        assert!((right.camera.target - right.camera.eye - DVec3::X * 2.0).length() < 1e-12, "{right:?}");
        let down = look(0.0, 250.0).camera;
        assert!((down.target - down.eye - DVec3::new(0.0, 1.0, -1.0) * 2f64.sqrt()).length() < 1e-12, "{down:?}");
    }

    #[test]
    fn the_view_never_tips_over() {
        let mut flight = flight();
        for _ in 0..100 {
            flight = flight.step(&Steering { look: DVec2::new(3.0, -400.0), ..Steering::default() }, 0.01);
            assert!(flight.camera.is_valid());
        }
        let (right, up, _) = flight.camera.basis();
        assert!(right.z.abs() < 1e-9 && up.z > 0.0);
    }

    #[test]
    fn around_a_point_its_distance_and_its_place_in_the_picture_stay() {
        let point = DVec3::new(2.0, 5.0, 2.5);
        let steering = Steering { look: DVec2::new(200.0, 90.0), around: Some(point), ..Steering::default() };
        let (before, after) = (flight().camera, flown(flight(), steering, 1.0, 30).camera);
        assert!((after.eye - before.eye).length() > 1.0);
        assert!((after.eye.distance(point) - before.eye.distance(point)).abs() < 1e-9);
        let place = |camera: &Camera| {
            let (right, up, forward) = camera.basis();
            let way = point - camera.eye;
            DVec2::new(way.dot(right), way.dot(up)) / way.dot(forward)
        };
        assert!((place(&after) - place(&before)).length() < 1e-9);
        let wheel = Steering { wheel: 2.0, around: Some(point), ..Steering::default() };
        let nearer = flight().step(&wheel, 0.0);
        assert!((nearer.camera.eye.distance(point) * 1.5625 - before.eye.distance(point)).abs() < 1e-9);
        assert_eq!(nearer.speed, 2.0);
    }

    #[test]
    fn the_wheel_changes_the_speed_and_back() {
        let wheel = |notches| Steering { wheel: notches, ..Steering::default() };
        let faster = flight().step(&wheel(3.0), 0.0);
        assert!(faster.speed > 3.9);
        assert!((faster.step(&wheel(-3.0), 0.0).speed - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_framed_ball_touches_the_nearer_border() {
        for aspect in [0.5, 1.0, 2.0] {
            let framed = framing(&flight().camera, DVec3::ONE, 0.3, aspect);
            let half = (framed.vertical_fov / 2.0).tan() * aspect.min(1.0);
            // The ball's outline is a cone whose angle has this sine.
            let sine = 0.3 / framed.eye.distance(DVec3::ONE);
            assert!((sine.asin().tan() - half).abs() < 1e-9, "{aspect}");
            assert_eq!(framed.target, DVec3::ONE);
        }
        assert!(framing(&flight().camera, DVec3::ONE, 0.0, 1.0).eye.is_finite());
    }

    #[test]
    fn the_overview_of_a_room_is_from_inside() {
        let room = room();
        let bvh = room.bvh();
        let view = overview(&room, &bvh, &crate::test_room::camera(), 1.5);
        let (.., direction) = view.basis();
        let hit = bvh.closest_hit(&Ray { origin: view.eye, direction }, 0.0).expect("the room is closed");
        assert!(hit.normal.dot(direction) < 0.0, "a back side is seen");
        let empty = Baked::default();
        assert!(overview(&empty, &empty.bvh(), &crate::test_room::camera(), 1.0).eye.is_finite());
    }
}
