//! What a scene, a camera and a bake *are*, and what a ray meets.
//!
//! The shared vocabulary of Halflight: plain data that every other crate reads, and nothing of theirs.
//! Lengths are metres, angles radians, radiance W·sr⁻¹·m⁻², irradiance, exitance and radiosity W·m⁻²,
//! colours linear RGB.

mod baked;
mod bvh;
mod camera;
mod camera_path;
mod cie_sky;
mod environment;
mod exposure;
mod half_edge;
mod interpolant;
mod light;
mod map_reduction;
mod material;
mod polygon;
mod ray;
mod rgb;
mod scene;
mod shading;
mod texture;
mod texture_map;
mod unfinished;
mod weld;
mod wide_tree;

pub use baked::{
    Baked, BakedElement, BakedError, BakedTriangle, DiscontinuityLine, EdgeKind, LineKind, Provenance, SKY,
};
pub use bvh::{Bvh, Hit};
pub use camera::{Camera, NamedCamera};
pub use camera_path::{CameraKey, CameraPath, CameraPathError};
pub use cie_sky::{CIE_SKIES, CieSky};
pub use environment::{Environment, LatLongMap, SUN_RADIUS, Sky, UpAxis, texel_solid_angle};
pub use exposure::{Display, Exposure, MIDDLE_GREY, ToneCurve, decode_srgb, encode_srgb};
pub use half_edge::{HalfEdges, NO_TWIN};
pub use interpolant::{Interpolant, SAMPLE_BARYCENTRICS};
pub use light::Light;
pub use material::{Gloss, Material};
pub use polygon::{Plane, Polygon, area_vector, centroid, is_convex};
pub use ray::{Ray, ShearedRay};
pub use rgb::{LUMINOUS_EFFICACY, Rgb, luminance};
pub use scene::{LARGEST_COORDINATE, Scene, SceneError, other_sides};
pub use texture::Texture;
pub use texture_map::TextureMap;
pub use unfinished::{Answers, Rows, Seen, Unfinished};
pub use weld::Welder;
