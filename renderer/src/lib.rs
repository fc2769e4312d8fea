//! Images and references from rays.
//!
//! The reference is an unbiased path tracer that shares nothing with the solver or the mesher, so that what it says of a bake is an
//! independent opinion. Images are made by samplers, which know nothing of where light comes from: they are handed a function
//! from a point of the image plane to what is seen there ([`Evaluator`]), and a [`Film`] makes a picture of their samples.

mod adaptive;
mod block;
mod cell;
mod coherence_map;
mod coherence_picture;
mod coherence_step;
mod coherent_visibility;
mod confidence;
mod delaunay;
mod emitters;
mod environment_lights;
mod evaluation;
mod evaluation_order;
mod eye;
mod film;
mod filter;
mod irradiance_fit;
mod kd_tree;
mod kollig_keller;
mod light_set;
mod line_grid;
mod lobe;
mod oriented_element;
mod path_trace;
mod pixel_integral;
mod quadratic_patch;
mod raster;
mod reduction;
mod reference;
mod reflected_lines;
mod sample_map;
mod scattered;
mod sequence;
mod simplicity;
mod sky_light;
mod sky_picture;
mod sky_pieces;
mod sky_table;
mod spherical_triangle;
mod structured_sampling;
mod surface;
mod survey;
#[cfg(test)]
mod test_pictures;
mod uniform;
mod visible_lines;
mod voronoi;
mod whitted;
mod work_image;

pub use adaptive::{AdaptiveOptions, AdaptiveSampler};
pub use cell::MOST_PIXELS;
pub use coherence_map::{CoherenceMap, CoherenceOptions};
pub use coherent_visibility::{Borders, Coherence, EvaluationOrder, Flooding, Visibility};
pub use confidence::Interval;
pub use environment_lights::{EnvironmentLights, SkySampling};
pub use evaluation::{Evaluation, Evaluator};
pub use eye::{Eye, SeenPoint, Sight};
pub use film::{Film, Tile};
pub use filter::Filter;
pub use path_trace::{Estimate, PathLight, PathOptions, irradiance, irradiance_on};
pub use pixel_integral::PixelIntegral;
pub use reference::{Reference, ReferenceOptions, reference};
pub use reflected_lines::reflected_lines;
pub use sample_map::{WHITE_SAMPLES, sample_histogram, sample_map};
pub use scattered::{ScatteredFilm, Surface};
pub use sky_picture::{SkyIllumination, SkyPicture, SkySeconds, sky_picture};
pub use surface::{SurfacePoint, spread_by_area};
pub use survey::Rule;
pub use uniform::UniformSampler;
pub use visible_lines::{VisibleLine, object_edges, visible_lines};
pub use voronoi::Voronoi;
pub use whitted::{DirectLight, Whitted};
