//! A walk that is recorded: where its camera was, and the few cameras that a path needs to go the same way.

use scene::{Camera, CameraKey, CameraPath};

/// Seconds in which a path goes where the walk leapt, to a stored camera: long enough to be followed by an eye.
const LEAP: f64 = 1.0;

/// Seconds within which two cameras are one: below a frame of any display.
const SHORTEST: f64 = 1e-3;

/// Metres within which a camera is where it was: what arithmetic makes of one that nobody moves.
const SAME: f64 = 1e-9;

/// How far a path may be off the walk: the eye, as a part of the scene's size, and the view, radians. A pixel or so in
/// a picture of a thousand.
const EYE_OFF: f64 = 5e-4;
const VIEW_OFF: f64 = 1e-3;

/// A walk while it is recorded. Where the walk rests, no time goes by.
pub(crate) struct Recording {
    /// Every camera, at its time from the start.
    keys: Vec<CameraKey>,
}

impl Recording {
    /// Begins at a camera, which is valid.
    pub fn begin(camera: Camera) -> Self {
        Self { keys: vec![CameraKey { time: 0.0, camera }] }
    }

    /// Seconds that are recorded.
    pub fn seconds(&self) -> f64 {
        self.keys[self.keys.len() - 1].time
    }

    /// Notes where the camera is so many seconds later. What took no time was a leap.
    pub fn note(&mut self, camera: Camera, seconds: f64) {
        let last = self.keys.len() - 1;
        let before = self.keys[last].camera;
        if camera.eye.distance(before.eye).max(camera.target.distance(before.target)) < SAME {
            return;
        }
        let time = self.keys[last].time + if seconds > 0.0 { seconds } else { LEAP };
        if last > 0 && self.keys[last].time - self.keys[last - 1].time < SHORTEST {
            self.keys.pop();
        }
        self.keys.push(CameraKey { time, camera });
    }

    /// The path, through no more cameras than it takes to keep to the walk in a scene of a size in metres; none where
    /// nothing moved.
    ///
    /// Beginning with both ends, the camera that the path misses most between two of its own is added to it, until it
    /// misses none.
    pub fn path(&self, scene_size: f64) -> Option<CameraPath> {
        let mut chosen = vec![0, self.keys.len() - 1];
        if chosen[1] == 0 {
            return None;
        }
        loop {
            let path = CameraPath::new(chosen.iter().map(|&i| self.keys[i]).collect()).ok()?;
            let off = |i: usize| miss(&path.at(self.keys[i].time), &self.keys[i].camera, scene_size);
            let worst = |ends: &[usize]| {
                // The last camera alone may be nearer to the one before.
                let between =
                    (ends[0] + 1..ends[1]).filter(|&i| self.keys[ends[1]].time - self.keys[i].time >= SHORTEST);
                let (i, off) = between.map(|i| (i, off(i))).max_by(|a, b| a.1.total_cmp(&b.1))?;
                (off > 1.0).then_some(i)
            };
            let missed: Vec<usize> = chosen.windows(2).filter_map(worst).collect();
            if missed.is_empty() {
                return Some(path);
            }
            chosen.extend(missed);
            chosen.sort_unstable();
        }
    }
}

/// How far a camera is off another one, 1 where it is as far as may be.
fn miss(a: &Camera, b: &Camera, scene_size: f64) -> f64 {
    let eye = a.eye.distance(b.eye) / (EYE_OFF * scene_size.max(f64::MIN_POSITIVE));
    let view = (a.target - a.eye).angle_between(b.target - b.eye) / VIEW_OFF;
    eye.max(view)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use glam::{DVec2, DVec3};

    use super::*;
    use crate::{
        controls::{Flight, Steering},
        test_room::camera,
    };

    const SIZE: f64 = 6.0;

    #[test]
    fn a_walk_that_rests_is_no_path_and_takes_no_time() {
        let mut recording = Recording::begin(camera());
        assert_eq!(recording.path(SIZE), None);
        for _ in 0..100 {
            recording.note(camera(), 0.1);
        }
        assert_eq!((recording.path(SIZE), recording.seconds()), (None, 0.0));
    }

    #[test]
    fn a_leap_is_a_way_of_its_own() {
        let there = Camera { eye: camera().eye + DVec3::X, ..camera() };
        let mut recording = Recording::begin(camera());
        recording.note(there, 0.0);
        assert_eq!(recording.seconds(), LEAP);
        assert_eq!(recording.path(SIZE).unwrap().at(LEAP), there);
    }

    #[test]
    fn frames_faster_than_any_display_are_one() {
        let mut recording = Recording::begin(camera());
        for i in 1..=1000 {
            recording.note(Camera { eye: camera().eye + DVec3::X * f64::from(i), ..camera() }, 1e-5);
        }
        assert!((recording.seconds() - 0.01).abs() < 1e-9);
        assert!(recording.keys.len() < 15, "{}", recording.keys.len());
        assert!(recording.path(SIZE).is_some());
    }

    /// Half a minute of keys and mouse, at sixty frames a second.
    #[test]
    fn the_path_keeps_to_the_walk_with_few_cameras() {
        let mut flight = Flight::new(camera(), SIZE);
        let mut recording = Recording::begin(flight.camera);
        for frame in 0..1800 {
            let phase = frame / 90 % 4;
            let motion = [DVec3::Z, DVec3::X, DVec3::ZERO, DVec3::new(0.0, 1.0, -1.0)][phase];
            let look = if phase == 1 { DVec2::new(4.0, 1.0) } else { DVec2::ZERO };
            flight = flight.step(&Steering { motion, look, ..Steering::default() }, 1.0 / 60.0);
            recording.note(flight.camera, 1.0 / 60.0);
        }
        let path = recording.path(SIZE).unwrap();
        assert!(recording.keys.iter().all(|key| miss(&path.at(key.time), &key.camera, SIZE) <= 1.0));
        assert!(path.keys().len() * 6 < recording.keys.len(), "{} cameras", path.keys().len());
        assert_eq!(path.times(), (0.0, recording.seconds()));
    }
}
