//! What the samples in a pixel tell of its mean (Painter & Sloan 1989, sections 3.1.2 and 3.1.3).

use glam::Vec3A;

use crate::cell::Cell;
use crate::kd_tree::{KdTree, Slot, Visit};

/// How the variance of a pixel's mean is told from its samples. Halves of equal area whose means have the variances σ₁ and σ₂
/// have a mean with (σ₁ + σ₂)/4; the rules differ in what a cell with a single sample is taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// As the paper has it: a sample scatters as it differs from the other half of the cell that it was parted from, and Student's t
    /// is that of n − 1 degrees for n samples. Of fewer than four samples the external variance is asked, which is that of
    /// nine means: a ninth of it, with eight degrees.
    Paper,
    /// A sample scatters as the nine means around it do about the plane that fits them best, wherever its pixel ends. A border that
    /// all samples of a pixel missed is found out where those of the next one met it.
    Calibrated,
}

/// Samples of a pixel, below which the paper's rule asks the external variance. Four have seen every quarter; with fewer one
/// border in four is missed, more take a ray for each of a tenth of all pixels.
const FEW: usize = 4;

/// What the variance by the calibrated rule is multiplied by. About the plane the means next to a sharp border scatter more than
/// samples in the cells on it do, and a third of the cells counted are on it; in a texture without borders neither is so. With
/// this, 99.9 % of the pixels keep an interval that is asked for at 99 %, and in a fractal texture 99.3 %.
const BORDERS: f32 = 0.5;

/// Degrees of freedom of nine means about their mean, and about a plane.
const MEANS: f32 = 8.0;
const ABOUT_PLANE: f32 = 6.0;

/// The degrees that stand for many.
const MANY: f32 = 1e6;

/// A cell with one sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    /// What it adds to the variance of the pixel's mean.
    pub weight: f32,
    pub slot: Slot,
    pub cell: Cell,
}

/// The parts of a pixel.
pub(crate) struct Survey {
    rule: Rule,
    pub parts: Vec<Part>,
    /// Variance of the mean, that of the channel where it is largest, and its degrees of freedom.
    pub variance: f32,
    pub degrees: f32,
    /// Sum of the squares of the weights.
    squares: f32,
}

impl Survey {
    pub fn new(rule: Rule) -> Self {
        Self { rule, parts: Vec::new(), variance: 0.0, degrees: 0.0, squares: 0.0 }
    }

    /// Looks at a pixel whose external variance is given.
    pub fn look(&mut self, tree: &KdTree, pixel: &Visit, external: f32) {
        self.parts.clear();
        (self.variance, self.squares) = (0.0, 0.0);
        self.descend(tree, pixel, 1.0, Vec3A::ZERO);
        let count = self.parts.len();
        match self.rule {
            Rule::Paper if count < FEW => (self.variance, self.degrees) = (external / 9.0, MEANS),
            Rule::Paper => self.degrees = (count - 1) as f32,
            Rule::Calibrated => {
                // Of a sum of variances that are known with few degrees each (Satterthwaite 1946).
                let effective = ABOUT_PLANE * self.variance * self.variance / self.squares;
                self.degrees = if effective.is_finite() { effective } else { MANY };
                self.variance *= BORDERS;
            }
        }
    }

    /// Adds the parts below a cell that is `area` of a pixel and differs from its other half by `difference`.
    fn descend(&mut self, tree: &KdTree, visit: &Visit, area: f32, difference: Vec3A) {
        if visit.link().is_leaf() {
            let variance = match self.rule {
                Rule::Paper => (difference * difference).max_element() / 2.0,
                Rule::Calibrated => about_plane(&tree.differences(visit)),
            };
            let weight = variance * area * area;
            self.variance += weight;
            self.squares += weight * weight;
            self.parts.push(Part { weight, slot: visit.slot, cell: visit.cell });
            return;
        }
        let [Some(first), Some(second)] = tree.halves(visit) else { return };
        let difference = tree.mean(first.link()) - tree.mean(second.link());
        self.descend(tree, &first, area / 2.0, difference);
        self.descend(tree, &second, area / 2.0, difference);
    }
}

/// The external variance of a cell: that of its mean and the eight around it, in the channel where it is largest.
pub(crate) fn external_variance(differences: &[[Vec3A; 3]; 3]) -> f32 {
    let (squares, sum, _) = sums(differences);
    (squares - sum * sum / 9.0).max_element().max(0.0) / MEANS
}

/// The variance of nine means about the plane that fits them best, in the channel where it is largest.
fn about_plane(differences: &[[Vec3A; 3]; 3]) -> f32 {
    let (squares, sum, [x, y]) = sums(differences);
    (squares - sum * sum / 9.0 - (x * x + y * y) / 6.0).max_element().max(0.0) / ABOUT_PLANE
}

/// Sum of squares, sum, and the differences between the last and the first column and row.
fn sums([a, b, c]: &[[Vec3A; 3]; 3]) -> (Vec3A, Vec3A, [Vec3A; 2]) {
    let row = |row: &[Vec3A; 3]| row[0] + row[1] + row[2];
    let squares = |row: &[Vec3A; 3]| row[0] * row[0] + row[1] * row[1] + row[2] * row[2];
    let columns = (a[2] - a[0]) + (b[2] - b[0]) + (c[2] - c[0]);
    (squares(a) + squares(b) + squares(c), row(a) + row(b) + row(c), [columns, row(c) - row(a)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn means(value: impl Fn(f32, f32) -> f32) -> [[Vec3A; 3]; 3] {
        [-1.0, 0.0, 1.0].map(|y| [-1.0, 0.0, 1.0].map(|x| Vec3A::new(0.0, value(x, y) - value(0.0, 0.0), 0.0)))
    }

    #[test]
    fn what_is_even_does_not_vary_and_a_plane_not_about_itself() {
        let even = means(|_, _| 3.0);
        assert_eq!((external_variance(&even), about_plane(&even)), (0.0, 0.0));
        let plane = means(|x, y| 1.0 + 2.0 * x - 0.5 * y);
        assert!((external_variance(&plane) - 6.0 * 4.25 / 8.0).abs() < 1e-5);
        assert!(about_plane(&plane) < 1e-6);
    }

    #[test]
    fn a_border_varies_by_a_quarter_and_about_the_plane_by_a_third_of_that() {
        let border = means(|x, _| if x > 0.5 { 1.0 } else { 0.0 });
        assert!((external_variance(&border) - 0.25).abs() < 1e-6);
        assert!((about_plane(&border) - 0.5 / 6.0).abs() < 1e-6);
    }
}
