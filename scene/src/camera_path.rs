//! The path of a camera through a scene: a smooth curve through cameras at given times.

use std::ops::Range;

use glam::{DMat3, DQuat, DVec3};

use crate::Camera;

/// The latest time of a path, seconds from 0 either way: thirty years, and still told to a microsecond by f64.
const LATEST: f64 = 1e9;

/// The shortest time between two cameras of a path, seconds: less than a frame of any display, and enough to divide by.
const SHORTEST: f64 = 1e-4;

/// A camera, and when it is reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraKey {
    /// Seconds.
    pub time: f64,
    /// The camera.
    pub camera: Camera,
}

/// A smooth path through cameras.
///
/// Between cameras every quantity is a cubic with the tangents of Catmull and Rom 1974 ("A class of local interpolating
/// splines"), for times that need not be even: at a camera the tangent is that of the parabola through it and its two
/// neighbours, but no more than three times as fast as on its slower side. The direction of view turns as a quaternion does,
/// the shorter way round; what points up in the picture stays what the cameras say, so that between level cameras the picture
/// does not roll.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    keys: Vec<CameraKey>,
    poses: Vec<Pose>,
}

/// Why cameras make no path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraPathError {
    /// There are none.
    Empty,
    /// The one of this number, from 0, is not valid.
    Camera(usize),
    /// The time of this number, from 0, is not finite, beyond thirty years, or not after the one before.
    Time(usize),
}

impl std::fmt::Display for CameraPathError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Empty => write!(f, "a path without cameras leads nowhere"),
            Self::Camera(key) => write!(f, "camera {} of the path sees nothing", key + 1),
            Self::Time(key) => {
                write!(f, "the time of camera {} of the path is no number of seconds after the one before", key + 1)
            }
        }
    }
}

impl std::error::Error for CameraPathError {}

/// What is interpolated of a camera: the eye, a quaternion from camera to world, the up direction, the logarithm of the distance of
/// the target, and the opening angle.
type Pose = [f64; 12];

/// The numbers of a pose that are one thing each.
const THINGS: [Range<usize>; 5] = [0..3, 3..7, 7..10, 10..11, 11..12];

/// How many times as fast as on the slower side a thing may be where the path goes through a camera. From there on a cubic goes
/// far beyond its ends (F. Fritsch and R. Carlson, "Monotone Piecewise Cubic Interpolation", 1980); less makes a path slow at
/// its cameras.
const FASTEST: f64 = 3.0;

impl CameraPath {
    /// The path through cameras in the order of their times.
    ///
    /// # Errors
    /// No cameras, one that is not valid, or times that do not increase.
    pub fn new(keys: Vec<CameraKey>) -> Result<Self, CameraPathError> {
        if keys.is_empty() {
            return Err(CameraPathError::Empty);
        }
        let mut poses: Vec<Pose> = Vec::with_capacity(keys.len());
        let mut earliest = -LATEST;
        for (i, key) in keys.iter().enumerate() {
            if !(earliest..=LATEST).contains(&key.time) {
                return Err(CameraPathError::Time(i));
            }
            if !key.camera.is_valid() {
                return Err(CameraPathError::Camera(i));
            }
            earliest = key.time + SHORTEST;
            poses.push(pose(&key.camera, poses.last()));
        }
        Ok(Self { keys, poses })
    }

    /// The cameras that the path goes through.
    pub fn keys(&self) -> &[CameraKey] {
        &self.keys
    }

    /// The times of the first camera and of the last, seconds.
    pub fn times(&self) -> (f64, f64) {
        (self.keys[0].time, self.keys[self.keys.len() - 1].time)
    }

    /// The camera at a time, seconds: valid, the first one before the path begins, and the last one after it ends.
    pub fn at(&self, time: f64) -> Camera {
        let next = self.keys.partition_point(|key| key.time <= time);
        if next == 0 || next == self.keys.len() {
            return self.keys[next.saturating_sub(1)].camera;
        }
        let (from, to) = (self.keys[next - 1], self.keys[next]);
        let seconds = to.time - from.time;
        let [a, b] = [next - 1, next].map(|key| self.tangent(key));
        let (p, q) = (&self.poses[next - 1], &self.poses[next]);
        let part = (time - from.time) / seconds;
        let pose: Pose = std::array::from_fn(|i| hermite(p[i], q[i], a[i] * seconds, b[i] * seconds, part));
        let angles = [from.camera.vertical_fov, to.camera.vertical_fov];
        camera(&pose, angles)
    }

    /// The derivative of the pose by time at a camera.
    fn tangent(&self, key: usize) -> Pose {
        let slope = |from: usize| -> Pose {
            let seconds = self.keys[from + 1].time - self.keys[from].time;
            std::array::from_fn(|i| (self.poses[from + 1][i] - self.poses[from][i]) / seconds)
        };
        let last = self.keys.len() - 1;
        if key == 0 {
            return slope(0);
        }
        if key == last {
            return slope(last - 1);
        }
        let (before, after) = (slope(key - 1), slope(key));
        let time = |key: usize| self.keys[key].time;
        let part = (time(key) - time(key - 1)) / (time(key + 1) - time(key - 1));
        let mut tangent: Pose = std::array::from_fn(|i| before[i] * (1.0 - part) + after[i] * part);
        for thing in THINGS {
            let speed = |pose: &Pose| pose[thing.clone()].iter().map(|x| x * x).sum::<f64>().sqrt();
            let most = FASTEST * speed(&before).min(speed(&after));
            let slower = most / speed(&tangent).max(most).max(f64::MIN_POSITIVE);
            tangent[thing].iter_mut().for_each(|x| *x *= slower);
        }
        tangent
    }
}

/// The cubic from p to q whose derivatives at the ends are a and b, at 0..=1.
fn hermite(p: f64, q: f64, a: f64, b: f64, x: f64) -> f64 {
    let y = 1.0 - x;
    y * y * ((1.0 + 2.0 * x) * p + x * a) + x * x * ((1.0 + 2.0 * y) * q - y * b)
}

/// The numbers of a camera. A quaternion and its negative are the same turn: the one nearer to that of the camera before.
fn pose(camera: &Camera, before: Option<&Pose>) -> Pose {
    let (right, up, forward) = camera.basis();
    let mut turn = DQuat::from_mat3(&DMat3::from_cols(right, up, -forward));
    if before.is_some_and(|&[_, _, _, x, y, z, w, ..]| turn.dot(DQuat::from_xyzw(x, y, z, w)) < 0.0) {
        turn = -turn;
    }
    let [eye, upward] = [camera.eye, camera.up.normalize()];
    let distance = (camera.target - camera.eye).length().ln();
    [eye.x, eye.y, eye.z, turn.x, turn.y, turn.z, turn.w, upward.x, upward.y, upward.z, distance, camera.vertical_fov]
}

/// The camera between two others of these opening angles; a curve may overshoot them, and the angle must not.
fn camera(&[ex, ey, ez, x, y, z, w, ux, uy, uz, distance, angle]: &Pose, angles: [f64; 2]) -> Camera {
    let eye = DVec3::new(ex, ey, ez);
    let turn = DQuat::from_xyzw(x, y, z, w).normalize();
    let vertical_fov = angle.clamp(angles[0].min(angles[1]), angles[0].max(angles[1]));
    let target = eye - turn * DVec3::Z * distance.exp();
    let camera = Camera { eye, target, up: DVec3::new(ux, uy, uz), vertical_fov };
    // Where the view turns through the zenith, what is up there is what the turn makes of it.
    if camera.is_valid() { camera } else { Camera { up: turn * DVec3::Y, ..camera } }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use proptest::prelude::*;

    use super::*;

    fn looking(eye: [f64; 3], direction: [f64; 3]) -> Camera {
        let eye = DVec3::from(eye);
        Camera { eye, target: eye + DVec3::from(direction), up: DVec3::Z, vertical_fov: 1.0 }
    }

    fn path(cameras: &[(f64, Camera)]) -> CameraPath {
        CameraPath::new(cameras.iter().map(|&(time, camera)| CameraKey { time, camera }).collect()).unwrap()
    }

    fn near(a: Camera, b: Camera) -> bool {
        let apart = (a.eye - b.eye).length() + (a.target - b.target).length() + (a.up - b.up).length();
        apart + (a.vertical_fov - b.vertical_fov).abs() < 1e-9
    }

    #[test]
    fn what_is_no_path_is_refused() {
        let key = |time, camera| CameraKey { time, camera };
        let good = looking([0.0; 3], [1.0, 0.0, 0.0]);
        let blind = Camera { target: good.eye, ..good };
        assert_eq!(CameraPath::new(vec![]), Err(CameraPathError::Empty));
        assert_eq!(CameraPath::new(vec![key(0.0, good), key(1.0, blind)]), Err(CameraPathError::Camera(1)));
        for time in [0.0, -1.0, 1e-9, f64::NAN, f64::INFINITY, 1e300] {
            let keys = vec![key(0.0, good), key(time, good)];
            assert_eq!(CameraPath::new(keys), Err(CameraPathError::Time(1)), "{time}");
        }
    }

    #[test]
    fn one_camera_stays_and_ends_hold() {
        let here = looking([1.0, 2.0, 3.0], [0.0, 2.0, 0.0]);
        let there = looking([2.0, 2.0, 3.0], [0.0, 2.0, 0.0]);
        for time in [-5.0, 0.0, 7.0, f64::NAN] {
            assert_eq!(path(&[(0.0, here)]).at(time), here);
        }
        let path = path(&[(1.0, here), (2.0, there)]);
        assert_eq!((path.at(0.0), path.at(1.0), path.at(2.0), path.at(9.0)), (here, here, there, there));
        assert_eq!(path.times(), (1.0, 2.0));
    }

    #[test]
    fn the_path_goes_through_its_cameras_and_is_straight_where_they_are() {
        let cameras: Vec<(f64, Camera)> = [0.0, 0.5, 2.0, 7.0]
            .map(|time| (time, looking([3.0 * time, 1.0 - time, 0.25 * time], [1.0, 0.5, 0.0])))
            .to_vec();
        let path = path(&cameras);
        for &(time, camera) in &cameras {
            assert!(near(path.at(time), camera), "{time}");
        }
        for time in [0.1, 0.77, 3.0, 6.9] {
            assert!(near(path.at(time), looking([3.0 * time, 1.0 - time, 0.25 * time], [1.0, 0.5, 0.0])), "{time}");
        }
    }

    #[test]
    fn speed_does_not_jump_at_a_camera() {
        let path = path(&[
            (0.0, looking([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])),
            (1.0, looking([1.0, 2.0, 1.0], [0.0, 1.0, 0.2])),
            (4.0, looking([5.0, 1.0, 2.0], [-1.0, 1.0, -0.4])),
            (5.0, looking([5.0, 0.0, 2.0], [-1.0, -1.0, 0.0])),
        ]);
        let step = 1e-6;
        for time in [1.0, 4.0] {
            let [before, at, after] = [-step, 0.0, step].map(|offset| path.at(time + offset));
            let change = |a: Camera, b: Camera| ((b.eye - a.eye) / step, (b.target - a.target) / step);
            let ((eye, target), (eye_after, target_after)) = (change(before, at), change(at, after));
            assert!((eye - eye_after).length() < 1e-4 && (target - target_after).length() < 1e-4, "{time}");
        }
    }

    /// A leap of a thousandth of a second after two seconds at rest, and one into it.
    #[test]
    fn a_leap_does_not_throw_the_camera_about() {
        let (near, far) = (looking([0.0; 3], [0.0, 1.2, 0.0]), looking([0.0; 3], [0.0, 7.0, -5.5]));
        let aside = looking([0.1, 0.0, 0.0], [0.0, 1.5, 0.1]);
        for cameras in [[(0.0, near), (2.2, aside), (2.201, far)], [(0.0, far), (0.001, near), (2.2, aside)]] {
            let path = path(&cameras);
            for i in 0..=2200 {
                let camera = path.at(f64::from(i) / 1000.0);
                assert!(camera.is_valid() && camera.eye.length() < 0.3, "{i}: {camera:?}");
                assert!((0.5..20.0).contains(&camera.target.distance(camera.eye)), "{i}: {camera:?}");
            }
        }
    }

    #[test]
    fn between_level_cameras_the_picture_does_not_roll() {
        let path = path(&[
            (0.0, looking([0.0; 3], [1.0, 0.0, 0.9])),
            (1.0, looking([0.0; 3], [-1.0, 0.1, -0.9])),
            (2.0, looking([0.0; 3], [0.0, -1.0, 0.3])),
        ]);
        for i in 0..=200 {
            let camera = path.at(f64::from(i) / 100.0);
            let (right, up, _) = camera.basis();
            assert!(right.z.abs() < 1e-9 && up.z > 0.0, "{i}");
        }
    }

    proptest! {
        #[test]
        fn every_moment_has_a_valid_camera(
            keys in prop::collection::vec((0.001f64..9.0, prop::array::uniform3(-9.0f64..9.0),
                prop::array::uniform3(-9.0f64..9.0), 0.01f64..3.1), 1..6),
            part in 0.0f64..1.0,
        ) {
            let mut time = 0.0;
            let keys: Vec<CameraKey> = keys.into_iter().map(|(seconds, eye, target, vertical_fov)| {
                time += seconds;
                let camera = Camera { eye: eye.into(), target: target.into(), up: DVec3::Z, vertical_fov };
                CameraKey { time, camera }
            }).collect();
            prop_assume!(keys.iter().all(|key| key.camera.is_valid()));
            let path = CameraPath::new(keys).unwrap();
            let (first, last) = path.times();
            prop_assert!(path.at(first + part * (last - first)).is_valid());
        }
    }
}
