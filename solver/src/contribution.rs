//! What the light at a point is made of: one entry for every source that is seen there.

use std::collections::BTreeMap;

use glam::DVec3;
use scene::{Rgb, luminance};

use crate::lamp_rays::FaintGroups;
use crate::leaf_gather::{LeafGather, Source};
use crate::seen_node::SeenNode;
use crate::sky_view::SkyView;
use crate::{Cosine, Gather};

/// Who sends light to a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sender {
    /// A polygon; the first face of a convex body that emits.
    Polygon(u32),
    /// All emitters together that are too faint there to be told apart, as there are in scenes without links.
    #[default]
    FaintEmitters,
    /// The sky.
    Sky,
}

/// The light of one source at a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contribution {
    /// The source.
    pub sender: Sender,
    /// Irradiance at the point by what the source emits, W·m⁻².
    pub emitted: Rgb,
    /// Irradiance at the point by what it reflects, W·m⁻².
    pub reflected: Rgb,
    /// Polygons that may hide some of the source from some point of the leaf, ascending.
    pub blockers: Vec<u32>,
}

impl Contribution {
    /// All that the source sends to the point, W·m⁻².
    pub fn irradiance(&self) -> Rgb {
        self.emitted + self.reflected
    }
}

impl Gather<'_> {
    /// The light at a position in the plane of a polygon, source by source, the strongest first. Its sum is
    /// [`Gather::irradiance_at`], which says what `inward` is.
    pub fn contributions_at(&self, polygon: u32, position: DVec3, inward: DVec3) -> Vec<Contribution> {
        let Some(leaf) = self.leaf_under(polygon, position, DVec3::ZERO, inward) else { return Vec::new() };
        let leaf = self.over(leaf);
        let mut found: BTreeMap<Sender, Contribution> = BTreeMap::new();
        let LeafGather { gather, polygon, centre, budget, .. } = leaf;
        let emitted_by = |sources: Vec<Source>, faint: FaintGroups, sky: SkyView| {
            let blockers = leaf.blockers.clone();
            let alone = LeafGather { gather, polygon, centre, sources, faint, rays: 0, budget, sky, blockers };
            alone.emitted(position, inward, Cosine::Shading).total()
        };
        for source in &leaf.sources {
            let entry = found.entry(Sender::Polygon(source.polygon)).or_default();
            entry.blockers.extend(source.blockers.iter().flatten());
            if self.scene.material(source.polygon).emits() {
                entry.emitted += emitted_by(vec![source.clone()], FaintGroups::default(), SkyView::default());
            }
        }
        let faint = emitted_by(Vec::new(), leaf.faint.clone(), SkyView::default());
        found.entry(Sender::FaintEmitters).or_default().emitted = faint;
        found.entry(Sender::Sky).or_default().emitted =
            emitted_by(Vec::new(), FaintGroups::default(), leaf.sky.clone());
        let mut seen = Vec::new();
        leaf.seen_nodes(position, inward, Cosine::Shading, &mut seen);
        let sender = |seen: &SeenNode| self.solution.elements.polygon_of(seen.node).map(Sender::Polygon);
        for node in &seen {
            found.entry(sender(node).unwrap_or_default()).or_default().reflected += self.irradiance_from(&[*node]);
        }
        let mut contributions: Vec<Contribution> = found
            .into_iter()
            .map(|(sender, contribution)| Contribution { sender, ..contribution })
            .filter(|contribution| contribution.irradiance() != Rgb::ZERO)
            .collect();
        for contribution in &mut contributions {
            contribution.blockers.sort_unstable();
            contribution.blockers.dedup();
        }
        contributions.sort_by(|a, b| luminance(b.irradiance()).total_cmp(&luminance(a.irradiance())));
        contributions
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Builder;
    use crate::{SolveOptions, Surroundings, solve};

    /// A floor, a lamp over it, a plate between the two, and a second, dimmer lamp.
    fn lit_floor() -> Builder {
        let rectangle = |x: f64, z: f64, half: f64, up: bool| {
            let mut corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(u, v)| DVec3::new(x + u * half, v * half, z));
            if !up {
                corners.reverse();
            }
            corners
        };
        Builder::default()
            .material(0.5, 0.0)
            .polygon(&rectangle(0.0, 0.0, 3.0, true))
            .polygon(&rectangle(0.2, 1.0, 0.3, true))
            .polygon(&rectangle(0.2, 1.0, 0.3, false))
            .material(0.0, 10.0)
            .polygon(&rectangle(0.0, 2.0, 0.5, false))
            .material(0.0, 1.0)
            .polygon(&rectangle(2.0, 2.0, 0.5, false))
    }

    #[test]
    fn sources_sum_up_to_the_irradiance_the_strongest_first() {
        let scene = lit_floor().build();
        let solution = solve(&scene, &SolveOptions::default(), &|_| ());
        let surroundings = Surroundings::new(&scene, &solution);
        let gather = Gather::new(&surroundings, &solution);
        for point in [DVec3::new(0.1, 0.2, 0.0), DVec3::new(-1.0, 0.7, 0.0), DVec3::new(1.9, 0.0, 0.0)] {
            let parts = gather.contributions_at(0, point, DVec3::X);
            let whole = gather.irradiance_at(0, point, DVec3::X);
            let sum: Rgb = parts.iter().map(Contribution::irradiance).sum();
            assert!((sum - whole).length() < 1e-9 * whole.length(), "{point}: {sum} {whole}");
            let strengths: Vec<f64> = parts.iter().map(|part| luminance(part.irradiance())).collect();
            assert!(strengths.windows(2).all(|pair| pair[0] >= pair[1]), "{strengths:?}");
            assert!(strengths.iter().all(|&strength| strength > 0.0));
        }
        // Beside the plate's shadow the bright lamp is the first; within, the plate may hide it.
        assert_eq!(gather.contributions_at(0, DVec3::new(-1.0, 0.7, 0.0), DVec3::X)[0].sender, Sender::Polygon(3));
        let parts = gather.contributions_at(0, DVec3::new(0.1, 0.2, 0.0), DVec3::X);
        let lamp = parts.iter().find(|part| part.sender == Sender::Polygon(3)).expect("some of the lamp is seen");
        assert_eq!(lamp.reflected, Rgb::ZERO);
        assert!(lamp.blockers.contains(&1) || lamp.blockers.contains(&2), "{:?}", lamp.blockers);
    }

    /// So many boxes that nothing is linked, under a lamp that is near and a row of faint ones.
    #[test]
    fn sources_sum_up_without_links_too() {
        let mut builder = lit_floor();
        for i in 0..72 {
            let (x, y) = (f64::from(i % 12) * 0.4 - 2.5, 1.0 + f64::from(i / 12) * 0.3);
            builder = builder.material(0.5, if i % 9 == 0 { 1e-4 } else { 0.0 });
            builder = builder.cuboid([x, y, 0.2], [x + 0.1, y + 0.1, 0.3], false);
        }
        let scene = builder.build();
        let solution = solve(&scene, &SolveOptions::default(), &|_| ());
        assert_eq!(solution.visibility, crate::Visibility::Rays);
        let surroundings = Surroundings::new(&scene, &solution);
        let gather = Gather::new(&surroundings, &solution);
        for point in [DVec3::new(0.1, 0.2, 0.0), DVec3::new(-1.0, -0.7, 0.0)] {
            let parts = gather.contributions_at(0, point, DVec3::X);
            let whole = gather.irradiance_at(0, point, DVec3::X);
            let sum: Rgb = parts.iter().map(Contribution::irradiance).sum();
            assert!((sum - whole).length() < 1e-9 * whole.length(), "{point}: {sum} {whole}");
            assert!(parts.len() > 1, "{parts:?}");
        }
    }
}
