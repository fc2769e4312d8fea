//! Which lights are seen from which pixel, from a few of all shadow rays: Ben-Artzi, Ramamoorthi and Agrawala, "Efficient
//! Shadows from Sampled Environment Maps", Columbia University CUCS-025-04, 2004.
//!
//! A pixel is predicted from others that are known, and rays are traced where the prediction is doubtful; what they find wrong
//! is doubted further, from light to neighbouring light. All of the paper's variants are here, so that they can be compared.
//!
//! What we do differently: a light below the horizon of a known pixel is not known there, and the others are asked; the paper
//! does not say. On round bodies that spares the rays along the terminator. A light that no known pixel has above its horizon
//! is traced.

use std::collections::VecDeque;

use glam::{DVec3, Vec3};
use scene::{Ray, luminance};

use crate::environment_lights::EnvironmentLights;
use crate::evaluation_order::{Step, grid, scanlines};
use crate::light_set::{contains, count, members, put, words};
use crate::surface::{Receiver, Surfaces};

/// How visibility is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Visibility {
    /// By a ray to every light above the horizon.
    Full,
    /// By predictions, and rays where these are doubtful.
    Coherent(Coherence),
}

/// A variant of the paper's algorithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coherence {
    /// What a pixel is predicted from.
    pub order: EvaluationOrder,
    /// Whether blockers are moved to where they stand for the pixel, or taken to hide the light that they hid.
    pub warps: bool,
    /// Which predictions are doubted.
    pub flooding: Flooding,
    /// Whether what is found wrong is doubted further on the finest grid, too, where half of all pixels are.
    pub floods_finest: bool,
    /// What is done at the borders of objects.
    pub borders: Borders,
    /// Whether, before a ray is traced, the polygon that hid the light last is asked whether it still does: the same is seen, by
    /// fewer rays. Not with warping, which must know where the nearest blocker is.
    pub asks_hiders: bool,
    /// How many of the lights that are brightest on a pixel are doubted at boundaries, whatever the flooding: section 5 of the
    /// paper. Bright lights have small cells, and are what is seen of an error.
    pub brightest: u32,
    /// The part of the light of an unobstructed pixel, 0..1, that may be guessed: of the lights that known pixels disagree on
    /// the faintest are not traced, as long as all of them together send no more.
    pub error: f64,
}

/// What is done with a pixel of which not all that it is predicted from are of its own object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Borders {
    /// A ray to every light, as the paper has it.
    Traced,
    /// It is predicted from those that are, if there are two or more, and boundaries of what is seen are doubted, and what is
    /// found wrong flooded, whatever is done elsewhere.
    Predicted,
}

/// What a pixel is predicted from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EvaluationOrder {
    /// The pixel on its left; with uncertainty the three on its left and above.
    Scanline,
    /// The four around it on a coarser grid.
    Grid,
}

/// Which predictions are doubted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flooding {
    /// Where lights that are predicted seen and hidden meet; in scanlines along the horizon, too.
    Boundary,
    /// Where the known pixels disagree, and all around.
    Uncertainty,
    /// Where the known pixels disagree, and of the lights around those that are predicted otherwise than was found.
    Restricted,
}

impl Visibility {
    /// The variants by the paper's names: S scanline or G grid, W warping or N none, B boundary or U uncertainty, and OPT; each
    /// of OPT's two restrictions alone; and full tracing.
    pub const NAMED: [(&'static str, Self); 14] = [
        ("full", Self::Full),
        ("swb", coherent(EvaluationOrder::Scanline, true, Flooding::Boundary, true)),
        ("swu", coherent(EvaluationOrder::Scanline, true, Flooding::Uncertainty, true)),
        ("snb", coherent(EvaluationOrder::Scanline, false, Flooding::Boundary, true)),
        ("snu", coherent(EvaluationOrder::Scanline, false, Flooding::Uncertainty, true)),
        ("gwb", coherent(EvaluationOrder::Grid, true, Flooding::Boundary, true)),
        ("gnb", coherent(EvaluationOrder::Grid, false, Flooding::Boundary, true)),
        ("gwu", coherent(EvaluationOrder::Grid, true, Flooding::Uncertainty, true)),
        ("gnu", coherent(EvaluationOrder::Grid, false, Flooding::Uncertainty, true)),
        ("gnu-restricted", coherent(EvaluationOrder::Grid, false, Flooding::Restricted, true)),
        ("gnu-unflooded", coherent(EvaluationOrder::Grid, false, Flooding::Uncertainty, false)),
        ("opt", coherent(EvaluationOrder::Grid, false, Flooding::Restricted, false)),
        ("gnu-borders", predicting_borders(Flooding::Uncertainty, true)),
        ("opt-borders", predicting_borders(Flooding::Restricted, false)),
    ];
}

const fn coherent(order: EvaluationOrder, warps: bool, flooding: Flooding, floods_finest: bool) -> Visibility {
    Visibility::Coherent(Coherence {
        order,
        warps,
        flooding,
        floods_finest,
        borders: Borders::Traced,
        asks_hiders: false,
        brightest: 0,
        error: 0.0,
    })
}

const fn predicting_borders(flooding: Flooding, floods_finest: bool) -> Visibility {
    Visibility::Coherent(Coherence {
        order: EvaluationOrder::Grid,
        warps: false,
        flooding,
        floods_finest,
        borders: Borders::Predicted,
        asks_hiders: true,
        brightest: 0,
        error: 0.0,
    })
}

/// Pixels of its own object that one at a border is predicted from at least: from a single one hardly fewer rays are traced in
/// all, and on a plant a quarter more is predicted wrong.
const FEWEST_AT_BORDERS: usize = 2;

/// A pixel that light is asked for at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub receiver: Receiver,
    /// Predictions are from pixels of the same object alone.
    pub object: u32,
}

/// What is known of the lights at every pixel of a block.
pub(crate) struct BlockVisibility {
    /// By pixel, the set of lights that are seen.
    pub seen: Vec<u64>,
    /// By pixel, how many rays were traced.
    pub traced: Vec<u32>,
    /// By pixel, how many lights are above its horizon.
    pub above: Vec<u32>,
}

/// Finds the lights that are seen at every pixel of a block of so many columns and rows; none are at a pixel without a place.
pub(crate) fn block_visibility(
    surfaces: &Surfaces<'_>,
    lights: &EnvironmentLights,
    (width, height): (usize, usize),
    places: &[Option<Place>],
    visibility: Visibility,
) -> BlockVisibility {
    let mut search = Search::new(surfaces, lights, places, visibility);
    let Visibility::Coherent(coherence) = visibility else {
        (0..places.len()).for_each(|pixel| search.trace_all(pixel));
        return search.known;
    };
    let steps = match coherence.order {
        EvaluationOrder::Scanline => scanlines(width, height, coherence.flooding != Flooding::Boundary),
        EvaluationOrder::Grid => grid(width, height),
    };
    let at_borders = Coherence { flooding: Flooding::Boundary, floods_finest: true, ..coherence };
    for mut step in steps {
        let object = |pixel: usize| places[pixel].map(|place| place.object);
        let sources = step.sources.len();
        step.sources.retain(|&source| object(source) == object(step.pixel));
        let is_border = step.sources.len() < sources;
        let fewest = match coherence.borders {
            _ if !is_border => 1,
            Borders::Traced => usize::MAX,
            Borders::Predicted => FEWEST_AT_BORDERS,
        };
        if step.sources.len() < fewest {
            search.trace_all(step.pixel);
        } else {
            search.predict(&step, if is_border { at_borders } else { coherence });
        }
    }
    search.known
}

/// Directions of lights, coordinate by coordinate, so that several are compared with a horizon at once.
struct Directions([Vec<f64>; 3]);

impl Directions {
    fn new(directions: &[DVec3]) -> Self {
        Self([0, 1, 2].map(|axis| directions.iter().map(|direction| direction[axis]).collect()))
    }

    /// The lights above the horizon of a receiver: those that count on it.
    fn above(&self, receiver: &Receiver, above: &mut [u64]) {
        let Self([x, y, z]) = self;
        let (n, c) = (receiver.normal, receiver.cosine);
        let is_flat = n == c;
        for (i, word) in above.iter_mut().enumerate() {
            let first = i * u64::BITS as usize;
            let range = first..(first + u64::BITS as usize).min(x.len());
            let mut is_above = [false; u64::BITS as usize];
            let along = |a: DVec3, i: usize| a.x * x[i] + a.y * y[i] + a.z * z[i];
            if is_flat {
                range.zip(&mut is_above).for_each(|(i, is_above)| *is_above = along(n, i) > 0.0);
            } else {
                range.zip(&mut is_above).for_each(|(i, is_above)| *is_above = along(n, i).min(along(c, i)) > 0.0);
            }
            *word = is_above.iter().rev().fold(0, |word, &is_above| word << 1 | u64::from(is_above));
        }
    }
}

/// A block in the making.
struct Search<'a> {
    surfaces: &'a Surfaces<'a>,
    lights: &'a EnvironmentLights,
    directions: Directions,
    /// Of the irradiance of lights on what faces them.
    luminances: Vec<f64>,
    places: &'a [Option<Place>],
    known: BlockVisibility,
    /// By pixel and light, a point of what hides it, relative to the pixel, metres; not a number where nothing does. Empty
    /// without warping.
    blockers: Vec<Vec3>,
    /// By light, the polygon that hid it last. Empty where none is asked before a ray is traced.
    hiders: Vec<Option<u32>>,
    words: usize,
    /// Of the pixel at hand: lights above its horizon, those that nothing is predicted of, and those that are traced or will be.
    above: Vec<u64>,
    uncertain: Vec<u64>,
    doubted: Vec<u64>,
    queue: VecDeque<u32>,
    /// Lights above the horizon of a known pixel.
    source_above: Vec<u64>,
}

impl<'a> Search<'a> {
    fn new(
        surfaces: &'a Surfaces<'a>,
        lights: &'a EnvironmentLights,
        places: &'a [Option<Place>],
        visibility: Visibility,
    ) -> Self {
        let (words, pixels) = (words(lights.directions.len()), places.len());
        let warps = matches!(visibility, Visibility::Coherent(Coherence { warps: true, .. }));
        let asks_hiders = matches!(visibility, Visibility::Coherent(Coherence { asks_hiders: true, .. }));
        let set = || vec![0; words];
        Self {
            surfaces,
            lights,
            directions: Directions::new(&lights.directions),
            luminances: lights.irradiance.iter().map(|&light| luminance(light)).collect(),
            places,
            known: BlockVisibility { seen: vec![0; pixels * words], traced: vec![0; pixels], above: vec![0; pixels] },
            blockers: vec![Vec3::NAN; if warps { pixels * lights.directions.len() } else { 0 }],
            hiders: vec![None; if asks_hiders { lights.directions.len() } else { 0 }],
            words,
            above: set(),
            uncertain: set(),
            doubted: set(),
            queue: VecDeque::new(),
            source_above: set(),
        }
    }

    /// Traces a ray to every light above a pixel's horizon.
    fn trace_all(&mut self, pixel: usize) {
        let Some(place) = self.places[pixel] else { return };
        self.look_up(pixel, &place.receiver);
        for word in 0..self.words {
            for light in members(&[self.above[word]]) {
                self.trace(pixel, &place.receiver, (word * u64::BITS as usize) as u32 + light);
            }
        }
    }

    /// Finds the lights above a pixel's horizon.
    fn look_up(&mut self, pixel: usize, receiver: &Receiver) {
        self.directions.above(receiver, &mut self.above);
        self.known.above[pixel] = count(&self.above) as u32;
    }

    /// Traces a ray from a pixel to a light, unless what hid the light last still does; whether the light is seen.
    fn trace(&mut self, pixel: usize, receiver: &Receiver, light: u32) -> bool {
        let direction = self.lights.directions[light as usize];
        // As far away as everything is before.
        let way = direction * 2.0 * self.surfaces.size;
        let stands = |id| !self.surfaces.is_on(receiver, id);
        let hider = self.hiders.get(light as usize).copied().flatten().filter(|&hider| stands(hider));
        if hider.is_some_and(|hider| self.surfaces.crosses(hider, &Ray { origin: receiver.position, direction: way })) {
            put(&mut self.known.seen[pixel * self.words..][..self.words], light, false);
            return false;
        }
        self.known.traced[pixel] += 1;
        let is_seen = if self.blockers.is_empty() {
            let hider = self.surfaces.bvh.blocker_among(receiver.position, receiver.position + way, stands);
            if let Some(last) = self.hiders.get_mut(light as usize) {
                *last = hider.or(*last);
            }
            hider.is_none()
        } else {
            let ray = Ray { origin: receiver.position, direction };
            let hit = self.surfaces.bvh.closest_hit_among(&ray, stands);
            let blocker = hit.map_or(Vec3::NAN, |hit| (direction * hit.distance).as_vec3());
            self.blockers[pixel * self.lights.directions.len() + light as usize] = blocker;
            hit.is_none()
        };
        put(&mut self.known.seen[pixel * self.words..][..self.words], light, is_seen);
        is_seen
    }

    /// Predicts a pixel, and traces what is doubtful.
    fn predict(&mut self, step: &Step, coherence: Coherence) {
        let Some(place) = self.places[step.pixel] else { return };
        self.look_up(step.pixel, &place.receiver);
        let is_boundary = coherence.flooding == Flooding::Boundary;
        if coherence.warps {
            self.predict_by_blockers(step, &place.receiver, is_boundary);
        } else {
            self.predict_by_agreement(step, &place.receiver, is_boundary && coherence.borders == Borders::Traced);
        }
        self.doubt(step, &place.receiver, coherence);
        let floods = coherence.floods_finest || !step.is_finest;
        while let Some(light) = self.queue.pop_front() {
            let predicted = contains(self.seen(step.pixel), light);
            let is_seen = self.trace(step.pixel, &place.receiver, light);
            let is_news = contains(&self.uncertain, light) || predicted != is_seen;
            if !floods || !is_news {
                continue;
            }
            for &neighbour in self.lights.voronoi.neighbours(light) {
                let agrees = coherence.flooding == Flooding::Restricted
                    && contains(&self.known.seen[step.pixel * self.words..], neighbour) == is_seen;
                if !agrees {
                    enqueue(&mut self.queue, &mut self.doubted, &self.above, neighbour);
                }
            }
        }
    }

    /// The set of lights that are seen, or predicted to be, at a pixel.
    fn seen(&self, pixel: usize) -> &[u64] {
        &self.known.seen[pixel * self.words..][..self.words]
    }

    /// What the known pixels agree on.
    /// With `hides_all`, what any of them has hidden is predicted hidden, instead of nothing where they disagree.
    fn predict_by_agreement(&mut self, step: &Step, receiver: &Receiver, hides_all: bool) {
        self.uncertain.copy_from_slice(&self.above);
        let (mut seen_by_any, mut hidden_for_any) = (vec![0; self.words], vec![0; self.words]);
        for &source in &step.sources {
            let Some(other) = self.places[source].map(|place| place.receiver) else { continue };
            if other.normal == receiver.normal && other.cosine == receiver.cosine {
                self.source_above.copy_from_slice(&self.above);
            } else {
                self.directions.above(&other, &mut self.source_above);
            }
            for word in 0..self.words {
                let seen = self.known.seen[source * self.words + word];
                seen_by_any[word] |= seen;
                hidden_for_any[word] |= self.source_above[word] & !seen;
            }
        }
        for word in 0..self.words {
            let (seen, hidden) = (seen_by_any[word], hidden_for_any[word]);
            let (is_known, is_agreed) = (seen | hidden, seen ^ hidden);
            self.uncertain[word] &= if hides_all { !is_known } else { !is_agreed };
            self.known.seen[step.pixel * self.words + word] = self.above[word] & seen & !hidden;
        }
    }

    /// What the blockers of the known pixels hide: a light in whose cell as many lie as there are known pixels.
    /// With `hides_all`, one blocker is enough.
    fn predict_by_blockers(&mut self, step: &Step, receiver: &Receiver, hides_all: bool) {
        let lights = self.lights.directions.len();
        let mut counts = vec![0; lights];
        let mut nearest = vec![(f64::NEG_INFINITY, Vec3::NAN); lights];
        for &source in &step.sources {
            let Some(other) = self.places[source].map(|place| place.receiver) else { continue };
            for blocker in &self.blockers[source * lights..][..lights] {
                let from_here = blocker.as_dvec3() + (other.position - receiver.position);
                if blocker.is_nan() || receiver.cosine_to(from_here) <= 0.0 {
                    continue;
                }
                let light = self.lights.voronoi.nearest(from_here) as usize;
                counts[light] += 1;
                let cosine = from_here.normalize().dot(self.lights.directions[light]);
                if cosine > nearest[light].0 {
                    nearest[light] = (cosine, from_here.as_vec3());
                }
            }
        }
        let enough = if hides_all { 1 } else { step.sources.len() };
        self.uncertain.fill(0);
        for light in members(&self.above) {
            let blockers = counts[light as usize];
            put(&mut self.uncertain, light, blockers > 0 && blockers < enough);
            put(&mut self.known.seen[step.pixel * self.words..][..self.words], light, blockers == 0);
            self.blockers[step.pixel * lights + light as usize] = nearest[light as usize].1;
        }
    }

    /// Doubts what is uncertain, and boundaries where seen and hidden meet: all with boundary flooding, else those of the
    /// brightest lights.
    fn doubt(&mut self, step: &Step, receiver: &Receiver, coherence: Coherence) {
        self.doubted.fill(0);
        let ranks = coherence.error > 0.0 || coherence.brightest > 0;
        let lights = if ranks { self.lights.directions.iter() } else { [].iter() };
        let strengths = lights.zip(&self.luminances).map(|(&to, luminance)| luminance * receiver.cosine_to(to));
        let strengths: Vec<f64> = strengths.collect();
        let strength = |light: &u32| strengths[*light as usize];
        let mut uncertain: Vec<u32> = members(&self.uncertain).collect();
        if coherence.error > 0.0 {
            uncertain.sort_by(|a, b| strength(a).total_cmp(&strength(b)));
            let mut left = coherence.error * members(&self.above).map(|light| strength(&light)).sum::<f64>();
            let traced = uncertain.iter().position(|light| {
                left -= strength(light);
                left < 0.0
            });
            let traced = uncertain.split_off(traced.unwrap_or(uncertain.len()));
            for light in std::mem::replace(&mut uncertain, traced) {
                self.guess(step, light);
            }
        }
        for light in uncertain {
            enqueue(&mut self.queue, &mut self.doubted, &self.above, light);
        }
        let mut at_risk: Vec<u32> = Vec::new();
        if coherence.flooding == Flooding::Boundary {
            at_risk = members(&self.above).collect();
        } else if coherence.brightest > 0 {
            at_risk = members(&self.above).collect();
            at_risk.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
            at_risk.truncate(coherence.brightest as usize);
        }
        let has_horizon = coherence.order == EvaluationOrder::Scanline;
        for light in at_risk {
            let seen = &self.known.seen[step.pixel * self.words..];
            let is_boundary = self.lights.voronoi.neighbours(light).iter().any(|&neighbour| {
                if contains(&self.above, neighbour) {
                    contains(seen, neighbour) != contains(seen, light)
                } else {
                    has_horizon
                }
            });
            if is_boundary {
                enqueue(&mut self.queue, &mut self.doubted, &self.above, light);
            }
        }
    }

    /// Takes a light for seen if more known pixels see it than not; where as many do, at every other pixel.
    fn guess(&mut self, step: &Step, light: u32) {
        let seen = step.sources.iter().filter(|&&source| contains(self.seen(source), light)).count();
        let direction = self.lights.directions[light as usize];
        let is_above = |source: &&usize| self.places[**source].is_some_and(|at| at.receiver.cosine_to(direction) > 0.0);
        let known = step.sources.iter().filter(is_above).count();
        let is_seen = 2 * seen > known || 2 * seen == known && (step.pixel + light as usize).is_multiple_of(2);
        put(&mut self.known.seen[step.pixel * self.words..][..self.words], light, is_seen);
        put(&mut self.uncertain, light, false);
    }
}

/// Has a light traced that is above the horizon, once.
fn enqueue(queue: &mut VecDeque<u32>, doubted: &mut [u64], above: &[u64], light: u32) {
    if contains(above, light) && !contains(doubted, light) {
        put(doubted, light, true);
        queue.push_back(light);
    }
}
