//! From a radiosity solution to a mesh of interpolants.

mod arrangement;
mod bake;
mod claimed_error;
mod coarse_mesh;
mod critical_surface;
mod discontinuity;
mod edge_table;
mod facet;
mod fine_mesh;
mod forecast;
mod frame;
mod guess;
mod horizon;
mod inquiry;
mod interval;
mod leaf_error;
mod leaf_mesh;
mod lines;
mod memory;
mod probe;
mod projection;
mod radiosity;
mod ranking;
mod refinement;
mod reflected_light;
mod residual;
mod rounds;
mod samples;
mod snapshot;
mod stand_ins;
#[cfg(test)]
mod testing;
mod weight;

pub use bake::{Bake, BakeOptions, BakeStatistics, Control, bake, resume};
pub use critical_surface::GrazingRay;
pub use discontinuity::{Discontinuity, discontinuities};
pub use edge_table::{EdgeTable, Leaf, LeafSegment, edge_table};
pub use leaf_mesh::{Mesh, MeshStatistics, MeshTriangle, leaf_meshes};
pub use ranking::{RankedLine, rank};
pub use samples::{Progress, SampleQuery, SampleTable, sample_table};
pub use snapshot::flat_bake;
pub use weight::{Sweep, Weight};
