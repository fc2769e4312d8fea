//! Points on the surfaces of a scene: how a path goes from one to the next, and how to spread many by area.

use glam::DVec3;
use scene::{Bvh, Plane, Ray, Scene, ShearedRay, other_sides};

use crate::sequence::{Kronecker, Stream};

/// Several f64 roundings of a point, as a fraction of the scene's size: a point this near to a plane is in it.
const ROUNDING: f64 = 1e-12;

/// The sine of the angle up to which two planes are parallel, above the rounding of their normals.
const PARALLEL: f64 = 1e-9;

/// How far, as a fraction of the scene's size, a given point may be from a polygon that it is meant to lie on: files
/// often carry seven digits. A point farther off is taken as one in empty space.
const REACH: f64 = 1e-6;

/// A point on the front of a polygon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position in the polygon's plane, metres.
    pub position: DVec3,
    /// Unit normal, to the front.
    pub normal: DVec3,
    /// The polygon.
    pub polygon: u32,
}

/// A point that gathers light: on a polygon, or with none under it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    pub position: DVec3,
    /// Only what is above the plane of this normal arrives.
    pub normal: DVec3,
    /// The normal that the cosine is to: at the point looked at the shading normal, if it has one.
    pub cosine: DVec3,
    pub polygon: Option<u32>,
}

impl From<SurfacePoint> for Receiver {
    /// The point as one that passes light on.
    fn from(point: SurfacePoint) -> Self {
        Self { position: point.position, normal: point.normal, cosine: point.normal, polygon: Some(point.polygon) }
    }
}

impl Receiver {
    /// The cosine by which light from a unit direction counts; 0 from below the plane, too.
    pub fn cosine_to(&self, direction: DVec3) -> f64 {
        if self.normal.dot(direction) > 0.0 { self.cosine.dot(direction).max(0.0) } else { 0.0 }
    }
}

/// What a receiver sees in a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Seen {
    /// Nothing: the ray leaves the scene.
    Nothing,
    /// The back of a surface, which is black.
    Back,
    /// The front of a surface.
    Front(SurfacePoint),
}

/// The surfaces of a scene, as paths need them.
pub(crate) struct Surfaces<'a> {
    pub scene: &'a Scene,
    pub bvh: &'a Bvh,
    planes: Vec<Plane>,
    /// The polygon that has the same corners and the opposite front, if any: the other side of a two-sided surface.
    other_sides: Vec<Option<u32>>,
    /// Lengths up to this are rounding, metres.
    pub rounding: f64,
    /// Middle of the scene's box, metres.
    middle: DVec3,
    /// Length of the diagonal of that box, metres.
    pub size: f64,
}

impl<'a> Surfaces<'a> {
    pub fn new(scene: &'a Scene, bvh: &'a Bvh) -> Self {
        let planes: Vec<_> = scene.polygon_ids().map(|polygon| scene.plane(polygon)).collect();
        let (low, high) = scene.bounds();
        let size = (high - low).length();
        let (rounding, middle) = (ROUNDING * size, (low + high) / 2.0);
        Self { scene, bvh, planes, other_sides: other_sides(scene), rounding, middle, size }
    }

    pub fn plane(&self, polygon: u32) -> Plane {
        self.planes[polygon as usize]
    }

    /// A point as one that is looked at.
    pub fn looked_at(&self, point: &SurfacePoint) -> Receiver {
        let cosine = self.scene.shading_normal(point.polygon, point.position).unwrap_or(point.normal);
        Receiver { cosine, ..(*point).into() }
    }

    /// Whether a receiver lies on a polygon, on the other side of it, or in its very plane.
    pub fn is_on(&self, receiver: &Receiver, polygon: u32) -> bool {
        receiver.polygon.is_some_and(|own| self.is_same_surface(own, polygon)) || self.is_in_plane(receiver, polygon)
    }

    /// Whether a receiver's plane is that of a polygon, as where two faces lie against each other. What lies in the plane takes up
    /// nothing of what is above it, and whether a ray would meet it is up to rounding.
    fn is_in_plane(&self, receiver: &Receiver, polygon: u32) -> bool {
        let plane = self.plane(polygon);
        plane.distance(receiver.position).abs() <= self.rounding
            && plane.normal.cross(receiver.normal).length_squared() <= PARALLEL * PARALLEL
    }

    fn is_same_surface(&self, a: u32, b: u32) -> bool {
        a == b || self.other_sides[a as usize] == Some(b)
    }

    /// Whether anything stands between a receiver and a point on a polygon.
    pub fn is_blocked(&self, receiver: &Receiver, target: DVec3, polygon: u32) -> bool {
        let between = |id| !self.is_on(receiver, id) && !self.is_same_surface(polygon, id);
        self.bvh.is_blocked_among(receiver.position, target, between)
    }

    /// The receiver that is looked at at a given place: on the nearest polygon within [`REACH`] whose front agrees with the
    /// normal, in its plane, or in empty space.
    pub fn receiver_at(&self, position: DVec3, normal: DVec3) -> Receiver {
        let normal = normal.normalize_or_zero();
        match self.bvh.nearest_surface(position, normal, REACH * self.size) {
            None => Receiver { position, normal, cosine: normal, polygon: None },
            Some(hit) => {
                let plane = self.plane(hit.id);
                let position = position - plane.normal * plane.distance(position);
                self.looked_at(&SurfacePoint { position, normal: plane.normal, polygon: hit.id })
            }
        }
    }

    /// The polygon that a ray meets on its front: the one that it hits, or that one's other side. None if it meets a black back.
    pub fn facing(&self, hit: u32, direction: DVec3) -> Option<u32> {
        if self.plane(hit).normal.dot(direction) < 0.0 { Some(hit) } else { self.other_sides[hit as usize] }
    }

    /// Whether a receiver sees nothing in a unit direction, however far it looks.
    pub fn sees_sky(&self, receiver: &Receiver, direction: DVec3) -> bool {
        // Farther than from the receiver to any corner of the scene's box.
        let far = (receiver.position - self.middle).length() + self.size;
        let stands = |id| !self.is_on(receiver, id);
        !self.bvh.is_blocked_among(receiver.position, receiver.position + direction * far, stands)
    }

    /// Whether a polygon crosses a ray before its length.
    pub fn crosses(&self, polygon: u32, ray: &Ray) -> bool {
        let sheared = ShearedRay::new(ray);
        let corners = &self.scene.corners[self.scene.polygons[polygon as usize].corner_range()];
        let at = |i: usize| self.scene.vertices[corners[i] as usize];
        let hits =
            |i: usize| sheared.intersect(&[at(0), at(i - 1), at(i)]).is_some_and(|(distance, ..)| distance < 1.0);
        (2..corners.len()).any(hits)
    }

    /// What a receiver sees in a direction.
    ///
    /// No offset along the ray keeps it off its own surface, since that would see through a contact: a convex polygon
    /// cannot see itself, so hits on the receiver's own polygon are passed over by name.
    pub fn seen_from(&self, receiver: &Receiver, direction: DVec3) -> Seen {
        let ray = Ray { origin: receiver.position, direction };
        let Some(hit) = self.bvh.closest_hit_among(&ray, |id| !self.is_on(receiver, id)) else { return Seen::Nothing };
        let Some(polygon) = self.facing(hit.id, direction) else { return Seen::Back };
        let plane = self.plane(polygon);
        let position = ray.at(hit.distance);
        let position = position - plane.normal * plane.distance(position);
        Seen::Front(SurfacePoint { position, normal: plane.normal, polygon })
    }
}

/// Distance in its plane from a point to the border of a polygon, metres; negative outside.
fn border_distance(scene: &Scene, polygon: u32, point: DVec3) -> f64 {
    let outline = scene.outline(polygon);
    let normal = scene.plane(polygon).normal;
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    edges
        .filter_map(|(&from, &to)| Some(normal.cross((to - from).try_normalize()?).dot(point - from)))
        .fold(f64::INFINITY, f64::min)
}

/// Spreads points evenly by area over the fronts of the polygons that `wanted` accepts, none nearer than `border`
/// metres to an edge of its polygon. Points lie exactly in the plane of an axis-parallel polygon, and come in the
/// order of polygons. Fewer than `count` come back only where all of a polygon is border.
pub fn spread_by_area(
    scene: &Scene,
    count: u32,
    border: f64,
    seed: u64,
    wanted: impl Fn(u32) -> bool,
) -> Vec<SurfacePoint> {
    /// Places tried for a point before its stratum counts as all border.
    const TRIES: u32 = 100;
    let mut triangles = Vec::new();
    let mut total = 0.0;
    for polygon in scene.polygon_ids().filter(|&polygon| wanted(polygon)) {
        let outline = scene.outline(polygon);
        for pair in outline[1..].windows(2) {
            let sides = [pair[0] - outline[0], pair[1] - outline[0]];
            total += sides[0].cross(sides[1]).length() / 2.0;
            triangles.push((total, polygon, outline[0], sides));
        }
    }
    let mut stream = Stream::new(seed, 0);
    let mut across = Kronecker::<1>::shifted_by(&mut stream);
    let mut points = Vec::with_capacity(count as usize);
    for i in 0..count {
        for _ in 0..TRIES {
            let area = (f64::from(i) + stream.uniform()) / f64::from(count) * total;
            let index = triangles.partition_point(|triangle| triangle.0 <= area);
            let Some(&(end, polygon, origin, sides)) = triangles.get(index) else { continue };
            let start = if index == 0 { 0.0 } else { triangles[index - 1].0 };
            // The share of the triangle's area passed so far sweeps a line from a corner to the opposite side.
            let sweep = ((area - start) / (end - start)).sqrt();
            let [along] = across.point();
            let position = origin + sides[0] * (sweep * (1.0 - along)) + sides[1] * (sweep * along);
            if border_distance(scene, polygon, position) > border {
                points.push(SurfacePoint { position, normal: scene.plane(polygon).normal, polygon });
                break;
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::path_trace::test_scenes::{black, scene_of};

    fn square(z: f64) -> Vec<DVec3> {
        [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, z)).to_vec()
    }

    #[test]
    fn nothing_to_spread_over_gives_no_points() {
        assert_eq!(spread_by_area(&Scene::default(), 10, 0.0, 1, |_| true), vec![]);
        let scene = scene_of(&[(square(0.0), black())]);
        assert_eq!(spread_by_area(&scene, 10, 0.0, 1, |_| false), vec![]);
        assert_eq!(spread_by_area(&scene, 10, 0.6, 1, |_| true), vec![], "all of it is nearer than 0.6 to an edge");
    }

    #[test]
    fn points_are_spread_by_area_and_off_the_border() {
        let wide = square(2.5).iter().map(|p| DVec3::new(3.0 * p.x, p.y, p.z)).collect();
        let scene = scene_of(&[(square(0.1), black()), (wide, black())]);
        let points = spread_by_area(&scene, 400, 1e-3, 1, |_| true);
        assert_eq!(points.len(), 400);
        assert_eq!(points.iter().filter(|point| point.polygon == 0).count(), 100);
        for point in &points {
            assert_eq!(point.position.z.to_bits(), [0.1_f64, 2.5][point.polygon as usize].to_bits());
            assert!(border_distance(&scene, point.polygon, point.position) > 1e-3);
        }
        let on_wide = points.iter().filter(|point| point.polygon == 1);
        let left = on_wide.filter(|point| point.position.x < 1.5).count();
        assert!(left.abs_diff(150) <= 6, "{left} of 300 in the left half");
    }

    #[test]
    fn a_point_with_few_digits_is_put_back_on_its_polygon() {
        let scene = scene_of(&[(square(0.123456789), black())]);
        let bvh = Bvh::of_scene(&scene);
        let surfaces = Surfaces::new(&scene, &bvh);
        let near = surfaces.receiver_at(DVec3::new(0.5, 0.5, 0.1234568), DVec3::Z * 2.0);
        assert_eq!((near.polygon, near.position.z), (Some(0), 0.123456789));
        assert_eq!(surfaces.receiver_at(DVec3::new(0.5, 0.5, 0.1234568), -DVec3::Z).polygon, None);
        assert_eq!(surfaces.receiver_at(DVec3::new(0.5, 0.5, 0.1235), DVec3::Z).polygon, None);
        assert_eq!(surfaces.receiver_at(DVec3::new(1.5, 0.5, 0.1234568), DVec3::Z).polygon, None);
    }

    /// A box stands on a tilted floor in whose plane its bottom lies. A point of the floor below it sees the lid, whatever the
    /// direction: whether a ray met the bottom would be a matter of rounding.
    #[test]
    fn what_lies_in_the_plane_of_a_point_hides_nothing_from_it() {
        let tilt = DQuat::from_rotation_x(0.3) * DQuat::from_rotation_y(0.2);
        let tilted = |outline: &[DVec3]| outline.iter().map(|&corner| tilt * corner).collect::<Vec<_>>();
        let underside = |z| tilted(&square(z).into_iter().rev().collect::<Vec<_>>());
        let floor = tilted(&square(0.1).iter().map(|corner| corner * 3.0).collect::<Vec<_>>());
        let scene = scene_of(&[(floor, black()), (underside(0.3), black()), (underside(9.0), black())]);
        let bvh = Bvh::of_scene(&scene);
        let surfaces = Surfaces::new(&scene, &bvh);
        for point in spread_by_area(&scene, 300, 0.1, 1, |polygon| polygon == 1) {
            let point = SurfacePoint { normal: -point.normal, polygon: 0, ..point };
            let floor = surfaces.looked_at(&point);
            let lid = surfaces.seen_from(&floor, point.normal);
            assert!(matches!(lid, Seen::Front(lid) if lid.polygon == 2), "{point:?}: {lid:?}");
            // From a little below, the bottom is what is seen.
            let below = Receiver { position: point.position - point.normal * 1e-6, ..floor };
            assert!(matches!(surfaces.seen_from(&below, point.normal), Seen::Front(seen) if seen.polygon == 1));
        }
    }

    #[test]
    fn both_sides_of_a_doubled_polygon_are_seen() {
        let back: Vec<_> = square(1.0).into_iter().rev().collect();
        let scene = scene_of(&[(square(0.0), black()), (square(1.0), black()), (back, black())]);
        let bvh = Bvh::of_scene(&scene);
        let surfaces = Surfaces::new(&scene, &bvh);
        let floor = surfaces.receiver_at(DVec3::new(0.4, 0.3, 0.0), DVec3::Z);
        let seen = surfaces.seen_from(&floor, DVec3::new(0.1, 0.2, 1.0).normalize());
        assert!(matches!(seen, Seen::Front(point) if point.polygon == 2), "the underside");
        // From the upper side nothing is in the way, not even the lower one.
        let top = surfaces.receiver_at(DVec3::new(0.4, 0.3, 1.0), DVec3::Z);
        assert_eq!(top.polygon, Some(1));
        assert_eq!(surfaces.seen_from(&top, DVec3::Z), Seen::Nothing);
        assert!(surfaces.sees_sky(&top, DVec3::Z) && !surfaces.sees_sky(&floor, DVec3::Z));
    }
}
