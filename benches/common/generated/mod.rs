//! Scenes made by rule, at any size: what growth is measured on, and what nobody has to draw.
//!
//! The same size gives the same scene, byte for byte. All are wound counter-clockwise seen from the front, without faces that
//! overlap in one plane; faces that stand on another are left out. Hall, rooms and looking glass are closed and lit from the
//! inside; shapes, dominoes and plant stand on a floor under the sky, tori in a room under lights without a surface.

#![allow(dead_code, reason = "each bench, test and example uses its part")]

mod dominoes;
mod hall;
mod looking_glass;
mod modeller;
mod plant;
mod rooms;
mod shapes;
mod tori;
mod wavefront;

pub use dominoes::dominoes;
pub use hall::hall;
pub use looking_glass::looking_glass;
pub use plant::plant;
pub use rooms::rooms;
pub use shapes::shapes;
pub use tori::tori;
pub use wavefront::{mtl, obj};
