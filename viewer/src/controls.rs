//! The fly camera: a pure function of what the hands do and how long, to a camera.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use scene::Camera;

/// Radians that the view turns per pixel of mouse motion: half a turn across a screen of a thousand pixels.
const TURN_PER_PIXEL: f64 = PI / 1000.0;

/// The steepest view up or down, radians: short of the vertical, where the picture would spin.
const STEEPEST: f64 = 0.49 * PI;

/// What Shift multiplies and Ctrl divides the speed by.
const HASTE: f64 = 4.0;

/// What one notch of the wheel multiplies the speed by.
const SPEED_PER_NOTCH: f64 = 1.25;

/// Seconds in which a scene is crossed, along its diagonal, at the speed that a flight starts with.
const CROSSING: f64 = 8.0;

/// A flight through a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Where it is.
    pub camera: Camera,
    /// How fast it moves, metres a second.
    pub speed: f64,
}

/// What the hands did since the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steering {
    /// Keys held, each -1, 0 or 1: to the right, along the scene's up, forward.
    pub motion: DVec3,
    /// Motion of the mouse while it looks around, pixels to the right and down.
    pub look: DVec2,
    /// Notches of the wheel, away from the hand.
    pub wheel: f64,
    /// Whether Shift is held.
    pub fast: bool,
    /// Whether Ctrl is held.
    pub slow: bool,
}

impl Steering {
    /// Whether a step changes anything.
    pub fn is_idle(&self) -> bool {
        self.motion == DVec3::ZERO && self.look == DVec2::ZERO && self.wheel == 0.0
    }
}

impl Flight {
    /// A flight that starts at a valid camera, in a scene of a size in metres.
    pub fn new(camera: Camera, scene_size: f64) -> Self {
        let size = if scene_size > 0.0 { scene_size } else { 1.0 };
        Self { camera, speed: size / CROSSING }
    }

    /// Where the flight is `seconds` later. Motion is proportional to time, turning to the mouse's way alone, so
    /// neither depends on the frame rate.
    pub fn step(&self, steering: &Steering, seconds: f64) -> Self {
        let speed = self.speed * SPEED_PER_NOTCH.powf(steering.wheel);
        let haste = match (steering.fast, steering.slow) {
            (true, false) => HASTE,
            (false, true) => 1.0 / HASTE,
            _ => 1.0,
        };
        let Camera { eye, target, up, .. } = self.camera;
        let forward = turned(target - eye, up, steering.look * TURN_PER_PIXEL);
        let right = forward.cross(up).normalize();
        let [x, y, z] = steering.motion.to_array();
        let direction = (right * x + up.normalize() * y + forward.normalize() * z).normalize_or_zero();
        let eye = eye + direction * (speed * haste * seconds);
        Self { camera: Camera { eye, target: eye + forward, ..self.camera }, speed }
    }
}

/// A view direction after turning to the right about `up` and down towards it, radians; its length is kept.
fn turned(forward: DVec3, up: DVec3, angles: DVec2) -> DVec3 {
    if angles == DVec2::ZERO {
        return forward;
    }
    let up = up.normalize();
    let elevation = PI / 2.0 - forward.angle_between(up);
    // A camera that was steeper already may stay where it is, but not climb.
    let steepest = STEEPEST.max(elevation.abs());
    let climbed = (elevation - angles.y).clamp(-steepest, steepest);
    let level = (forward - up * forward.dot(up)).normalize();
    let heading = level * angles.x.cos() + level.cross(up) * angles.x.sin();
    (heading * climbed.cos() + up * climbed.sin()) * forward.length()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flight() -> Flight {
        let camera = Camera {
            eye: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(1.0, 4.0, 3.0),
            up: DVec3::Z * 2.0,
            vertical_fov: 1.0,
        };
        Flight { camera, speed: 2.0 }
    }

    #[test]
    fn idle_hands_change_nothing() {
        assert!(Steering::default().is_idle());
        assert_eq!(flight().step(&Steering::default(), 10.0), flight());
        assert!(Flight::new(flight().camera, 0.0).speed > 0.0);
    }

    #[test]
    fn a_second_forward_is_the_speed_whatever_the_frames() {
        let steering = Steering { motion: DVec3::new(1.0, 0.0, 1.0), ..Steering::default() };
        let once = flight().step(&steering, 1.0);
        assert!((once.camera.eye - (flight().camera.eye + DVec3::new(1.0, 1.0, 0.0) * 2f64.sqrt())).length() < 1e-12);
        let many = (0..60).fold(flight(), |flight, _| flight.step(&steering, 1.0 / 60.0));
        assert!((many.camera.eye - once.camera.eye).length() < 1e-12);
        let fast = flight().step(&Steering { fast: true, ..steering }, 1.0);
        let slow = flight().step(&Steering { slow: true, ..steering }, 1.0);
        assert!((fast.camera.eye - flight().camera.eye).length() > 7.99);
        assert!((slow.camera.eye - flight().camera.eye).length() < 0.51);
    }

    #[test]
    fn the_mouse_turns_right_and_down() {
        let look = |x, y| flight().step(&Steering { look: DVec2::new(x, y), ..Steering::default() }, 0.0).camera;
        let right = look(500.0, 0.0);
        assert!((right.target - right.eye - DVec3::X * 2.0).length() < 1e-12, "{right:?}");
        let down = look(0.0, 250.0);
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
    fn the_wheel_changes_the_speed_and_back() {
        let wheel = |notches| Steering { wheel: notches, ..Steering::default() };
        let faster = flight().step(&wheel(3.0), 0.0);
        assert!(faster.speed > 3.9);
        assert!((faster.step(&wheel(-3.0), 0.0).speed - 2.0).abs() < 1e-12);
    }
}
