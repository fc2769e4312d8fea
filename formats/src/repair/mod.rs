//! Repairs that need to know neighbours, and what tells whether surfaces face the right way.

mod edges;
mod evidence;
mod junction;
mod point_tree;
mod sides;
mod winding;

pub(crate) use evidence::warn_of_winding;
pub(crate) use junction::close_junctions;
pub(crate) use sides::add_other_sides;
pub(crate) use winding::orient;
