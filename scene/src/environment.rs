//! Light from far away, by its direction: a picture of all that is around, or a sky by the standard.
//!
//! A direction is a place in a picture whose columns are azimuths and whose rows are heights: u from 0 to 1 goes clockwise,
//! seen from above, from south by west, north and east to south again; v from 0 at the zenith to 1 at the nadir. North is in
//! the middle.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::{CieSky, Rgb};

/// Angular radius of the sun's disc, radians: half of 0.533°, the mean over a year. Its radiance is even over the disc.
pub const SUN_RADIUS: f64 = 0.533 / 2.0 * PI / 180.0;

/// The axis of the scene that points up in an environment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum UpAxis {
    /// East is y, north z.
    X,
    /// East is x, north −z.
    Y,
    /// East is x, north y.
    #[default]
    Z,
}

impl UpAxis {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// Unit vectors to the east, to the north and up.
    fn basis(self) -> [DVec3; 3] {
        match self {
            Self::X => [DVec3::Y, DVec3::Z, DVec3::X],
            Self::Y => [DVec3::X, DVec3::NEG_Z, DVec3::Y],
            Self::Z => [DVec3::X, DVec3::Y, DVec3::Z],
        }
    }
}

/// A picture of all directions, row by row from the zenith.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatLongMap {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance, W·sr⁻¹·m⁻², `width` × `height` of them, finite and not negative; the same all over a texel.
    pub texels: Vec<Vec3>,
}

/// Where an environment has its light from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Sky {
    /// A picture.
    Map(LatLongMap),
    /// A sky of the standard, whose zenith has a radiance of 1 W·sr⁻¹·m⁻².
    Cie(CieSky),
}

/// Light that arrives from all directions, the same at every place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// The light itself.
    pub sky: Sky,
    /// What points up.
    pub up: UpAxis,
    /// How far all is turned clockwise, seen from above, radians.
    pub rotation: f64,
    /// What all light is multiplied by.
    pub scale: f64,
}

impl Environment {
    /// Whether every number is finite and in its range, and a map has as many texels as it says.
    pub fn is_valid(&self) -> bool {
        let is_sky = match &self.sky {
            Sky::Map(LatLongMap { width, height, texels }) => {
                let sound = |texel: &Vec3| texel.is_finite() && texel.min_element() >= 0.0;
                u64::from(*width) * u64::from(*height) == texels.len() as u64
                    && !texels.is_empty()
                    && texels.iter().all(sound)
            }
            Sky::Cie(sky) => sky.is_valid(),
        };
        is_sky && self.rotation.is_finite() && self.scale.is_finite() && self.scale >= 0.0
    }

    /// Whether no light comes from anywhere.
    pub fn is_black(&self) -> bool {
        let is_black = match &self.sky {
            Sky::Map(map) => map.texels.iter().all(|texel| *texel == Vec3::ZERO),
            Sky::Cie(_) => false,
        };
        is_black || self.scale == 0.0
    }

    /// The unit direction of a place in the picture.
    pub fn direction(&self, u: f64, v: f64) -> DVec3 {
        let azimuth = (u - 0.5) * TAU + self.rotation;
        let (sin, cos) = (v * PI).sin_cos();
        let [east, north, up] = self.up.basis();
        (east * azimuth.sin() + north * azimuth.cos()) * sin + up * cos
    }

    /// The place in the picture of a direction of any length but 0: u in 0..1, v in 0..=1.
    pub fn place(&self, direction: DVec3) -> (f64, f64) {
        let [east, north, up] = self.up.basis();
        let (x, y) = (direction.dot(east), direction.dot(north));
        let u = (x.atan2(y) - self.rotation) / TAU + 0.5;
        let v = x.hypot(y).atan2(direction.dot(up)) / PI;
        // A hair below a whole turn rounds to one.
        (u.rem_euclid(1.0).min(1.0 - f64::EPSILON), v)
    }

    /// Radiance from a place in the picture, W·sr⁻¹·m⁻²; without the sun itself of a sky by the standard.
    pub fn radiance_at(&self, u: f64, v: f64) -> Rgb {
        let radiance = match &self.sky {
            Sky::Map(map) => {
                let cell = |at: f64, cells: u32| ((at * f64::from(cells)) as u32).min(cells - 1) as usize;
                map.texels[cell(v, map.height) * map.width as usize + cell(u, map.width)].as_dvec3()
            }
            Sky::Cie(sky) => Rgb::splat(sky.relative_radiance((u - 0.5) * TAU, FRAC_PI_2 - v * PI)),
        };
        radiance * self.scale
    }

    /// Radiance from a direction of any length but 0, W·sr⁻¹·m⁻²; without the sun itself of a sky by the standard.
    pub fn radiance(&self, direction: DVec3) -> Rgb {
        let (u, v) = self.place(direction);
        self.radiance_at(u, v)
    }

    /// Radiance that an eye sees in a direction of any length but 0, W·sr⁻¹·m⁻²: the sky, and before it the disc of the sun.
    pub fn seen(&self, direction: DVec3) -> Rgb {
        let sky = self.radiance(direction);
        match self.sun() {
            Some((to_sun, irradiance)) if to_sun.dot(direction.normalize_or_zero()) > SUN_RADIUS.cos() => {
                sky + irradiance / (PI * SUN_RADIUS.sin().powi(2))
            }
            _ => sky,
        }
    }

    /// The sun itself: the unit direction to it, and what it sends to a surface that faces it, W·m⁻². None where there is no sun
    /// beside the sky.
    pub fn sun(&self) -> Option<(DVec3, Rgb)> {
        let Sky::Cie(sky) = &self.sky else { return None };
        let ([azimuth, altitude], irradiance) = (sky.sun(), sky.sun_irradiance() * self.scale);
        let direction = || self.direction(azimuth / TAU + 0.5, 0.5 - altitude / PI);
        (irradiance > 0.0).then(|| (direction(), Rgb::splat(irradiance)))
    }
}

/// Solid angle of a texel in a row of a picture of all directions, sr.
pub fn texel_solid_angle(width: u32, height: u32, row: u32) -> f64 {
    let edge = |row: u32| (PI * f64::from(row) / f64::from(height)).cos();
    TAU / f64::from(width) * (edge(row) - edge(row + 1))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn map(width: u32, height: u32) -> Environment {
        let texels = (0..width * height).map(|i| Vec3::splat(i as f32)).collect();
        let sky = Sky::Map(LatLongMap { width, height, texels });
        Environment { sky, up: UpAxis::Z, rotation: 0.0, scale: 1.0 }
    }

    #[test]
    fn north_is_in_the_middle_and_east_right_of_it() {
        for up in UpAxis::ALL {
            let environment = Environment { up, ..map(4, 2) };
            let [east, north, zenith] = up.basis();
            assert_eq!(east.cross(north), zenith, "{}", up.name());
            for (place, expected) in
                [((0.5, 0.5), north), ((0.75, 0.5), east), ((0.25, 0.5), -east), ((0.3, 0.0), zenith)]
            {
                assert!((environment.direction(place.0, place.1) - expected).length() < 1e-15);
            }
            let turned = Environment { rotation: FRAC_PI_2, ..environment };
            assert!((turned.direction(0.5, 0.5) - east).length() < 1e-15, "clockwise");
        }
    }

    #[test]
    fn directions_and_texels_find_each_other() {
        for up in UpAxis::ALL {
            for rotation in [0.0, 1.0, -40.0] {
                let environment = Environment { up, rotation, ..map(7, 5) };
                for i in 0..35u32 {
                    for (x, y) in [(0.5, 0.5), (0.01, 0.01), (0.99, 0.99)] {
                        let (u, v) = ((f64::from(i % 7) + x) / 7.0, (f64::from(i / 7) + y) / 5.0);
                        let direction = environment.direction(u, v);
                        assert!(direction.is_normalized());
                        let found = environment.place(direction * 3.0);
                        assert!((found.0 - u).abs() < 1e-12 && (found.1 - v).abs() < 1e-12);
                        assert_eq!(environment.radiance(direction), Rgb::splat(f64::from(i)));
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_no_light_is_not_valid() {
        let sound = map(2, 1);
        assert!(sound.is_valid());
        assert!(!Environment { scale: f64::NAN, ..sound.clone() }.is_valid());
        assert!(!Environment { scale: -1.0, ..sound.clone() }.is_valid());
        assert!(!Environment { rotation: f64::INFINITY, ..sound.clone() }.is_valid());
        for texels in [vec![], vec![Vec3::ONE], vec![Vec3::NAN; 2], vec![Vec3::NEG_ONE; 2]] {
            let sky = Sky::Map(LatLongMap { width: 2, height: 1, texels });
            assert!(!Environment { sky, ..sound.clone() }.is_valid());
        }
        let empty = Sky::Map(LatLongMap { width: 0, height: 3, texels: vec![] });
        assert!(!Environment { sky: empty, ..sound }.is_valid());
    }

    #[test]
    fn black_is_what_sends_no_light() {
        assert!(map(1, 1).is_black() && !map(2, 1).is_black());
        assert!(Environment { scale: 0.0, ..map(2, 1) }.is_black());
        let sky = Sky::Cie(CieSky::new(1, CieSky::DEFAULT_SUN, 0.0).unwrap());
        assert!(!Environment { sky: sky.clone(), ..map(1, 1) }.is_black());
        assert!(Environment { sky, scale: 0.0, ..map(1, 1) }.is_black());
    }

    #[test]
    fn every_direction_has_a_texel() {
        let environment = Environment { rotation: 1.0, scale: 2.0, ..map(1, 1) };
        for direction in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z, DVec3::new(-0.0, -1.0, -0.0)] {
            let (u, v) = environment.place(direction);
            assert!((0.0..1.0).contains(&u) && (0.0..=1.0).contains(&v));
            assert_eq!(environment.radiance(direction), Rgb::ZERO);
        }
        assert_eq!(map(4, 2).place(DVec3::new(-1e-300, -1.0, 0.0)).1, 0.5);
    }

    #[test]
    fn solid_angles_fill_the_sphere() {
        for (width, height) in [(1, 1), (2, 1), (1024, 512), (3, 7)] {
            let sum: f64 = (0..height).map(|row| f64::from(width) * texel_solid_angle(width, height, row)).sum();
            assert!((sum / (4.0 * PI) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_sun_stands_where_its_sky_is_brightest() {
        let sky = CieSky::new(13, [2.0, 0.5], 800.0).unwrap();
        let environment = Environment { sky: Sky::Cie(sky), up: UpAxis::Y, rotation: 0.4, scale: 0.5 };
        let (direction, irradiance) = environment.sun().unwrap();
        assert_eq!(irradiance, Rgb::splat(400.0));
        assert!((direction.y - 0.5f64.sin()).abs() < 1e-12);
        let brightest = environment.radiance(direction).x;
        for i in 0..64 {
            for j in 0..32 {
                let other = environment.direction(f64::from(i) / 64.0, f64::from(j) / 64.0);
                assert!(environment.radiance(other).x <= brightest);
            }
        }
        // Its disc is seen, and no more of it; on a surface that faces it L·π·sin² of its radius is the irradiance.
        let across = direction.any_orthonormal_vector();
        let seen = |angle: f64| environment.seen(3.0 * (direction * angle.cos() + across * angle.sin()));
        let disc = seen(0.99 * SUN_RADIUS) - environment.radiance(direction);
        assert!((disc.x * PI * SUN_RADIUS.sin().powi(2) / 400.0 - 1.0).abs() < 1e-4, "{disc}");
        assert!(seen(1.01 * SUN_RADIUS).x < 1.01 * brightest);
        let dark = CieSky::new(13, [2.0, 0.5], 0.0).unwrap();
        assert_eq!(Environment { sky: Sky::Cie(dark), ..environment }.sun(), None);
        assert_eq!(map(2, 1).sun(), None);
    }
}
