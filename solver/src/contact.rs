//! How other polygons touch a point: on their lines irradiance has a value for each side, at their corners one for each direction.

use glam::DVec3;

use crate::clip::{Position, locate};
use crate::{Cosine, Gather};

/// How other polygons touch a point of a polygon: how many values irradiance has there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contact {
    /// Nothing touches: one value.
    None,
    /// Contact along one line through the point, with its unit direction: one value for each side.
    Line {
        /// Unit direction of the line.
        direction: DVec3,
    },
    /// Contact ends or turns here: the value depends on the direction that the point is approached from.
    Corner,
}

impl Gather<'_> {
    /// How other polygons touch a point of a polygon, on its front.
    pub fn contact(&self, polygon: u32, position: DVec3) -> Contact {
        let from = self.viewpoint(polygon, position, DVec3::ZERO, Cosine::Own);
        let up = from.up;
        let mut line: Option<DVec3> = None;
        for other in self.tree.near(position, self.geometry.contact_tolerance) {
            let plane = self.geometry.plane(other);
            let across = up.cross(plane.normal);
            if plane.distance(position).abs() > self.geometry.contact_tolerance || across.length_squared() < 1e-18 {
                continue;
            }
            let outline = self.geometry.outline(other);
            if !from.may_meet(outline) {
                continue;
            }
            let direction = match locate(outline, plane.normal, position, self.geometry.contact_tolerance) {
                Position::Outside => continue,
                Position::Interior => across.normalize(),
                Position::Edge(i) => {
                    let edge = (outline[(i + 1) % outline.len()] - outline[i]).normalize();
                    if edge.dot(up).abs() > 1e-9 {
                        return Contact::Corner;
                    }
                    if plane.normal.cross(edge).dot(up) < 0.0 {
                        continue; // It hangs below the horizon.
                    }
                    edge
                }
                Position::Corner(i) => {
                    let count = outline.len();
                    let leaving = (outline[(i + 1) % count] - outline[i]).normalize();
                    let arriving = (outline[(i + count - 1) % count] - outline[i]).normalize();
                    if leaving.dot(up) <= 1e-9 && arriving.dot(up) <= 1e-9 {
                        let straight = leaving.dot(arriving) < -1.0 + 1e-12;
                        if !straight || plane.normal.cross(leaving).dot(up) < 0.0 {
                            continue;
                        }
                        leaving
                    } else {
                        return Contact::Corner;
                    }
                }
            };
            match line {
                Some(first) if first.cross(direction).length_squared() > 1e-12 => return Contact::Corner,
                _ => line = Some(direction),
            }
        }
        line.map_or(Contact::None, |direction| Contact::Line { direction })
    }
}
