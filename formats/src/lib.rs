//! Bytes ↔ the types of `scene`: scene files, bakes, images and tables of points.
//!
//! Reading trusts nothing and panics on no input; every error names the file, the place, the cause and the cure.
//! Every file is written under a temporary name and renamed, so that none is ever half there.

mod atomic_file;
mod attributes;
mod baked_file;
mod camera;
mod camera_path_file;
mod convex;
mod environment_entry;
mod environment_file;
mod error;
mod face;
mod face_count;
mod gltf;
mod gltf_buffers;
mod gltf_materials;
mod image_file;
mod import;
mod material_library;
mod merge;
mod model;
mod obj;
mod obj_text;
mod points_csv;
mod record;
mod repair;
mod report;
mod scene_file;
mod texture_file;
mod toml_text;
mod unfinished;

pub use atomic_file::write_atomically;
pub use baked_file::{is_baked, read_baked, read_unfinished, write_baked, write_unfinished};
pub use camera_path_file::{read_camera_path, write_camera_path};
pub use environment_file::{EnvironmentMap, read_environment};
pub use error::FormatError;
pub use face_count::count_faces;
pub use image_file::{read_exr, read_png, write_exr, write_png};
pub use import::{Imported, Sides, read_scene, read_scene_as};
pub use points_csv::{SurfaceQuery, read_points, write_irradiance};
pub use report::ImportReport;
