//! What an interrupted bake has found out: with it the same bake, begun anew, soon is where it was, and ends with the same bytes.
//!
//! A bake is a function of its scene and options alone, and nearly all of its time goes into the answers to a few kinds of questions.
//! These answers are kept in the order in which they were asked for. So it does not matter when a bake is interrupted, and
//! none of its other state has to be kept.

use crate::{Rgb, SceneError};

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
    pub emitted: Vec<Rgb>,
    /// The part of each that is from the environment, W·m⁻²; empty where there is none.
    pub sky: Vec<Rgb>,
    /// What samples see of the reflectors.
    pub rows: Vec<Box<[Seen]>>,
    /// What was measured of the bake's residual: two differences of irradiance, and an irradiance, W·m⁻².
    pub residuals: Vec<[f64; 7]>,
}

/// A part of an element that a sample sees. f32 has the digits that light needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// The element, a node of the solver's.
    pub node: u32,
    /// Form factor of what is seen of it.
    pub form_factor: f32,
    /// From the middle of the element to the middle of what is seen of it, along its patch's u and v, metres.
    pub offset: [f32; 2],
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
        let is_bad =
            |seen: &Seen| ![seen.form_factor, seen.offset[0], seen.offset[1]].iter().all(|part| part.is_finite());
        number("answer about emitters", self.emitted.iter().position(|light| !light.is_finite()))?;
        number("answer about the sky", self.sky.iter().position(|light| !light.is_finite()))?;
        if !self.sky.is_empty() && self.sky.len() != self.emitted.len() {
            return Err(SceneError::Index(format!("answer about the sky {}", self.sky.len())));
        }
        number("answer about reflectors", self.rows.iter().position(|row| row.iter().any(is_bad)))?;
        let is_bad = |point: &[f64; 7]| !point.iter().all(|part| part.is_finite());
        number("answer about the residual", self.residuals.iter().position(is_bad))
    }
}
