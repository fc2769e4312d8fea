//! The flags that say where a picture is taken from.

use anyhow::{Result, bail};
use clap::Args;
use glam::DVec3;
use scene::Camera;

use super::values::{opening_angle, vector};
use crate::failure::Usage;

/// Where a picture is taken from: nothing (the scene's first camera, or one that sees the whole scene), a camera
/// of the scene by name, or a free one.
#[derive(Clone, Debug, Default, Args)]
pub struct CameraFlags {
    /// A camera of the scene, by name
    #[arg(long, value_name = "NAME", conflicts_with_all = ["eye", "target", "up", "fov"])]
    pub camera: Option<String>,
    /// Position of the eye, metres
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, requires = "target", allow_hyphen_values = true)]
    pub eye: Option<DVec3>,
    /// A point in the middle of the picture, metres
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, requires = "eye", allow_hyphen_values = true)]
    pub target: Option<DVec3>,
    /// A direction that points up in the picture [default: 0,0,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, requires = "eye", allow_hyphen_values = true)]
    pub up: Option<DVec3>,
    /// Full vertical opening angle, degrees, between 0 and 180 [default: 60]
    #[arg(long, value_name = "DEG", value_parser = opening_angle, requires = "eye", allow_hyphen_values = true)]
    pub fov: Option<f64>,
}

/// The point of view that the camera flags ask for.
#[derive(Clone, Debug, PartialEq)]
pub enum Viewpoint {
    /// The scene's first camera.
    Default,
    /// A camera of the scene.
    Named(String),
    /// A camera of the user's own.
    Free(Camera),
}

impl CameraFlags {
    /// Checks that the four flags of a free camera make one.
    pub fn viewpoint(&self) -> Result<Viewpoint> {
        if let Some(name) = &self.camera {
            return Ok(Viewpoint::Named(name.clone()));
        }
        let (Some(eye), Some(target)) = (self.eye, self.target) else { return Ok(Viewpoint::Default) };
        if eye == target {
            bail!(Usage("--eye and --target are the same point: move one, so that the view has a direction".into()));
        }
        let up = self.up.unwrap_or(DVec3::Z);
        let camera = Camera { eye, target, up, vertical_fov: self.fov.unwrap_or(60.0).to_radians() };
        if !camera.is_valid() {
            bail!(Usage(format!(
                "--up {},{},{} is zero or parallel to the view from --eye to --target: give one across it, such as \
                 --up 0,1,0",
                up.x, up.y, up.z
            )));
        }
        Ok(Viewpoint::Free(camera))
    }
}
