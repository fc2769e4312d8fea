//! The picture that grows while the view rests: asked for where it comes to rest, and given up where it moves on.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use scene::Baked;

use crate::{Frame, Mode, Refine, Refined};

/// Hands a finer picture on, with the number of the refinement that it is of, or why there is none.
pub(crate) type Pass = dyn Fn(u64, Result<Refined, String>) + Send + Sync;

/// Refinements of views, one at a time.
pub(crate) struct Refinements {
    refine: Arc<Refine>,
    pass: Arc<Pass>,
    /// How many there were.
    count: u64,
    present: Option<Refinement>,
}

/// A view that is being refined.
struct Refinement {
    baked: Arc<Baked>,
    frame: Frame,
    is_wanted: Arc<AtomicBool>,
    finest: Option<Arc<Refined>>,
}

impl Refinements {
    /// None so far.
    pub fn new(refine: Arc<Refine>, pass: Arc<Pass>) -> Self {
        Self { refine, pass, count: 0, present: None }
    }

    /// Follows what is seen: a view that rests is refined, on a thread of its own, and none else. Only light is; a diagram is as
    /// fine as it can be.
    pub fn follow(&mut self, resting: Option<(&Arc<Baked>, Frame)>) {
        let resting = resting.filter(|(_, frame)| frame.mode == Mode::Shaded && frame.width > 0 && frame.height > 0);
        if let Some(present) = &self.present {
            let is_same =
                |(baked, frame): &(&Arc<Baked>, Frame)| Arc::ptr_eq(&present.baked, baked) && present.frame == *frame;
            if resting.as_ref().is_some_and(is_same) {
                return;
            }
            present.is_wanted.store(false, Ordering::Relaxed);
            self.present = None;
        }
        let Some((baked, frame)) = resting else { return };
        self.count += 1;
        let is_wanted = Arc::new(AtomicBool::new(true));
        let (refine, pass, number) = (self.refine.clone(), self.pass.clone(), self.count);
        let (of, wanted) = (baked.clone(), is_wanted.clone());
        std::thread::spawn(move || {
            let wanted = || wanted.load(Ordering::Relaxed);
            if let Err(why) = refine(&of, &frame, &wanted, &|refined| pass(number, Ok(refined))) {
                pass(number, Err(why));
            }
        });
        self.present = Some(Refinement { baked: baked.clone(), frame, is_wanted, finest: None });
    }

    /// Takes a finer picture, if it is of the view that is seen; whether it is.
    pub fn take(&mut self, number: u64, refined: Refined) -> bool {
        let present = self.present.as_mut().filter(|_| number == self.count);
        let is_seen = present.is_some();
        if let Some(present) = present {
            present.finest = Some(Arc::new(refined));
        }
        is_seen
    }

    /// The finest picture of the view that is seen, if there is one yet.
    pub fn finest(&self) -> Option<&Arc<Refined>> {
        self.present.as_ref()?.finest.as_ref()
    }
}

impl Drop for Refinements {
    fn drop(&mut self) {
        self.follow(None);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::sync::mpsc::{Receiver, channel};
    use std::time::Duration;

    use scene::{Exposure, ToneCurve};

    use super::*;
    use crate::test_room::camera;

    const PATIENCE: Duration = Duration::from_secs(30);

    fn frame() -> Frame {
        let exposure = Some(Exposure { ev: 0.0 });
        Frame { camera: camera(), width: 2, height: 1, mode: Mode::Shaded, exposure, curve: ToneCurve::default() }
    }

    /// Refinements that show one picture, and then go on until they are no longer wanted, which the second channel tells.
    fn patient() -> (Refinements, Receiver<u64>, Receiver<()>) {
        let ((pass, passed), (end, ended)) = (channel(), channel());
        let refine = move |_: &Arc<Baked>, _: &Frame, wanted: &(dyn Fn() -> bool + Sync), show: &dyn Fn(Refined)| {
            show(Refined { pixels: vec![[0; 3]; 2], known: 0.5, samples_a_pixel: 1.0 });
            while wanted() {
                std::thread::sleep(Duration::from_millis(1));
            }
            end.send(()).map_err(|error| error.to_string())
        };
        let pass = move |number, refined: Result<Refined, String>| {
            refined.unwrap();
            pass.send(number).unwrap();
        };
        (Refinements::new(Arc::new(refine), Arc::new(pass)), passed, ended)
    }

    #[test]
    fn a_view_is_refined_once_and_until_it_moves() {
        let (mut refinements, passed, ended) = patient();
        let baked = Arc::new(Baked::default());
        refinements.follow(Some((&baked, frame())));
        refinements.follow(Some((&baked, frame())));
        let number = passed.recv_timeout(PATIENCE).unwrap();
        let nothing = || Refined { pixels: Vec::new(), known: 0.0, samples_a_pixel: 0.0 };
        assert!(refinements.take(number, nothing()) && refinements.finest().is_some());
        let moved = Frame { width: 3, ..frame() };
        refinements.follow(Some((&baked, moved)));
        ended.recv_timeout(PATIENCE).unwrap();
        assert!(refinements.finest().is_none(), "a picture of another view is not shown");
        assert!(!refinements.take(number, nothing()) && refinements.finest().is_none(), "nor one that comes late");
        assert_eq!(passed.recv_timeout(PATIENCE).unwrap(), number + 1);
        // A finer bake of the same view is another picture.
        refinements.follow(Some((&Arc::new(Baked::default()), moved)));
        ended.recv_timeout(PATIENCE).unwrap();
        assert_eq!(passed.recv_timeout(PATIENCE).unwrap(), number + 2);
        drop(refinements);
        ended.recv_timeout(PATIENCE).unwrap();
    }

    #[test]
    fn diagrams_and_windows_without_pixels_are_not_refined() {
        let (mut refinements, passed, _ended) = patient();
        let baked = Arc::new(Baked::default());
        refinements.follow(Some((&baked, Frame { mode: Mode::Mesh, ..frame() })));
        refinements.follow(Some((&baked, Frame { height: 0, ..frame() })));
        refinements.follow(None);
        assert!(passed.try_recv().is_err() && refinements.finest().is_none());
    }
}
