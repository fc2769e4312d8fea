//! What an interrupted bake has found out: with it the same bake, begun anew, soon is where it was, and ends with the same bytes.
//!
//! A bake is a function of its scene and options alone, and nearly all of its time goes into the answers to a few kinds of questions.
//! These answers are kept in the order in which they were asked for. So it does not matter when a bake is interrupted, and
//! none of its other state has to be kept.

use glam::{DVec2, Vec3};

use crate::SceneError;

/// An interrupted bake's answers, and what they hold for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unfinished {
    /// The build of the program that found them.
    pub build: String,
    /// The options that it was given.
    pub options: String,
    /// The answers.
    pub answers: Answers,
}

/// What a bake has asked, and found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answers {
    /// A checksum of every question, in order: answers are taken for as long as the questions are the same.
    pub questions: Vec<u64>,
    /// Irradiance straight from emitters and from the environment, W·m⁻².
    pub emitted: Vec<Vec3>,
    /// The part of each that is from the environment, W·m⁻²; empty where there is none.
    pub sky: Vec<Vec3>,
    /// What samples see of the reflectors.
    pub rows: Rows,
    /// What was measured of the bake's residual: two differences of irradiance, and an irradiance, W·m⁻².
    pub residuals: Vec<[f64; 7]>,
}

/// A part of an element that a sample sees, in the digits that light needs: there are millions of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// The element, a node of the solver's.
    pub node: u32,
    /// Form factor of what is seen of it: five bits of an exponent, eleven of a fraction, for 2⁻³¹..2.
    pub form_factor: u16,
    /// From the middle of the element to the middle of what is seen of it, along its patch's u and v; [`Seen::LENGTH`] is the
    /// length of the element's cell.
    pub offset: [i8; 2],
}

impl Seen {
    /// The length of a cell in the unit of offsets.
    pub const LENGTH: f32 = i8::MAX as f32;

    /// Places of a fraction that are left out, and the smallest number, of f32.
    const FRACTION: u32 = 12;
    const LEAST: u32 = (127 - 31) << 23;

    /// What is seen of a node, with the offset in lengths of its cell.
    pub fn new(node: u32, form_factor: f64, offset: DVec2) -> Self {
        let nearest = (form_factor.max(0.0) as f32).to_bits() + (1 << (Self::FRACTION - 1));
        let [u, v] = (offset * f64::from(Self::LENGTH)).round().to_array().map(|part| part as i8);
        let form_factor = (nearest.saturating_sub(Self::LEAST) >> Self::FRACTION).min(u32::from(u16::MAX)) as u16;
        Self { node, form_factor, offset: [u, v] }
    }

    /// Form factor of what is seen, 0..2.
    pub fn form_factor(&self) -> f32 {
        f32::from_bits((u32::from(self.form_factor) << Self::FRACTION) + Self::LEAST)
    }
}

/// Rows of what is seen, one after another in one list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    seen: Vec<Seen>,
    ends: Vec<usize>,
}

impl Rows {
    /// Rows of the given lengths; none where these do not add up to what is seen.
    pub fn new(seen: Vec<Seen>, lengths: &[u32]) -> Option<Self> {
        let mut end = 0;
        let ends: Vec<usize> = lengths
            .iter()
            .map(|&length| {
                end += length as usize;
                end
            })
            .collect();
        (end == seen.len()).then_some(Self { seen, ends })
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// A row by its number.
    pub fn row(&self, number: usize) -> &[Seen] {
        let first = if number == 0 { 0 } else { self.ends[number - 1] };
        &self.seen[first..self.ends[number]]
    }

    /// All rows in their order.
    pub fn iter(&self) -> impl Iterator<Item = &[Seen]> {
        (0..self.len()).map(|number| self.row(number))
    }

    /// What is seen in all rows.
    pub fn seen(&self) -> &[Seen] {
        &self.seen
    }

    /// Adds a row.
    pub fn push(&mut self, row: &[Seen]) {
        self.seen.extend_from_slice(row);
        self.ends.push(self.seen.len());
    }

    /// Keeps the first of the rows.
    pub fn truncate(&mut self, count: usize) {
        self.ends.truncate(count);
        self.seen.truncate(self.ends.last().copied().unwrap_or_default());
    }
}

impl Answers {
    /// Number of answers.
    pub fn count(&self) -> usize {
        self.emitted.len() + self.rows.len() + self.residuals.len()
    }

    /// Checks every number; anything read from a file passes through here before it is used.
    pub fn validate(&self) -> Result<(), SceneError> {
        let number = |what: &str, i: Option<usize>| match i {
            Some(i) => Err(SceneError::Number(format!("{what} {i}"))),
            None => Ok(()),
        };
        number("answer about emitters", self.emitted.iter().position(|light| !light.is_finite()))?;
        number("answer about the sky", self.sky.iter().position(|light| !light.is_finite()))?;
        if !self.sky.is_empty() && self.sky.len() != self.emitted.len() {
            return Err(SceneError::Index(format!("answer about the sky {}", self.sky.len())));
        }
        let is_bad = |point: &[f64; 7]| !point.iter().all(|part| part.is_finite());
        number("answer about the residual", self.residuals.iter().position(is_bad))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn what_is_seen_keeps_the_digits_that_light_needs() {
        let seen = |form_factor| f64::from(Seen::new(7, form_factor, DVec2::ZERO).form_factor());
        assert_eq!([0.0, 1e-12].map(seen).map(|least| least < 1e-9), [true; 2]);
        for form_factor in [1e-9, 1.0 / 3.0, 0.999_9, 1.0, 1.000_001] {
            assert!((seen(form_factor) / form_factor - 1.0).abs() < 1.3e-4, "{form_factor}");
        }
        assert_eq!(seen(1.0), 1.0);
        assert!(seen(5.0) > 1.999 && seen(f64::NAN).is_finite());
        let places = Seen::new(7, 0.1, DVec2::new(0.5, -0.3)).offset.map(|part| f32::from(part) / Seen::LENGTH);
        assert!((places[0] - 0.5).abs() < 0.004 && (places[1] + 0.3).abs() < 0.004);
        assert_eq!(Seen::new(7, 0.1, DVec2::new(9.0, f64::NAN)).offset, [i8::MAX, 0]);
    }

    #[test]
    fn rows_come_back_as_they_were_added_and_are_cut_off_from_the_end() {
        let seen = |node| Seen::new(node, 0.5, DVec2::new(0.25, -0.5));
        let all: [&[Seen]; 4] = [&[], &[seen(1), seen(2)], &[], &[seen(3)]];
        let mut rows = Rows::default();
        assert!(rows.is_empty() && rows.iter().next().is_none());
        all.iter().for_each(|row| rows.push(row));
        assert!(rows.iter().eq(all) && rows.len() == 4 && rows.row(3) == all[3]);
        assert_eq!(Rows::new(rows.seen().to_vec(), &[0, 2, 0, 1]), Some(rows.clone()));
        assert_eq!(Rows::new(rows.seen().to_vec(), &[0, 2]), None);
        assert_eq!(Rows::new(rows.seen().to_vec(), &[u32::MAX, 2]), None);
        rows.truncate(2);
        assert!(rows.iter().eq(all[..2].iter().copied()) && rows.seen().len() == 2);
        rows.truncate(9);
        assert_eq!(rows.len(), 2);
        rows.truncate(0);
        assert_eq!(rows, Rows::default());
    }
}
