//! Scenes made by rule, at any size: what growth is measured on, and what nobody has to draw.
//!
//! The same size gives the same scene, byte for byte. All are closed, lit from the inside, wound counter-clockwise seen
//! from the front, without faces that overlap in one plane; faces that stand on another are left out.

#![allow(dead_code, reason = "each bench, test and example uses its part")]

mod hall;
mod modeller;
mod rooms;
mod wavefront;

pub use hall::hall;
pub use rooms::rooms;
pub use wavefront::{mtl, obj};
