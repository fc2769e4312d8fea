//! Light arriving anywhere: hierarchical radiosity over a scene's polygons, and exact irradiance at a point.
//!
//! The pipeline is [`solve`]: cut → refine (elements, links, blockers) → transport. What it returns,
//! a [`Solution`], feeds [`Gather`], which answers with the irradiance at any surface point.

mod backprojection;
mod blocker;
mod bounding_cone;
mod clip;
mod contact;
mod contour;
mod contribution;
mod cut;
mod element;
mod emitter;
mod form_factor;
mod geometry;
mod irradiance;
mod lamp_rays;
mod lattice;
mod leaf_gather;
mod light_tree;
mod linear_fit;
mod openings;
mod oracle;
mod outlook;
mod patch_tree;
mod polygon_tree;
mod principal_axes;
mod quadrature;
mod ray_gather;
mod refine;
mod seen_node;
mod shafts;
mod sky_cells;
mod sky_view;
mod solid;
mod solution;
mod solve;
mod surroundings;
#[cfg(test)]
mod testing;
mod transport;
mod validate;
mod visibility;

pub use contact::Contact;
pub use contribution::{Contribution, Sender};
pub use cut::{contact_lines, cut_polygon};
pub use element::{Elements, Node, NodeId, NodeKind, Patch};
pub use form_factor::{exchange, form_factor, form_factor_at, point_form_factor};
pub use irradiance::{Cosine, Gather};
pub use lattice::{Fan, hemisphere, spread};
pub use leaf_gather::{DirectIrradiance, LeafGather};
pub use linear_fit::colour_slope;
pub use openings::{Openings, SeenCell};
pub use outlook::{FirstLook, Outlook, first_look};
pub use principal_axes::{LinearLight, PrincipalAxes};
pub use ray_gather::SMALL_LEAF;
pub use seen_node::SeenNode;
pub use shafts::Shafts;
pub use sky_cells::{SkyCell, SkyCells};
pub use solution::{
    BlockerLists, Convergence, Cut, ElementLight, Interaction, Link, LinkSource, Solution, SolveOptions, Visibility,
};
pub use solve::solve;
pub use surroundings::Surroundings;
pub use validate::Validation;
