//! A walk: all that a window shows and how, changed by commands and by time. It knows no window.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use scene::{Baked, Camera, CameraPath, Exposure, MIDDLE_GREY, NamedCamera, ToneCurve};

use crate::{
    Frame, LightSource, Mode, PictureKind, Update,
    command::Command,
    controls::{ASKEW, Flight, Steering, framing, overview},
    hands::Drag,
    reading::Reading,
    recording::Recording,
    twin::Twin,
};

/// Seconds in which automatic exposure comes nearer to a new view's by a factor e, as an eye adapts.
const ADAPTATION: f64 = 0.25;

/// Exposure values below which nobody sees that the exposure still moves.
const ADAPTED: f32 = 0.01;

/// Radius of what is framed around a point, as a part of the scene's size.
const NEIGHBOURHOOD: f64 = 0.06;

/// Cameras that can be stored and visited by a key.
const CAMERAS: usize = 9;

/// A bake that is shown.
pub(crate) struct Shown {
    pub baked: Arc<Baked>,
    pub twin: Twin,
}

/// How bright the picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ExposureRule {
    /// Whether the view is metered.
    pub metered: bool,
    /// The grey that the metered view is brought to, display-linear.
    pub key: f64,
    /// The exposure value, fixed or as metering has come to.
    pub ev: f32,
}

/// A point that was clicked.
pub(crate) struct Clicked {
    pub reading: Reading,
    /// The sources of its light, the strongest first, once they are known, or why they are not.
    pub sources: Option<Result<Vec<LightSource>, String>>,
}

/// What a command asks of the window.
#[derive(Debug, PartialEq)]
pub(crate) enum Errand {
    /// The camera's flags.
    Copy(String),
    Save(PictureKind),
    /// The path that was recorded.
    SavePath(CameraPath),
    Say(String),
    Close,
}

/// A walk.
pub(crate) struct Walk {
    pub shown: Option<Arc<Shown>>,
    /// None until there is something to look at.
    pub flight: Option<Flight>,
    first: Option<Camera>,
    pub mode: Mode,
    pub exposure: ExposureRule,
    /// Whether metering has been anywhere yet, from where it moves on.
    adapted: bool,
    pub curve: ToneCurve,
    /// Whether the left button goes around a point, and not the right one.
    pub orbits: bool,
    /// The point that is gone around while a button is held.
    pivot: Option<DVec3>,
    pub cameras: [Option<NamedCamera>; CAMERAS],
    /// What is being recorded.
    pub recording: Option<Recording>,
    pub clicked: Option<Clicked>,
    pub lines: bool,
    pub blockers: bool,
    /// Whether the picture is refined while the view rests.
    pub refines: bool,
    pub panels: bool,
    pub help: bool,
    /// What is being done outside: its name, and the part that is done.
    pub work: Option<(&'static str, f64)>,
    pub notice: Option<String>,
}

impl Default for Walk {
    fn default() -> Self {
        Self {
            shown: None,
            flight: None,
            first: None,
            mode: Mode::default(),
            exposure: ExposureRule { metered: true, key: MIDDLE_GREY, ev: 0.0 },
            adapted: false,
            curve: ToneCurve::default(),
            orbits: false,
            pivot: None,
            cameras: [const { None }; CAMERAS],
            recording: None,
            clicked: None,
            lines: true,
            blockers: false,
            refines: false,
            panels: true,
            help: false,
            work: None,
            notice: None,
        }
    }
}

impl Walk {
    /// Takes note of an update that changes neither the bake nor the window.
    pub fn note(&mut self, update: Update) {
        match update {
            Update::Camera(camera) => self.first = Some(camera),
            Update::Work(stage, part) => self.work = Some((stage, part)),
            Update::Rest => self.work = None,
            Update::Notice(said) => self.notice = Some(said),
            Update::Bake(_) | Update::Close => {}
        }
    }

    /// Shows a bake, in a picture of a size in pixels.
    pub fn show(&mut self, shown: Arc<Shown>, (width, height): (u32, u32)) {
        let scene = &shown.baked.scene;
        let is_another = self.shown.as_ref().is_none_or(|before| before.baked.scene.cameras != scene.cameras);
        if is_another {
            self.cameras = std::array::from_fn(|number| scene.cameras.get(number).cloned());
        }
        if self.flight.is_none() {
            let aspect = f64::from(width.max(1)) / f64::from(height.max(1));
            let camera = self.first.or(scene.cameras.first().map(|named| named.camera));
            let camera = camera
                .filter(Camera::is_valid)
                .unwrap_or_else(|| overview(&shown.baked, &shown.twin.bvh, &ASKEW, aspect));
            self.flight = Some(Flight::new(camera, scene.size()));
        }
        // Its triangle may be gone, but its place is not.
        self.clicked = self.clicked.take().and_then(|Clicked { reading, sources }| {
            Some(Clicked { reading: reading.again(&shown.baked, &shown.twin)?, sources })
        });
        self.shown = Some(shown);
    }

    /// Reads the point at a place of the picture; what is no surface's front forgets the last point.
    pub fn click(&mut self, place: DVec2, size: (u32, u32)) {
        let (Some(shown), Some(flight)) = (&self.shown, &self.flight) else { return };
        let reading = Reading::at(&shown.baked, &shown.twin, &flight.camera, place, size);
        self.clicked = reading.map(|reading| Clicked { reading, sources: None });
    }

    /// What the hands steer, with the point that is gone around.
    pub fn steered(&mut self, steering: Steering, drag: Drag) -> Steering {
        let goes_around = match drag {
            Drag::None | Drag::Left => self.orbits,
            Drag::Right => !self.orbits,
        };
        if drag == Drag::None || !goes_around {
            self.pivot = None;
        }
        if goes_around && self.pivot.is_none() && !steering.is_idle() {
            self.pivot = Some(self.middle());
        }
        Steering { around: self.pivot, ..steering }
    }

    /// The clicked point; else what is in the middle of the picture, or ahead.
    fn middle(&self) -> DVec3 {
        if let Some(clicked) = &self.clicked {
            return clicked.reading.position;
        }
        let (Some(shown), Some(flight)) = (&self.shown, &self.flight) else { return DVec3::ZERO };
        let ray = flight.camera.ray(DVec2::splat(0.5), 1, 1);
        let ahead = shown.twin.bvh.closest_hit(&ray, 0.0).map_or(shown.baked.scene.size() / 2.0, |hit| hit.distance);
        ray.at(ahead)
    }

    /// Moves, and meters for a picture of a size in pixels, `seconds` later; true while there is more to come by itself.
    pub fn step(&mut self, steering: &Steering, seconds: f64, size: (u32, u32)) -> bool {
        let (Some(shown), Some(flight)) = (self.shown.clone(), &mut self.flight) else { return false };
        *flight = flight.step(steering, seconds);
        if let Some(recording) = &mut self.recording {
            recording.note(flight.camera, seconds);
        }
        let is_still = flight.is_still();
        let mut adapts = false;
        if let (true, Some(frame)) = (self.exposure.metered, self.frame(size)) {
            let metered = shown.twin.meter(&frame).ev + (self.exposure.key / MIDDLE_GREY).log2() as f32;
            let from = if self.adapted { self.exposure.ev } else { metered };
            self.exposure.ev = adapt(from, metered, seconds);
            self.adapted = true;
            adapts = self.exposure.ev != metered;
        }
        !steering.is_idle() || !is_still || adapts
    }

    /// The picture that is seen, of a size in pixels.
    pub fn frame(&self, (width, height): (u32, u32)) -> Option<Frame> {
        self.flight.map(|flight| Frame {
            camera: flight.camera,
            width,
            height,
            mode: self.mode,
            exposure: Some(Exposure { ev: self.exposure.ev }),
            curve: self.curve,
        })
    }

    /// Does what is asked for, in a picture whose width is `aspect` times its height.
    pub fn obey(&mut self, command: Command, aspect: f64) -> Option<Errand> {
        match command {
            Command::Show(mode) => self.mode = mode,
            Command::NextMode => self.mode = self.mode.next(),
            Command::Visit(number) => {
                if let (Some(Some(stored)), Some(flight)) = (self.cameras.get(number), &mut self.flight) {
                    *flight = flight.at(stored.camera);
                    self.adapted = false;
                    self.leap();
                }
            }
            Command::Store(number) => {
                if let (Some(stored), Some(flight)) = (self.cameras.get_mut(number), &self.flight) {
                    *stored = Some(NamedCamera { name: "stored".into(), camera: flight.camera });
                    return Some(Errand::Say(format!("camera {} is stored", number + 1)));
                }
            }
            Command::Frame => self.bring_into_picture(aspect),
            Command::ToggleOrbit => self.orbits = !self.orbits,
            Command::CopyCamera => {
                return Some(Errand::Copy(camera_flags(&self.flight?.camera)));
            }
            Command::Record => return self.record(),
            Command::Save(kind) => return Some(Errand::Save(kind)),
            Command::Brighten(stops) => {
                self.exposure.metered = false;
                self.exposure.ev += stops;
            }
            Command::ToggleMetering => self.exposure.metered = !self.exposure.metered,
            Command::NextCurve => self.curve = ToneCurve::ALL[(self.curve as usize + 1) % ToneCurve::ALL.len()],
            Command::ToggleRefinement => self.refines = !self.refines,
            Command::ToggleLines => self.lines = !self.lines,
            Command::TogglePanels => self.panels = !self.panels,
            Command::ToggleHelp => {
                self.help = !self.help;
                self.panels |= self.help;
            }
            Command::Close => return Some(Errand::Close),
        }
        None
    }

    fn bring_into_picture(&mut self, aspect: f64) {
        let (Some(shown), Some(flight)) = (&self.shown, &mut self.flight) else { return };
        let camera = match &self.clicked {
            Some(clicked) => {
                let radius = NEIGHBOURHOOD * shown.baked.scene.size();
                framing(&flight.camera, clicked.reading.position, radius, aspect)
            }
            None => overview(&shown.baked, &shown.twin.bvh, &flight.camera, aspect),
        };
        *flight = flight.at(camera);
        self.leap();
    }

    /// Notes, where the walk is recorded, that it is somewhere else at once.
    fn leap(&mut self) {
        if let (Some(recording), Some(flight)) = (&mut self.recording, &self.flight) {
            recording.note(flight.camera, 0.0);
        }
    }

    /// Begins to record, or ends it with a path to be written.
    fn record(&mut self) -> Option<Errand> {
        let (shown, flight) = (self.shown.as_ref()?, self.flight.as_ref()?);
        Some(match self.recording.take() {
            None => {
                self.recording = Some(Recording::begin(flight.camera));
                Errand::Say("the camera's path is recorded; R ends it".into())
            }
            Some(recording) => match recording.path(shown.baked.scene.size()) {
                Some(path) => Errand::SavePath(path),
                None => Errand::Say("the camera did not move: no path is written".into()),
            },
        })
    }
}

/// Automatic exposure `seconds` later on its way from one value to another.
fn adapt(from: f32, to: f32, seconds: f64) -> f32 {
    let rest = (from - to) * (-seconds / ADAPTATION).exp() as f32;
    if rest.abs() < ADAPTED { to } else { to + rest }
}

/// A camera as the flags of `halflight shot`, with all of its digits: with fewer a pixel on an edge may be on its other side.
fn camera_flags(camera: &Camera) -> String {
    // Without the sign of a zero.
    let vector = |v: DVec3| (v + DVec3::ZERO).to_array().map(|value| value.to_string()).join(",");
    format!(
        "--eye {} --target {} --up {} --fov {}",
        vector(camera.eye),
        vector(camera.target),
        vector(camera.up),
        camera.vertical_fov.to_degrees()
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::test_room::{camera, room};

    const SIZE: (u32, u32) = (64, 48);

    fn walk() -> Walk {
        let baked = Arc::new(room());
        let mut walk = Walk::default();
        walk.note(Update::Camera(camera()));
        walk.show(Arc::new(Shown { twin: Twin::new(&baked), baked }), SIZE);
        walk
    }

    #[test]
    fn without_a_bake_everything_is_harmless() {
        let mut walk = Walk::default();
        walk.click(DVec2::ZERO, SIZE);
        for command in [Command::Frame, Command::Visit(0), Command::Store(0), Command::CopyCamera, Command::Visit(99)] {
            assert_eq!(walk.obey(command, 1.0), None);
        }
        assert!(!walk.step(&Steering::default(), 0.1, SIZE) && walk.frame(SIZE).is_none());
        let empty = Arc::new(Baked::default());
        walk.show(Arc::new(Shown { twin: Twin::new(&empty), baked: empty }), (0, 0));
        assert!(walk.flight.unwrap().camera.is_valid());
    }

    #[test]
    fn exposure_adapts_at_any_frame_rate_and_arrives() {
        let once = adapt(4.0, -1.0, 0.2);
        let often = (0..20).fold(4.0, |ev, _| adapt(ev, -1.0, 0.01));
        assert!((once - often).abs() < 1e-4 && once < 4.0);
        assert_eq!(adapt(4.0, -1.0, 10.0), -1.0);
        assert_eq!(adapt(4.0, 4.0, 0.0), 4.0);
    }

    #[test]
    fn the_key_is_the_grey_that_a_metered_view_is_brought_to() {
        let mut walk = walk();
        walk.step(&Steering::default(), 0.0, SIZE);
        let ev = walk.exposure.ev;
        walk.exposure.key = 2.0 * MIDDLE_GREY;
        assert!(walk.step(&Steering::default(), 0.1, SIZE), "it adapts");
        assert!(!walk.step(&Steering::default(), 100.0, SIZE));
        assert!((walk.exposure.ev - ev - 1.0).abs() < 1e-6);
        walk.obey(Command::Brighten(0.5), 1.0);
        assert!(!walk.step(&Steering::default(), 100.0, SIZE));
        assert!((walk.exposure.ev - ev - 1.5).abs() < 1e-6);
    }

    #[test]
    fn cameras_are_stored_and_visited() {
        let mut walk = walk();
        walk.obey(Command::Store(4), 1.0);
        let steering = Steering { motion: DVec3::X, ..Steering::default() };
        walk.step(&steering, 1.0, SIZE);
        assert_ne!(walk.flight.unwrap().camera, camera());
        walk.obey(Command::Visit(8), 1.0);
        assert_ne!(walk.flight.unwrap().camera, camera(), "nothing is stored there");
        walk.obey(Command::Visit(4), 1.0);
        assert_eq!(walk.flight.unwrap().camera, camera());
        assert!(walk.flight.unwrap().is_still());
    }

    #[test]
    fn a_finer_bake_of_the_same_scene_leaves_the_walk_where_it_is() {
        let mut walk = walk();
        walk.step(&Steering { motion: DVec3::X, ..Steering::default() }, 0.3, SIZE);
        walk.click(DVec2::new(32.0, 24.0), SIZE);
        let (flight, position) = (walk.flight, walk.clicked.as_ref().unwrap().reading.position);
        let mut finer = room();
        finer.samples.iter_mut().for_each(|sample| *sample *= 2.0);
        let before = walk.clicked.as_ref().unwrap().reading.irradiance;
        let baked = Arc::new(finer);
        walk.show(Arc::new(Shown { twin: Twin::new(&baked), baked }), SIZE);
        assert_eq!(walk.flight, flight);
        let reading = &walk.clicked.as_ref().unwrap().reading;
        assert!(reading.position.distance(position) < 1e-6, "{} {position}", reading.position);
        assert!((reading.irradiance - before * 2.0).length() < 1e-3 * before.length());
    }

    #[test]
    fn a_click_is_framed_and_gone_around() {
        let mut walk = walk();
        walk.click(DVec2::new(10.0, 40.0), SIZE);
        let position = walk.clicked.as_ref().unwrap().reading.position;
        let looking = Steering { look: DVec2::X, ..Steering::default() };
        assert_eq!(walk.steered(looking, Drag::Left).around, None);
        assert_eq!(walk.steered(looking, Drag::Right).around, Some(position));
        walk.obey(Command::ToggleOrbit, 1.0);
        assert_eq!(walk.steered(looking, Drag::Left).around, Some(position));
        walk.obey(Command::Frame, 4.0 / 3.0);
        assert_eq!(walk.flight.unwrap().camera.target, position);
    }

    #[test]
    fn a_walk_is_recorded_from_key_to_key() {
        let mut walk = walk();
        let says =
            |errand: Option<Errand>, what: &str| matches!(errand, Some(Errand::Say(said)) if said.contains(what));
        assert!(says(walk.obey(Command::Record, 1.0), "is recorded"));
        assert!(says(walk.obey(Command::Record, 1.0), "did not move"));
        walk.obey(Command::Store(4), 1.0);
        walk.obey(Command::Record, 1.0);
        let steering = Steering { motion: DVec3::X, ..Steering::default() };
        // A frame after a rest takes no time, and moves nothing.
        for seconds in [0.0, 0.1, 0.1] {
            walk.step(&steering, seconds, SIZE);
        }
        let there = walk.flight.unwrap().camera;
        walk.obey(Command::Visit(4), 1.0);
        let Some(Errand::SavePath(path)) = walk.obey(Command::Record, 1.0) else { panic!("no path") };
        assert!((path.at(0.0).eye - camera().eye).length() < 1e-9);
        assert!((path.at(0.2).eye - there.eye).length() < 1e-3);
        assert_eq!((path.times().1, path.at(9.0)), (1.2, camera()), "a leap takes a second");
    }

    #[test]
    fn a_camera_is_copied_as_flags() {
        let mut walk = walk();
        let Some(Errand::Copy(flags)) = walk.obey(Command::CopyCamera, 1.0) else { panic!("nothing was copied") };
        assert_eq!(flags, "--eye 0.31,0.47,1.13 --target 2.9,2.4,1.4 --up 0,0,1 --fov 68.75493541569878");
        assert_eq!(walk.obey(Command::Close, 1.0), Some(Errand::Close));
    }
}
