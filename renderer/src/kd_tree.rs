//! The k-D tree of samples (Painter & Sloan 1989, section 3.1.1).
//!
//! Every leaf is a cell of the image plane with one sample in it; every node above has the mean over its cell. What the paper
//! stores beside the mean is found where it is asked for, by walks down the tree ([`Visit`]) that take the cells beside them
//! along: from these comes the external variance, and below the pixel level the variance of a mean and the number of samples.
//! So a node needs 28 bytes and a sample 36.
//!
//! Means are of what a display shows ([`Display`]), as the paper's are: a lamp's edge is no harder to know for being brighter
//! than white.

use glam::{Vec3, Vec3A};
use scene::Display;

use crate::cell::{Cell, Halves, PIXEL};

/// A child of a node: another node, or a leaf, whose number is that of its sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Link(u32);

const LEAF: u32 = 1 << 31;
const CLOSED: u32 = 1 << 30;
/// Of a leaf met in a walk: its cell is larger than the one that it stands for there.
const WIDE: u32 = 1 << 29;
/// Of the first link in a node, while means are found anew: that of the node is to be. No walk meets it.
const MARKED: u32 = WIDE;

/// Most samples of a tree: what is left of 32 bits.
pub(crate) const MOST_SAMPLES: usize = WIDE as usize - 1;

impl Link {
    /// No cell: what is beside the picture.
    const NONE: Self = Self(u32::MAX);

    pub fn is_leaf(self) -> bool {
        self.0 & LEAF != 0
    }

    /// Whether no more samples are taken here.
    pub fn is_closed(self) -> bool {
        self.0 & CLOSED != 0
    }

    fn index(self) -> usize {
        (self.0 & !(LEAF | CLOSED | WIDE)) as usize
    }

    /// Where the mean of the cell is.
    fn mean(self) -> usize {
        self.index() << 1 | usize::from(self.is_leaf())
    }
}

/// Where a link stands: the root, or one of two places in a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Slot(u32);

impl Slot {
    const ROOT: Self = Self(u32::MAX);

    fn parent(self) -> Option<usize> {
        (self != Self::ROOT).then_some((self.0 >> 1) as usize)
    }

    fn side(self) -> usize {
        (self.0 & 1) as usize
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    links: [Link; 2],
    /// Where the link to this node stands.
    slot: Slot,
}

/// A sample, and what it is taken for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// Units of [`crate::cell`].
    pub place: [u32; 2],
    /// W·sr⁻¹·m⁻².
    pub radiance: Vec3,
}

/// Three cells in a line.
type Line = [Link; 3];

/// A cell in a walk down the tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visit {
    pub cell: Cell,
    pub slot: Slot,
    /// The cell's own link in the middle of those of the cells around it on the same level: lines across the axis that the cell is
    /// halved along. A larger leaf stands for all that it covers.
    around: [Line; 3],
}

impl Visit {
    pub fn link(&self) -> Link {
        self.around[1][1]
    }
}

/// The two halves of a cell, and what is around them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Halved {
    cells: [Cell; 2],
    slots: [Slot; 2],
    /// What is beside the halves before them, they themselves, and what is beside them after.
    lines: [Line; 4],
    /// Whether the halves are halved along the other axis.
    turns: bool,
}

impl Halved {
    /// The links of the halves.
    pub fn links(&self) -> [Link; 2] {
        [self.lines[1][1], self.lines[2][1]]
    }

    /// A half in a walk, the first or the second.
    pub fn visit(&self, side: usize) -> Visit {
        let lines = [self.lines[side], self.lines[side + 1], self.lines[side + 2]];
        let around = if self.turns { transposed(lines) } else { lines };
        Visit { cell: self.cells[side], slot: self.slots[side], around }
    }

    /// A half as a cell at a place in the tree.
    pub fn part(&self, side: usize) -> (Slot, Cell) {
        (self.slots[side], self.cells[side])
    }
}

/// Sums over the nine means around a cell, less one of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Spread {
    squares: Vec3A,
    sum: Vec3A,
    /// Weighted by −1, 0 and 1 along the lines and across them.
    slopes: [Vec3A; 2],
}

/// The same over three of them in a line.
#[derive(Clone, Copy, Default)]
struct LineSums {
    squares: Vec3A,
    sum: Vec3A,
    slope: Vec3A,
}

impl Spread {
    #[inline]
    fn of([a, b, c]: [&LineSums; 3]) -> Self {
        Self {
            squares: a.squares + b.squares + c.squares,
            sum: a.sum + b.sum + c.sum,
            slopes: [a.slope + b.slope + c.slope, c.sum - a.sum],
        }
    }

    /// The external variance: that of the means, in the channel where it is largest.
    #[inline]
    pub fn external(&self) -> f32 {
        (self.squares - self.sum * self.sum / 9.0).max_element().max(0.0) / 8.0
    }

    /// The variance about the plane that fits the means best, in the channel where it is largest.
    #[inline]
    pub fn about_plane(&self) -> f32 {
        let [x, y] = self.slopes;
        (self.squares - self.sum * self.sum / 9.0 - (x * x + y * y) / 6.0).max_element().max(0.0) / 6.0
    }
}

/// Samples in a tree of cells.
pub(crate) struct KdTree {
    /// Columns and rows of the picture.
    size: [u32; 2],
    display: Display,
    nodes: Vec<Node>,
    samples: Vec<Sample>,
    /// What a display shows of nodes and samples in turn: the mean of the cell of each.
    means: Vec<Vec3A>,
    root: Link,
}

impl KdTree {
    /// One cell with one sample, at a place in it.
    pub fn new(size: [u32; 2], display: Display, place: [u32; 2], radiance: Vec3) -> Self {
        let means = vec![Vec3A::ZERO, display.light(radiance).into()];
        Self { size, display, nodes: Vec::new(), samples: vec![Sample { place, radiance }], means, root: Link(LEAF) }
    }

    /// All samples, in the order in which they were taken.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.samples.as_slice()) + size_of_val(self.means.as_slice())
    }

    /// The sample of a leaf.
    pub fn sample(&self, leaf: Link) -> &Sample {
        &self.samples[leaf.index()]
    }

    /// The mean over a cell of what a display shows.
    #[inline]
    pub fn mean(&self, link: Link) -> Vec3A {
        self.means[link.mean()]
    }

    /// Where all walks begin.
    pub fn root(&self) -> Visit {
        let mut around = [[Link::NONE; 3]; 3];
        around[1][1] = self.root;
        Visit { cell: Cell::around(self.size), slot: Slot::ROOT, around }
    }

    /// How the means of a cell and of those around it spread. What is beside the picture is taken to look like what is next to it.
    pub fn spread(&self, visit: &Visit) -> Spread {
        let base = self.mean(visit.link());
        let [a, b, c] = visit.around.map(|line| self.line_sums(line, base));
        Spread::of([&a, &b, &c])
    }

    /// The same for both halves of a cell.
    pub fn spreads(&self, halved: &Halved) -> [Spread; 2] {
        let base = self.mean(halved.links()[0]);
        let [a, b, c, d] = halved.lines.map(|line| self.line_sums(line, base));
        [Spread::of([&a, &b, &c]), Spread::of([&b, &c, &d])]
    }

    /// Sums over the means of a line less a base.
    #[inline]
    fn line_sums(&self, line: Line, base: Vec3A) -> LineSums {
        let less_base = |link: Link, otherwise: Vec3A| match link {
            Link::NONE => otherwise,
            _ => self.mean(link) - base,
        };
        let middle = less_base(line[1], Vec3A::ZERO);
        let (before, after) = (less_base(line[0], middle), less_base(line[2], middle));
        LineSums {
            squares: before * before + middle * middle + after * after,
            sum: before + middle + after,
            slope: after - before,
        }
    }

    /// Whether all cells around a cell have been parted as far as it is.
    pub fn is_surrounded(&self, visit: &Visit) -> bool {
        visit.around.iter().flatten().all(|&link| link == Link::NONE || link.0 & WIDE == 0)
    }

    /// The halves of a cell, each covered by the cell's leaf if it is one; none of a cell with but one half in the picture.
    #[inline]
    pub fn halved(&self, visit: &Visit) -> Option<Halved> {
        let Halves::Both(axis, cells) = visit.cell.halves(self.size) else { return None };
        let [before, here, after] = visit.around;
        // A cell that has but one half in the picture stands for it.
        let side = 1u64 << visit.cell.log_sides[axis];
        let ends = u64::from(visit.cell.corner[axis]) + side + side / 2 >= u64::from(self.size[axis]) << PIXEL;
        let lines = [
            before.map(|link| self.half(link, 1)),
            here.map(|link| self.half(link, 0)),
            here.map(|link| self.half(link, 1)),
            if ends { after } else { after.map(|link| self.half(link, 0)) },
        ];
        let node = visit.link();
        let slots = [0, 1].map(|side| if node.is_leaf() { visit.slot } else { Slot(node.0 << 1 | side) });
        Some(Halved { cells, slots, lines, turns: cells[0].axis() != axis })
    }

    /// The halves of a cell that lie in the picture; none of a cell of one unit.
    #[inline]
    pub fn halves(&self, visit: &Visit) -> [Option<Visit>; 2] {
        if let Some(halved) = self.halved(visit) {
            return [Some(halved.visit(0)), Some(halved.visit(1))];
        }
        let Halves::First(axis, cell) = visit.cell.halves(self.size) else { return [None; 2] };
        let [before, here, _] = visit.around;
        let lines = [before.map(|link| self.half(link, 1)), here, [Link::NONE; 3]];
        let around = if cell.axis() == axis { lines } else { transposed(lines) };
        [Some(Visit { cell, around, ..*visit }), None]
    }

    #[inline]
    fn half(&self, link: Link, side: usize) -> Link {
        if link.is_leaf() { Link(link.0 | WIDE) } else { self.nodes[link.index()].links[side] }
    }

    /// The link at a place.
    pub fn link_at(&self, slot: Slot) -> Link {
        slot.parent().map_or(self.root, |node| self.nodes[node].links[slot.side()])
    }

    fn set_link(&mut self, slot: Slot, link: Link) {
        match slot.parent() {
            Some(node) => self.nodes[node].links[slot.side()] = link,
            None => self.root = link,
        }
    }

    /// Visits all leaves in their order.
    pub fn leaves(&self, visit: &mut dyn FnMut(&Cell, &Sample)) {
        let mut open = vec![(Cell::around(self.size), self.root)];
        while let Some((cell, link)) = open.pop() {
            if link.is_leaf() {
                visit(&cell, self.sample(link));
                continue;
            }
            match cell.halves(self.size) {
                Halves::None => {}
                Halves::First(_, first) => open.push((first, link)),
                Halves::Both(_, cells) => {
                    open.extend([1, 0].map(|side| (cells[side], self.nodes[link.index()].links[side])))
                }
            }
        }
    }

    /// Closes off a cell, and those above whose parts are all closed.
    pub fn close(&mut self, slot: Slot) {
        let mut slot = slot;
        loop {
            self.set_link(slot, Link(self.link_at(slot).0 | CLOSED));
            let Some(parent) = slot.parent() else { return };
            if !self.nodes[parent].links.iter().all(|link| link.is_closed()) {
                return;
            }
            slot = self.nodes[parent].slot;
        }
    }

    /// Parts the cell of a leaf: its sample stays in one half, the new one is that of the other, the `side`. The node above both.
    pub fn part(&mut self, slot: Slot, side: usize, place: [u32; 2], radiance: Vec3) -> u32 {
        let mut links = [self.link_at(slot); 2];
        links[side] = Link(self.samples.len() as u32 | LEAF);
        let node = self.nodes.len() as u32;
        self.samples.push(Sample { place, radiance });
        self.nodes.push(Node { links, slot });
        self.means.extend([Vec3A::ZERO, self.display.light(radiance).into()]);
        self.set_link(slot, Link(node));
        node
    }

    /// Finds the means of nodes, and of all above them, anew; each node comes with the level of its cell ([`Cell::level`]).
    pub fn update(&mut self, nodes: &[(u8, u32)]) {
        let mut levels = vec![Vec::new(); 1 + usize::from(Cell::around(self.size).level())];
        for &(level, node) in nodes {
            self.mark(node);
            levels[usize::from(level)].push(node);
        }
        // From the smallest cells up, so that what is above many is found once, with all below it right.
        let mut above = Vec::new();
        for mut level in levels {
            level.append(&mut above);
            for node in level {
                let Node { links: [first, second], slot } = self.nodes[node as usize];
                let links = [Link(first.0 & !MARKED), second];
                self.nodes[node as usize].links = links;
                let [a, b] = links.map(|link| self.mean(link));
                self.means[Link(node).mean()] = (a + b) / 2.0;
                if let Some(parent) = slot.parent()
                    && self.mark(parent as u32)
                {
                    above.push(parent as u32);
                }
            }
        }
    }

    /// Marks a node as one whose mean is to be found; whether it was not yet.
    fn mark(&mut self, node: u32) -> bool {
        let link = &mut self.nodes[node as usize].links[0];
        let is_new = link.0 & MARKED == 0;
        link.0 |= MARKED;
        is_new
    }
}

#[inline]
fn transposed(lines: [Line; 3]) -> [Line; 3] {
    let [[a, b, c], [d, e, f], [g, h, i]] = lines;
    [[a, d, g], [b, e, h], [c, f, i]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_pictures::display;

    /// The spread of means that a function gives at −1, 0 and 1, less that in the middle.
    fn spread(value: impl Fn(f32, f32) -> f32) -> Spread {
        let line = |y: f32| {
            let [a, b, c] = [-1.0, 0.0, 1.0].map(|x| Vec3A::new(0.0, value(x, y) - value(0.0, 0.0), 0.0));
            LineSums { squares: a * a + b * b + c * c, sum: a + b + c, slope: c - a }
        };
        Spread::of([&line(-1.0), &line(0.0), &line(1.0)])
    }

    #[test]
    fn what_is_even_does_not_vary_and_a_plane_not_about_itself() {
        let even = spread(|_, _| 3.0);
        assert_eq!((even.external(), even.about_plane()), (0.0, 0.0));
        let plane = spread(|x, y| 1.0 + 2.0 * x - 0.5 * y);
        assert!((plane.external() - 6.0 * 4.25 / 8.0).abs() < 1e-5);
        assert!(plane.about_plane() < 1e-6);
    }

    #[test]
    fn a_border_varies_by_a_quarter_and_about_the_plane_by_a_third_of_that() {
        let border = spread(|x, _| if x > 0.5 { 1.0 } else { 0.0 });
        assert!((border.external() - 0.25).abs() < 1e-6);
        assert!((border.about_plane() - 0.5 / 6.0).abs() < 1e-6);
    }

    /// All cells of one level: their neighbours are those of the grid, found by where they lie.
    #[test]
    fn a_walk_knows_what_is_around_it() {
        for size in [[8, 8], [5, 3], [1, 6], [7, 7]] {
            let whole = Cell::around(size);
            let mut tree = KdTree::new(size, display(), whole.place(size, [0, 0]), Vec3::ZERO);
            // Part everything down to pixels, each sample as bright as its number.
            loop {
                let mut open = Vec::new();
                let mut walk = vec![tree.root()];
                while let Some(visit) = walk.pop() {
                    if visit.cell.is_pixel() {
                        continue;
                    }
                    match (visit.link().is_leaf(), visit.cell.halves(size)) {
                        (true, Halves::Both(_, cells)) => open.push((visit.slot, cells)),
                        _ => walk.extend(tree.halves(&visit).into_iter().flatten()),
                    }
                }
                if open.is_empty() {
                    break;
                }
                let mut nodes = Vec::new();
                for (slot, cells) in open {
                    let old = tree.sample(tree.link_at(slot)).place;
                    let side = usize::from(cells[0].contains(old));
                    let light = 0.5 * tree.samples().len() as f32 / 100.0;
                    let node = tree.part(slot, side, cells[side].place(size, [9, 9]), Vec3::splat(light));
                    nodes.push((cells[side].level() + 1, node));
                }
                tree.update(&nodes);
            }
            let mut pixels = vec![f32::NAN; (size[0] * size[1]) as usize];
            tree.leaves(&mut |cell, sample| {
                let [x, y] = cell.corner.map(|unit| unit >> PIXEL);
                pixels[(y * size[0] + x) as usize] = sample.radiance.x;
            });
            let mut walk = vec![tree.root()];
            let mut met = 0;
            while let Some(visit) = walk.pop() {
                if !visit.cell.is_pixel() {
                    walk.extend(tree.halves(&visit).into_iter().flatten());
                    continue;
                }
                met += 1;
                assert!(tree.is_surrounded(&visit));
                let [x, y] = visit.cell.corner.map(|unit| (unit >> PIXEL) as i32);
                // A pixel is halved along the vertical axis: its lines are rows.
                for (dy, row) in (-1..).zip(&visit.around) {
                    for (dx, &link) in (-1..).zip(row) {
                        let inside = |place: i32, side: u32| (0..side as i32).contains(&place);
                        if inside(x + dx, size[0]) && inside(y + dy, size[1]) {
                            assert_eq!(tree.mean(link).x, pixels[((y + dy) * size[0] as i32 + x + dx) as usize]);
                        } else {
                            assert_eq!(link, Link::NONE);
                        }
                    }
                }
            }
            assert_eq!(met, size[0] * size[1]);
            let mean = pixels.iter().sum::<f32>() / pixels.len() as f32;
            let is_even = size.iter().all(|side| side.is_power_of_two());
            assert!(!is_even || (tree.mean(tree.root().link()).x - mean).abs() < 1e-5);
        }
    }

    #[test]
    fn what_is_closed_below_is_closed_above() {
        let size = [2, 1];
        let mut tree = KdTree::new(size, display(), [0, 0], Vec3::ONE);
        let Halves::Both(_, cells) = Cell::around(size).halves(size) else { unreachable!("two pixels") };
        let node = tree.part(Slot::ROOT, 1, cells[1].corner, Vec3::ZERO);
        tree.update(&[(2 * PIXEL + 1, node)]);
        let [Some(first), Some(second)] = tree.halves(&tree.root()) else { unreachable!("two pixels") };
        tree.close(first.slot);
        assert!(!tree.root().link().is_closed());
        tree.close(second.slot);
        assert!(tree.root().link().is_closed());
        assert_eq!(tree.bytes(), 2 * 64 - size_of::<Node>());
    }
}
