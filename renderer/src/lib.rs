//! Images and references from rays. For now the reference: an unbiased path tracer that shares nothing with the
//! solver or the mesher, so that what it says of a bake is an independent opinion.

mod emitters;
mod path_trace;
mod reference;
mod sequence;
mod spherical_triangle;
mod surface;

pub use path_trace::{Estimate, PathOptions, irradiance, irradiance_on};
pub use reference::{Reference, ReferenceOptions, reference};
pub use surface::{SurfacePoint, spread_by_area};
