//! What reaches the window from other threads: bakes, made ready to be drawn where no frame waits for it.

use std::sync::{
    Arc, Condvar, Mutex, PoisonError,
    mpsc::{Receiver, Sender, channel},
};

use scene::Baked;
use winit::event_loop::EventLoopProxy;

use crate::{
    Explain, Gpu, LightSource, Refined, SurfacePoint, Update, ViewerError, gpu::ResidentBake, twin::Twin, walk::Shown,
};

/// Something that another thread has done.
pub(crate) enum Event {
    /// A bake is ready, and in the memory of the adapter that there was, or why it is not.
    Ready(Arc<Shown>, Option<(Arc<Gpu>, Result<ResidentBake, ViewerError>)>),
    /// An update that is no bake.
    Update(Update),
    /// A finer picture of the view that was refined by a number, or why there is none.
    Refined(u64, Result<Refined, String>),
    /// The sources of the light at a point, or why there are none.
    Answer(SurfacePoint, Result<Vec<LightSource>, String>),
    /// A graphics device is gone: its serial number, and what its driver says.
    DeviceLost(u64, String),
}

/// Where threads find the adapter that draws: not yet known, or none.
#[derive(Default)]
pub(crate) struct GpuSlot {
    gpu: Mutex<Option<Option<Arc<Gpu>>>>,
    known: Condvar,
}

impl GpuSlot {
    /// Says what draws from now on.
    pub fn set(&self, gpu: Option<Arc<Gpu>>) {
        *self.gpu.lock().unwrap_or_else(PoisonError::into_inner) = Some(gpu);
        self.known.notify_all();
    }

    /// What draws; waits until it is known.
    pub fn wait(&self) -> Option<Arc<Gpu>> {
        let guard = self.gpu.lock().unwrap_or_else(PoisonError::into_inner);
        let known = self.known.wait_while(guard, |gpu| gpu.is_none()).unwrap_or_else(PoisonError::into_inner);
        known.as_ref().and_then(Option::clone)
    }
}

/// Passes updates on to the window from a thread of its own. Of bakes that come faster than they can be made ready the last
/// one is taken.
pub(crate) fn pass_on(updates: Receiver<Update>, gpu: Arc<GpuSlot>, window: EventLoopProxy<Event>) {
    std::thread::spawn(move || {
        while let Ok(first) = updates.recv() {
            let mut newest = None;
            for update in std::iter::once(first).chain(updates.try_iter()) {
                let passed = match update {
                    Update::Bake(baked) => {
                        newest = Some(baked);
                        Ok(())
                    }
                    other => window.send_event(Event::Update(other)),
                };
                if passed.is_err() {
                    return; // The window is closed.
                }
            }
            if let Some(baked) = newest {
                let shown = Arc::new(Shown { twin: Twin::new(&baked), baked });
                let resident = gpu.wait().map(|gpu| {
                    let uploaded = ResidentBake::upload(&gpu, &shown.twin.records);
                    (gpu, uploaded)
                });
                if window.send_event(Event::Ready(shown, resident)).is_err() {
                    return;
                }
            }
        }
    });
}

/// A thread that asks for the light at points; of points that come faster than answers the last one is taken.
pub(crate) fn asker(explain: Arc<Explain>, window: EventLoopProxy<Event>) -> Sender<(Arc<Baked>, SurfacePoint)> {
    let (questions, asked) = channel::<(Arc<Baked>, SurfacePoint)>();
    std::thread::spawn(move || {
        while let Ok(first) = asked.recv() {
            let (baked, point) = asked.try_iter().last().unwrap_or(first);
            if window.send_event(Event::Answer(point, explain(&baked, point))).is_err() {
                return;
            }
        }
    });
    questions
}
