//! The picture of a view in the window, refined while it rests: what `render` draws, as it grows.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use rayon::ThreadPoolBuilder;
use renderer::{AdaptiveOptions, Evaluator, Filter};
use scene::{Baked, Display, Exposure};
use viewer::{Frame, Refined};

use crate::args::{Interpolation, RadianceFlags};
use crate::light_sources::LightSources;
use crate::picture::{Picture, Reconstruction, encoded};
use crate::radiance::{View, with_evaluator_of};

/// How often a finer picture is shown: as often as an eye likes to see it change, and seldom enough to cost little.
const EVERY: Duration = Duration::from_millis(100);

/// How soon the first one is.
const FIRST: Duration = Duration::from_millis(20);

/// Seed of the samples.
const SEED: u64 = 1;

/// Shows finer and finer pictures of a view of a bake, until every pixel is known or none is wanted. One processor is left to the
/// frames.
pub fn refine(
    baked: &Arc<Baked>,
    sources: &LightSources,
    frame: &Frame,
    radiance: RadianceFlags,
    wanted: &(dyn Fn() -> bool + Sync),
    show: &dyn Fn(Refined),
) -> Result<()> {
    let size = (frame.width, frame.height);
    let display = Display::new(frame.exposure.unwrap_or(Exposure { ev: 0.0 }), frame.curve);
    let view = View { camera: frame.camera, size, radiance, seed: SEED };
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = ThreadPoolBuilder::new().num_threads((processors - 1).max(1)).build()?;
    // What is shown goes out from this thread; its work is done on the others.
    with_evaluator_of(baked, sources, &view, |evaluate| {
        let mut picture = threads.install(|| begin(size, display, evaluate)).context("no picture of that size")?;
        let (mut last, mut pause) = (Instant::now(), FIRST);
        let mut goes_on = true;
        while goes_on && wanted() {
            goes_on = threads.install(|| picture.advance(u64::MAX, evaluate, &|| !wanted()));
            if last.elapsed() >= pause || !goes_on {
                show(threads.install(|| refined(&mut picture, size)));
                (last, pause) = (Instant::now(), EVERY);
            }
        }
        Ok(())
    })
}

/// The picture that `render` draws by default.
fn begin(size: (u32, u32), display: Display, evaluate: &Evaluator<'_>) -> Option<Picture> {
    let options = AdaptiveOptions { seed: SEED, ..AdaptiveOptions::of(display) };
    let film = Reconstruction::new(size, Filter::Lanczos, Interpolation::Constant, Some(display));
    Picture::adaptive(size, &options, film, evaluate)
}

fn refined(picture: &mut Picture, (width, height): (u32, u32)) -> Refined {
    let samples_a_pixel = picture.samples() as f64 / (f64::from(width) * f64::from(height));
    let pixels = encoded(&picture.light());
    Refined { pixels, known: picture.closed_share().unwrap_or_default(), samples_a_pixel }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::cell::RefCell;
    use std::path::Path;

    use scene::ToneCurve;
    use viewer::Mode;

    use super::*;
    use crate::args::{LightFlags, RadianceChoice};
    use crate::pipeline;

    /// All four kinds of radiance end in about the same picture, in which every pixel is known; what is not wanted is not begun.
    #[test]
    fn a_view_is_refined_until_it_is_known_or_not_wanted() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes/cornell_box.obj");
        let scene = formats::read_scene(&path).unwrap().scene;
        let flags = LightFlags { tolerance: 0.05, bounces: Some(0), ..LightFlags::default() };
        let baked = Arc::new(pipeline::bake(&scene, &flags, None).baked);
        let frame = Frame {
            camera: scene.cameras[0].camera,
            width: 32,
            height: 24,
            mode: Mode::Shaded,
            exposure: Some(Exposure { ev: -3.0 }),
            curve: ToneCurve::Linear,
        };
        let sources = LightSources::default();
        let last = |radiance: RadianceChoice, wanted: bool| {
            let shown = RefCell::new(Vec::new());
            let flags = RadianceFlags { radiance, paths: None, bounces: Some(0) };
            refine(&baked, &sources, &frame, flags, &|| wanted, &|refined| shown.borrow_mut().push(refined)).unwrap();
            shown.into_inner().pop()
        };
        let mean = |refined: &Refined| {
            let sum: u32 = refined.pixels.iter().flatten().map(|&channel| u32::from(channel)).sum();
            f64::from(sum) / refined.pixels.len() as f64
        };
        let first = last(RadianceChoice::Interpolant, true).unwrap();
        assert!(first.known == 1.0 && first.samples_a_pixel > 1.0 && first.pixels.len() == 32 * 24);
        for radiance in [RadianceChoice::Gather, RadianceChoice::Path, RadianceChoice::Whitted] {
            let other = last(radiance, true).unwrap();
            assert!((mean(&other) / mean(&first) - 1.0).abs() < 0.02, "{radiance:?} {} {}", mean(&other), mean(&first));
        }
        assert!(last(RadianceChoice::Path, false).is_none());
    }
}
