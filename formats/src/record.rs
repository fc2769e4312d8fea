//! Records: the fixed-size, little-endian rows that the arrays of a `.hlf` file consist of.

use glam::{DVec3, Vec2, Vec3};
use scene::{BakedElement, BakedTriangle, DiscontinuityLine, EdgeKind, LineKind, Polygon, Seen};

/// A value that takes the same number of bytes in every row.
pub(crate) trait Record: Sized {
    /// Bytes of a row.
    const SIZE: usize;

    /// Appends the row.
    fn put(&self, bytes: &mut Vec<u8>);

    /// Takes a row off the front; none where a byte has no meaning. There are at least [`Record::SIZE`] bytes.
    fn take(bytes: &mut &[u8]) -> Option<Self>;
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Record for $number {
            const SIZE: usize = size_of::<$number>();

            fn put(&self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }

            fn take(bytes: &mut &[u8]) -> Option<Self> {
                Some(<$number>::from_le_bytes(*bytes.split_off(..Self::SIZE)?.as_array()?))
            }
        }
    )*};
}
numbers!(u8, i8, u16, u32, u64, f32, f64);

impl<T: Record + Copy + Default, const N: usize> Record for [T; N] {
    const SIZE: usize = N * T::SIZE;

    fn put(&self, bytes: &mut Vec<u8>) {
        self.iter().for_each(|value| value.put(bytes));
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = T::take(bytes)?;
        }
        Some(values)
    }
}

impl Record for Vec2 {
    const SIZE: usize = 8;

    fn put(&self, bytes: &mut Vec<u8>) {
        self.to_array().put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        <[f32; 2]>::take(bytes).map(Self::from_array)
    }
}

impl Record for Vec3 {
    const SIZE: usize = 12;

    fn put(&self, bytes: &mut Vec<u8>) {
        self.to_array().put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        <[f32; 3]>::take(bytes).map(Self::from_array)
    }
}

impl Record for DVec3 {
    const SIZE: usize = 24;

    fn put(&self, bytes: &mut Vec<u8>) {
        self.to_array().put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        <[f64; 3]>::take(bytes).map(Self::from_array)
    }
}

impl Record for Polygon {
    const SIZE: usize = 16;

    fn put(&self, bytes: &mut Vec<u8>) {
        [self.first_corner, self.corner_count, self.material, self.object].put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        let [first_corner, corner_count, material, object] = Record::take(bytes)?;
        Some(Self { first_corner, corner_count, material, object })
    }
}

/// Kind (0 interior, 1 leaf, 2 cut, 3 discontinuity) and index of the discontinuity, 0 for the other kinds.
impl Record for EdgeKind {
    const SIZE: usize = 5;

    fn put(&self, bytes: &mut Vec<u8>) {
        let (kind, line): (u8, u32) = match *self {
            Self::Interior => (0, 0),
            Self::Leaf => (1, 0),
            Self::Cut => (2, 0),
            Self::Discontinuity(line) => (3, line),
        };
        kind.put(bytes);
        line.put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        match (u8::take(bytes)?, u32::take(bytes)?) {
            (0, 0) => Some(Self::Interior),
            (1, 0) => Some(Self::Leaf),
            (2, 0) => Some(Self::Cut),
            (3, line) => Some(Self::Discontinuity(line)),
            _ => None,
        }
    }
}

impl Record for BakedTriangle {
    const SIZE: usize = 59;

    fn put(&self, bytes: &mut Vec<u8>) {
        self.vertices.put(bytes);
        self.samples.put(bytes);
        [self.polygon, self.element].put(bytes);
        self.edges.put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        let (vertices, samples) = (Record::take(bytes)?, Record::take(bytes)?);
        let [polygon, element] = Record::take(bytes)?;
        Some(Self { vertices, samples, polygon, element, edges: Record::take(bytes)? })
    }
}

impl Record for BakedElement {
    const SIZE: usize = 16;

    fn put(&self, bytes: &mut Vec<u8>) {
        self.polygon.put(bytes);
        self.irradiance.put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        Some(Self { polygon: Record::take(bytes)?, irradiance: Record::take(bytes)? })
    }
}

impl Record for DiscontinuityLine {
    const SIZE: usize = 41;

    fn put(&self, bytes: &mut Vec<u8>) {
        let kind: u8 = match self.kind {
            LineKind::Horizon => 0,
            LineKind::EdgeVertex => 1,
            LineKind::VertexEdge => 2,
        };
        kind.put(bytes);
        [self.receiver, self.source, self.blocker].put(bytes);
        self.weight.put(bytes);
        self.ends.put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        let kind = match u8::take(bytes)? {
            0 => LineKind::Horizon,
            1 => LineKind::EdgeVertex,
            2 => LineKind::VertexEdge,
            _ => return None,
        };
        let [receiver, source, blocker] = Record::take(bytes)?;
        Some(Self { kind, receiver, source, blocker, weight: Record::take(bytes)?, ends: Record::take(bytes)? })
    }
}

impl Record for Seen {
    const SIZE: usize = 8;

    fn put(&self, bytes: &mut Vec<u8>) {
        self.node.put(bytes);
        self.form_factor.put(bytes);
        self.offset.put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        Some(Self { node: Record::take(bytes)?, form_factor: Record::take(bytes)?, offset: Record::take(bytes)? })
    }
}

/// All rows as bytes.
pub(crate) fn to_bytes<T: Record>(rows: &[T]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(rows.len() * T::SIZE);
    rows.iter().for_each(|row| row.put(&mut bytes));
    bytes
}

/// Rows from bytes; none where the length is no multiple of a row's, or a byte has no meaning.
pub(crate) fn from_bytes<T: Record>(bytes: &[u8]) -> Option<Vec<T>> {
    if !bytes.len().is_multiple_of(T::SIZE) {
        return None;
    }
    bytes.chunks_exact(T::SIZE).map(|mut row| T::take(&mut row)).collect()
}
