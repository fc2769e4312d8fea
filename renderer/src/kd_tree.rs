//! The k-D tree of samples (Painter & Sloan 1989, section 3.1.1).
//!
//! Every leaf is a cell of the image plane with one sample in it; every node above has the mean over its cell. What the paper stores
//! beside the mean is found where it is asked for, by walks down the tree ([`Visit`]) that take the cells beside them along: from
//! these comes the external variance, and below the pixel level the variance of a mean and the number of samples. So a node
//! needs 24 bytes and a sample 32.
//!
//! Means are of what a display shows ([`shown`]), as the paper's are: a lamp's edge is no harder to know for being brighter than white.

use glam::{Vec3, Vec3A};
use scene::Exposure;

use crate::cell::{Cell, Halves, PIXEL};
use crate::film::shown;

/// A child of a node: another node, or a leaf, whose number is that of its sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Link(u32);

const LEAF: u32 = 1 << 31;
const CLOSED: u32 = 1 << 30;
/// Of a leaf met in a walk: its cell is larger than the one that it stands for there.
const WIDE: u32 = 1 << 29;

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
    mean: Vec3,
}

/// A sample, and what it is taken for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// Units of [`crate::cell`].
    pub place: [u32; 2],
    /// W·sr⁻¹·m⁻².
    pub radiance: Vec3,
    /// What a display shows of it, 0..=1.
    shown: Vec3,
}

/// A cell in a walk down the tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visit {
    pub cell: Cell,
    pub slot: Slot,
    /// The cell's own link in the middle of those of the cells around it on the same level, row by row; a larger leaf stands for
    /// all that it covers.
    around: [[Link; 3]; 3],
}

impl Visit {
    pub fn link(&self) -> Link {
        self.around[1][1]
    }
}

/// Samples in a tree of cells.
pub(crate) struct KdTree {
    /// Columns and rows of the picture.
    size: [u32; 2],
    exposure: Exposure,
    nodes: Vec<Node>,
    samples: Vec<Sample>,
    root: Link,
}

impl KdTree {
    /// One cell with one sample, at a place in it.
    pub fn new(size: [u32; 2], exposure: Exposure, place: [u32; 2], radiance: Vec3) -> Self {
        let first = Sample { place, radiance, shown: shown(radiance, exposure) };
        Self { size, exposure, nodes: Vec::new(), samples: vec![first], root: Link(LEAF) }
    }

    /// All samples, in the order in which they were taken.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.samples.as_slice())
    }

    /// The sample of a leaf.
    pub fn sample(&self, leaf: Link) -> &Sample {
        &self.samples[leaf.index()]
    }

    /// The mean over a cell of what a display shows.
    #[inline]
    pub fn mean(&self, link: Link) -> Vec3A {
        if link.is_leaf() { self.samples[link.index()].shown.into() } else { self.nodes[link.index()].mean.into() }
    }

    /// Where all walks begin.
    pub fn root(&self) -> Visit {
        let mut around = [[Link::NONE; 3]; 3];
        around[1][1] = self.root;
        Visit { cell: Cell::around(self.size), slot: Slot::ROOT, around }
    }

    /// The means of the cells around a cell less its own; none of those beside the picture, which are taken to look like it.
    #[inline]
    pub fn differences(&self, visit: &Visit) -> [[Vec3A; 3]; 3] {
        let own = self.mean(visit.link());
        visit.around.map(|row| row.map(|link| if link == Link::NONE { Vec3A::ZERO } else { self.mean(link) - own }))
    }

    /// Whether all cells around a cell have been parted as far as it is.
    pub fn is_surrounded(&self, visit: &Visit) -> bool {
        visit.around.iter().flatten().all(|&link| link == Link::NONE || link.0 & WIDE == 0)
    }

    /// The halves of a cell that lie in the picture, each covered by the cell's leaf if it is one; none of a cell of one unit.
    #[inline]
    pub fn halves(&self, visit: &Visit) -> [Option<Visit>; 2] {
        let (axis, first, second) = match visit.cell.halves(self.size) {
            Halves::None => return [None; 2],
            Halves::First(axis, first) => (axis, first, None),
            Halves::Both(axis, [first, second]) => (axis, first, Some(second)),
        };
        // Lines of cells across the axis: what is beside the halves before them, they themselves, and what is beside them after.
        let [before, here, after] = if axis == 0 { transposed(visit.around) } else { visit.around };
        let half = |cell: Cell, side: u32, lines: [[Link; 3]; 3]| {
            let around = if axis == 0 { transposed(lines) } else { lines };
            let is_whole = visit.link().is_leaf() || second.is_none();
            let slot = if is_whole { visit.slot } else { Slot(visit.link().0 << 1 | side) };
            Some(Visit { cell, slot, around })
        };
        let a = before.map(|link| self.half(link, 1));
        let Some(second) = second else { return [half(first, 0, [a, here, [Link::NONE; 3]]), None] };
        let (b, c) = (here.map(|link| self.half(link, 0)), here.map(|link| self.half(link, 1)));
        // A cell that has but one half in the picture stands for it.
        let side = 1u64 << visit.cell.log_sides[axis];
        let ends = u64::from(visit.cell.corner[axis]) + side + side / 2 >= u64::from(self.size[axis]) << PIXEL;
        let d = if ends { after } else { after.map(|link| self.half(link, 0)) };
        [half(first, 0, [a, b, c]), half(second, 1, [b, c, d])]
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
        self.samples.push(Sample { place, radiance, shown: shown(radiance, self.exposure) });
        self.nodes.push(Node { links, slot, mean: Vec3::ZERO });
        self.set_link(slot, Link(node));
        node
    }

    /// Finds the means of nodes, and of all above them, anew.
    pub fn update(&mut self, mut nodes: Vec<u32>) {
        // Step by step towards the root. What is above several of them is found several times, the last time with all below it
        // right; neighbours in the list, which mostly have the same parent, have it once.
        while !nodes.is_empty() {
            let mut kept = 0;
            for place in 0..nodes.len() {
                let node = nodes[place] as usize;
                let [a, b] = self.nodes[node].links.map(|link| self.mean(link));
                self.nodes[node].mean = ((a + b) / 2.0).into();
                if let Some(parent) = self.nodes[node].slot.parent()
                    && (kept == 0 || nodes[kept - 1] != parent as u32)
                {
                    nodes[kept] = parent as u32;
                    kept += 1;
                }
            }
            nodes.truncate(kept);
        }
    }
}

#[inline]
fn transposed(lines: [[Link; 3]; 3]) -> [[Link; 3]; 3] {
    let [[a, b, c], [d, e, f], [g, h, i]] = lines;
    [[a, d, g], [b, e, h], [c, f, i]]
}
