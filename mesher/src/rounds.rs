//! One round of a bake: leaves are divided where probes find light interpolated badly, first that of emitters, then that over
//! reflectors.

use glam::{DVec2, Vec3};
use scene::{Baked, Rgb};
use solver::{Gather, NodeId, Solution, Surroundings, Visibility, first_look};

use crate::BakeOptions;
use crate::claimed_error::LARGEST_REFLECTANCE;
use crate::fine_mesh::{EmittedLight, FineMesh};
use crate::guess::guessed_reflected;
use crate::inquiry::Inquiry;
use crate::lines::Lines;
use crate::memory::held;
use crate::probe::colour_mean;
use crate::refinement::worst;
use crate::reflected_light::{Exchange, ReflectedLight};

/// Of the error that is allowed, as much is aimed at when leaves are chosen: their parts keep some of it.
const AIM: f64 = 0.6;

/// Meshes in one round at most. Each divides what the last one found wanting.
const MESHES: u32 = 12;

/// Where reflected light is found by rays, from this mesh on no more than a part of all leaves is divided, and that if they hold so
/// much of the error's square: a few are found wanting for what they are, many by chance.
const MESHES_BY_RAYS: u32 = 4;
const FEW: usize = 50;
const MUCH: f64 = 0.5;

/// Where rays find light over reflectors, leaves are divided down to this part of the allowed square even if the whole keeps it, as long
/// as they are few, and meshes too: in a hall one leaf in 300, over a lamp, holds more of the error than all boxes. Less divides by
/// chance, more leaves what costs next to nothing to mend. Of light from emitters a few thousand leaves of a large hall would be
/// divided again and again for a third of its time, for what rays to faint lamps scatter by.
const CHEAP: f64 = 0.25;

/// What light from emitters may use up of the share of reflected light, where rays find that: with so few emitters, and with more. In a row
/// of rooms it is had for a quarter of the time. Where there are many, most are faint at a point, and told by single rays: less divides
/// leaves for what these scatter by, without end.
const EMITTED_BY_RAYS: [f64; 2] = [1.2, 1.8];
const FEW_EMITTERS: usize = 32;

/// Discontinuities that a leaf follows at most where links have not told them: a leaf that is wanting is divided besides. Ten
/// double the triangles of a hall, and mend no more.
const LINES_BY_RAYS: u32 = 3;

/// Leaves with a cell shorter than this fraction of the scene's size are not divided: at a corner of contact the error falls
/// no faster than its area.
const SMALLEST_LEAF: f64 = 1e-3;

/// The part of the tolerance, relative to the scene's mean irradiance, that all further exchanges may still change a sample by:
/// the last one's change, summed over the bounces to come.
const RESIDUAL_SHARE: f64 = 0.02;

/// The same in a scene without links, whose dim rooms count by their own light.
const RESIDUAL_SHARE_BY_RAYS: f64 = 0.01;

/// An emitter that sends less than this part of the tolerance to a point is dim there.
const DIM: f64 = 0.5;

/// What goes from round to round.
pub(crate) struct Rounds<'a> {
    pub surroundings: &'a Surroundings<'a>,
    pub options: &'a BakeOptions,
    pub solution: Solution,
    pub lines: Lines,
    pub inquiry: Inquiry<'a>,
    /// Who is shown every mesh, and all that is found out of its light.
    pub watch: Option<&'a (dyn Fn(Baked) + Sync)>,
    pub emitted: EmittedLight,
    pub reflected: ReflectedLight,
    /// Mean irradiance of all surfaces, averaged over the colours, W·m⁻².
    pub mean: f64,
    /// The share of the tolerance that reflected light may use up in this round, and the other kind as much, but where rays find it.
    pub share: f64,
    /// The part of the tolerance that a row may misplace on account of each reflector.
    pub source_share: f64,
    /// The part of the light on all surfaces that they reflect, 0..=1.
    pub reflectance: f64,
    /// By leaf of the front, ascending, what the coarse mesh gets wrong at its probe, W·m⁻².
    pub reflected_errors: Vec<(NodeId, f64)>,
}

impl Rounds<'_> {
    /// One round: divides leaves until both kinds of light are interpolated well enough; the mesh of the last division. If the
    /// bake is stopped meanwhile, the last mesh all of whose light from emitters is known, or the first.
    pub fn mesh(&mut self) -> FineMesh {
        let mut fine = self.mesh_emitted();
        self.emitted.forget_shafts();
        if !self.solution.reflects() || self.inquiry.stopped() {
            return fine;
        }
        let residual_share = match self.solution.visibility {
            Visibility::Links => RESIDUAL_SHARE,
            Visibility::Rays => RESIDUAL_SHARE_BY_RAYS,
        };
        for mesh in 1..=MESHES {
            let exchange = Exchange {
                source_error: self.source_share * self.options.tolerance,
                residual: residual_share * self.options.tolerance * self.mean * (1.0 - self.reflectance),
            };
            self.reflected.solve(self.surroundings, &mut self.solution, &fine, &exchange, &mut self.inquiry);
            if self.inquiry.stopped() {
                break;
            }
            self.show(&fine);
            if self.solution.visibility == Visibility::Rays {
                let samples = self.reflected.irradiance(&self.solution, &fine);
                self.take_means(&fine, &samples);
            }
            let errors = self.reflected.leaf_errors(self.surroundings, &self.solution, &exchange, &mut self.inquiry);
            let Some(errors) = errors else { break };
            self.reflected_errors = errors.iter().map(|error| (error.element, error.error)).collect();
            self.reflected_errors.sort_unstable_by_key(|error| error.0);
            let leaves: Vec<(NodeId, f64)> = errors
                .iter()
                .map(|error| {
                    let own = error.irradiance + colour_mean(self.solution.emitted_over_links(error.element));
                    (error.element, error.error / own.max(self.mean_around(error.element)))
                })
                .collect();
            let by_rays = self.solution.visibility == Visibility::Rays;
            let is_late = mesh >= MESHES_BY_RAYS;
            let most = if by_rays && is_late { leaves.len() / FEW } else { usize::MAX };
            let (divided, excess) = self.wanting(&leaves, self.share, by_rays && !is_late, most);
            self.inquiry.expect_division(excess);
            if divided.is_empty() || mesh == MESHES || fine.triangles() > self.options.max_triangles {
                break;
            }
            if self.reflected.divide(&mut self.solution, &divided)
                && let Some(finer) = self.finer_mesh(&fine)
            {
                fine = finer;
            }
        }
        fine
    }

    /// The mesh of the solution's leaves as they are.
    fn fine_mesh(&mut self) -> FineMesh {
        let BakeOptions { discontinuities, weight, .. } = *self.options;
        let most = if self.solution.visibility == Visibility::Rays { LINES_BY_RAYS } else { u32::MAX };
        let lines = (&self.lines, weight, discontinuities.min(most) as usize);
        let dim = DIM * self.options.tolerance;
        let fine = FineMesh::new(self.surroundings, &self.solution, lines, dim, &mut self.emitted, &mut self.inquiry);
        self.inquiry.hold(held(&self.solution, &fine) + self.lines.bytes());
        fine
    }

    /// The same after a division; none if the bake was stopped before all of its light was known, or the mesh would be too large: as
    /// many times as the coarser one as there are leaves now.
    fn finer_mesh(&mut self, coarser: &FineMesh) -> Option<FineMesh> {
        let leaves = self.solution.elements.nodes.iter().filter(|node| node.child_count == 0).count();
        let times = leaves as f64 / coarser.leaves.len().max(1) as f64;
        if !self.inquiry.has_room((held(&self.solution, coarser) as f64 * times) as usize + self.lines.bytes()) {
            return None;
        }
        let fine = self.fine_mesh();
        (!self.inquiry.stopped()).then_some(fine)
    }

    /// Irradiance at the samples of a mesh, W·m⁻².
    pub fn samples(&self, fine: &FineMesh) -> Vec<Vec3> {
        if !self.solution.reflects() {
            return fine.shown().to_vec();
        }
        if !self.reflected.is_known() {
            let guess = |query| guessed_reflected(&self.solution, query, self.reflectance);
            return fine
                .table
                .queries
                .iter()
                .zip(fine.shown())
                .map(|(query, light)| light + guess(query).as_vec3())
                .collect();
        }
        self.reflected.irradiance(&self.solution, fine)
    }

    /// What a scene without links is told of its light as a whole by a mesh of it.
    fn take_means(&mut self, fine: &FineMesh, samples: &[Vec3]) {
        let (mut arrives, mut reflected, mut area) = (Rgb::ZERO, Rgb::ZERO, 0.0);
        for (triangle, stations) in fine.table.triangles.iter().enumerate() {
            // A quadratic's mean is that of its midpoints.
            let mean = [1, 3, 5].map(|i: usize| samples[stations[i] as usize].as_dvec3()).iter().sum::<Rgb>() / 3.0;
            let part = scene::area_vector(&fine.corners(triangle)).length();
            let polygon = fine.leaves[fine.mesh.triangles[triangle].leaf as usize].polygon;
            arrives += mean * part;
            reflected += mean * part * self.surroundings.scene.reflectance(polygon);
            area += part;
        }
        let (arrives, area) = (arrives.max(Rgb::ZERO), f64::max(area, f64::MIN_POSITIVE));
        self.solution.mean_irradiance = arrives / area;
        self.mean = colour_mean(arrives / area);
        if self.solution.reflects() && self.mean > 0.0 {
            self.reflectance = (colour_mean(reflected) / colour_mean(arrives)).clamp(0.0, LARGEST_REFLECTANCE);
        }
    }

    /// Divides leaves until light from emitters is interpolated well enough.
    fn mesh_emitted(&mut self) -> FineMesh {
        let is_guessed = self.solution.visibility == Visibility::Rays && self.solution.outlooks.is_empty();
        let (surroundings, solution) = (self.surroundings, &self.solution);
        let look = |go_on: &(dyn Fn(f64) -> bool + Sync)| first_look(surroundings, solution, go_on);
        if is_guessed && let Some(look) = self.inquiry.first_look(look) {
            self.solution.mean_irradiance = look.mean_irradiance;
            self.solution.outlooks = look.outlooks;
            self.mean = colour_mean(look.mean_irradiance);
            self.reflectance = look.reflectance.min(LARGEST_REFLECTANCE);
        }
        let mut fine = self.fine_mesh();
        for _ in 1..=MESHES {
            let mut leaves: Vec<(NodeId, f64)> = fine.leaves.iter().map(|leaf| (leaf.element, 0.0)).collect();
            for (triangle, (error, emitted)) in fine.probe_emitted().into_iter().enumerate() {
                let leaf = fine.mesh.triangles[triangle].leaf as usize;
                let element = leaves[leaf].0;
                let own = emitted + colour_mean(self.solution.reflected_over_links(element, DVec2::ZERO));
                let part = scene::area_vector(&fine.corners(triangle)).length()
                    / self.solution.elements.nodes[element as usize].area;
                leaves[leaf].1 += part * (error / own.max(self.mean_around(element))).powi(2);
            }
            leaves.iter_mut().for_each(|leaf| leaf.1 = leaf.1.sqrt());
            self.show(&fine);
            let (divided, _) = self.wanting(&leaves, self.share_of_emitted(), false, usize::MAX);
            if divided.is_empty() || fine.triangles() > self.options.max_triangles {
                break;
            }
            self.look_for_lines(&divided);
            for leaf in divided {
                self.solution.subdivide(leaf);
            }
            let Some(finer) = self.finer_mesh(&fine) else { break };
            fine = finer;
        }
        fine
    }

    /// Mean irradiance of what surrounds an element, at most that of all surfaces, averaged over the colours, W·m⁻²: what errors count
    /// relative to where it is dark.
    fn mean_around(&self, element: NodeId) -> f64 {
        self.mean * self.solution.brightness(element)
    }

    /// Looks for lines in leaves that are wanting, where links have not told them, for their parts to follow.
    fn look_for_lines(&mut self, leaves: &[NodeId]) {
        if self.solution.visibility == Visibility::Links {
            return;
        }
        let BakeOptions { weight, min_weight, tolerance, .. } = *self.options;
        let (surroundings, solution) = (self.surroundings, &self.solution);
        let scene = surroundings.scene;
        let least = |leaf, diameter| {
            let mean = || weight.minimum_in_leaf(scene, solution, tolerance, diameter);
            min_weight.unwrap_or_else(|| solution.brightness(leaf) * mean())
        };
        let gather = Gather::with_source_error(surroundings, solution, DIM * tolerance);
        let lines = &mut self.lines;
        self.emitted.with_shafts(leaves, |leaves| lines.search(scene, (solution, &gather), leaves, weight, least));
    }

    /// By triangle, what probes find of both kinds of light, relative to max(own, mean) irradiance.
    pub fn triangle_errors(&self, fine: &FineMesh, samples: &[Vec3]) -> Vec<f32> {
        let elements = &self.solution.elements;
        let reflected = |element: NodeId| {
            let of = |node: NodeId| self.reflected_errors.binary_search_by_key(&node, |error| error.0).ok();
            elements.ancestors(element).find_map(of).map_or(0.0, |place| self.reflected_errors[place].1)
        };
        let errors = fine.probe_emitted().into_iter().enumerate();
        errors
            .map(|(triangle, (emitted, _))| {
                let leaf = &fine.leaves[fine.mesh.triangles[triangle].leaf as usize];
                let own = fine.table.triangles[triangle].map(|sample| colour_mean(samples[sample as usize].as_dvec3()));
                let own = own.iter().sum::<f64>() / own.len() as f64;
                let scale = own.max(self.mean);
                if scale > 0.0 { (emitted.hypot(reflected(leaf.element)) / scale) as f32 } else { 0.0 }
            })
            .collect()
    }

    /// The share of the tolerance that light from emitters may use up in this round.
    fn share_of_emitted(&self) -> f64 {
        match self.solution.visibility {
            Visibility::Links => self.share,
            Visibility::Rays => self.share * EMITTED_BY_RAYS[usize::from(self.surroundings.emitters() > FEW_EMITTERS)],
        }
    }

    /// Of elements with their relative errors, those that are to be divided so that a share of the tolerance is kept, ascending, or
    /// more than that `if_few` are; and the error of all in such shares, at least 1. Where more than `most` are wanting, the worst of them,
    /// if these hold much of the error.
    fn wanting(&self, leaves: &[(NodeId, f64)], share: f64, if_few: bool, most: usize) -> (Vec<NodeId>, f64) {
        let elements = &self.solution.elements;
        let area = |leaf: NodeId| elements.nodes[leaf as usize].area;
        let total: f64 = leaves.iter().map(|&(leaf, _)| area(leaf)).sum();
        let allowed = (share * self.options.tolerance).powi(2) * total;
        let smallest = SMALLEST_LEAF * self.surroundings.scene.size();
        let weighted: Vec<f64> = leaves
            .iter()
            .map(|&(leaf, error)| {
                let divides = elements.cell_length(leaf) > smallest && error.is_finite();
                if divides { error * error * area(leaf) } else { 0.0 }
            })
            .collect();
        let square = weighted.iter().sum::<f64>();
        let cheap = if if_few { worst(&weighted, CHEAP * allowed) } else { Vec::new() };
        let mut chosen = if !cheap.is_empty() && cheap.len() * FEW <= leaves.len() {
            cheap
        } else if square > allowed {
            worst(&weighted, AIM * allowed)
        } else {
            Vec::new()
        };
        if chosen.len() > most {
            chosen.sort_by(|&a, &b| weighted[b].total_cmp(&weighted[a]).then(a.cmp(&b)));
            chosen.truncate(most);
            if chosen.iter().map(|&i| weighted[i]).sum::<f64>() < MUCH * square {
                chosen.clear();
            }
        }
        if chosen.is_empty() {
            return (Vec::new(), 1.0);
        }
        let mut divided: Vec<NodeId> = chosen.into_iter().map(|i| leaves[i].0).collect();
        divided.sort_unstable();
        (divided, (square / allowed).sqrt().max(1.0))
    }
}
