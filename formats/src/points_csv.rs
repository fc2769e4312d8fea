//! Tables of points: where irradiance is asked for, and what it is there.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;
use scene::Rgb;

use crate::FormatError;

/// The columns that a table of points must have.
const COLUMNS: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// A point of a surface where irradiance is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceQuery {
    /// Position, metres.
    pub position: DVec3,
    /// Direction of the surface's front, of any length but 0.
    pub normal: DVec3,
}

/// Reads a CSV table of points: a header that names x, y, z, nx, ny and nz in any order among other columns, which are
/// ignored. Lines that start with `#` are comments.
///
/// # Errors
/// A file that cannot be read, a missing column, or the line of a field that is missing or no finite number, or of a
/// normal without direction.
pub fn read_points(path: &Path) -> Result<Vec<SurfaceQuery>, FormatError> {
    let bytes = fs::read(path).map_err(|error| FormatError::read(path, error))?;
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).flexible(true).from_reader(bytes.as_slice());
    let header = reader.byte_headers().map_err(|error| unreadable(path, &error))?.clone();
    let mut places = [0; 6];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        *place = header.iter().position(|name| name == column.as_bytes()).ok_or_else(|| {
            let cause = format!("the header has no column {column}");
            FormatError::line(
                path,
                line_of(header.position(), &bytes),
                cause,
                "start the table with the header x,y,z,nx,ny,nz",
            )
        })?;
    }
    let mut queries = Vec::new();
    for record in reader.byte_records() {
        let record = record.map_err(|error| unreadable(path, &error))?;
        let wrong = |cause, cure| FormatError::line(path, line_of(record.position(), &bytes), cause, cure);
        let mut values = [0.0; 6];
        for ((value, place), column) in values.iter_mut().zip(places).zip(COLUMNS) {
            let field = record.get(place).map(String::from_utf8_lossy).unwrap_or_default();
            *value = field.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| {
                let short: String = field.chars().take(40).collect();
                wrong(format!("the field {column} holds {short:?}"), "write a finite decimal number, like 0.25")
            })?;
        }
        let [x, y, z, nx, ny, nz] = values;
        let query = SurfaceQuery { position: DVec3::new(x, y, z), normal: DVec3::new(nx, ny, nz) };
        if query.normal.normalize_or_zero() == DVec3::ZERO {
            return Err(wrong("the normal has no direction".to_owned(), "write the surface's normal"));
        }
        queries.push(query);
    }
    Ok(queries)
}

/// The line of a record. The library's own count stops at the comments and empty lines before it.
fn line_of(position: Option<&csv::Position>, bytes: &[u8]) -> usize {
    let (line, start) = position.map_or((1, 0), |position| (position.line() as usize, position.byte() as usize));
    let lines = bytes.get(start..).unwrap_or_default().split(|&byte| byte == b'\n');
    let before = lines.take_while(|text| text.starts_with(b"#") || text.trim_ascii().is_empty()).count();
    // In a file without any record all lines come before it.
    (line + before).min(bytes.split(|&byte| byte == b'\n').count())
}

fn unreadable(path: &Path, error: &csv::Error) -> FormatError {
    let line = error.position().map_or(1, csv::Position::line) as usize;
    FormatError::line(path, line, format!("is no CSV ({error})"), "write a comma-separated table")
}

/// Writes a CSV table x,y,z,nx,ny,nz,er,eg,eb: the queries and the irradiance there, W·m⁻², the fields empty where there
/// is none. Where irradiance is an estimate, the columns sr,sg,sb of its standard errors follow; who looks columns up
/// by name reads both tables alike. Every number reads back as the same f64.
///
/// # Errors
/// A stream that breaks, or lists of different lengths.
pub fn write_irradiance(
    mut to: impl Write,
    queries: &[SurfaceQuery],
    irradiance: &[Option<Rgb>],
    standard_errors: Option<&[Option<Rgb>]>,
) -> Result<(), FormatError> {
    if queries.len() != irradiance.len() || standard_errors.is_some_and(|errors| errors.len() != queries.len()) {
        let cause = format!("{} points have {} values", queries.len(), irradiance.len());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, cause).into());
    }
    writeln!(to, "{},er,eg,eb{}", COLUMNS.join(","), standard_errors.map_or("", |_| ",sr,sg,sb"))?;
    for (index, (query, irradiance)) in queries.iter().zip(irradiance).enumerate() {
        for value in query.position.to_array().into_iter().chain(query.normal.to_array()) {
            write!(to, "{value:?},")?;
        }
        write_colour(&mut to, irradiance)?;
        if let Some(errors) = standard_errors {
            write!(to, ",")?;
            write_colour(&mut to, &errors[index])?;
        }
        writeln!(to)?;
    }
    Ok(to.flush()?)
}

/// Three fields, empty where there is no colour.
fn write_colour(to: &mut impl Write, colour: &Option<Rgb>) -> io::Result<()> {
    match colour {
        Some(Rgb { x: r, y: g, z: b }) => write!(to, "{r:?},{g:?},{b:?}"),
        None => write!(to, ",,"),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use proptest::prelude::*;

    use super::*;

    fn read(text: &[u8]) -> Result<Vec<SurfaceQuery>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("points.csv");
        fs::write(&path, text).unwrap();
        read_points(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn wrong_tables_name_line_field_and_cause() {
        for (text, line, cause) in [
            ("", 1, "no column x"),
            ("x,y,z,nx,ny\n1,2,3,4,5\n", 1, "no column nz"),
            ("# points\nx,y,z,nx,ny,nz\n1,2,3,0,0\n", 3, "the field nz holds \"\""),
            ("x,y,z,nx,ny,nz\n1,2,3,0,0,1\n# so far so good\n1,two,3,0,0,1\n", 4, "the field y holds \"two\""),
            ("# no\n\n# header\n1,2,3,0,0,1\n", 4, "no column x"),
            ("x,y,z,nx,ny,nz\n1,2,inf,0,0,1\n", 2, "the field z holds \"inf\""),
            ("x,y,z,nx,ny,nz\n1,2,NaN,0,0,1\n", 2, "the field z"),
            ("x,y,z,nx,ny,nz\n1,2,3,0,0,0\n", 2, "no direction"),
        ] {
            let message = read(text.as_bytes()).unwrap_err();
            assert!(message.contains(&format!("points.csv, line {line}: ")), "{text:?}: {message}");
            assert!(message.contains(cause), "{text:?}: {message}");
        }
    }

    #[test]
    fn further_columns_comments_spaces_and_any_order_are_read() {
        let table = "# made for a test\nface, nz,ny,nx,z,y,x\r\n7, 1,0,0, 3,2,1\n\n# end\n8,0,2,0,6,5,4";
        let queries = read(table.as_bytes()).unwrap();
        assert_eq!(queries.len(), 2);
        assert_eq!(queries[0], SurfaceQuery { position: DVec3::new(1., 2., 3.), normal: DVec3::Z });
        assert_eq!(queries[1].normal, DVec3::Y * 2.0);
        assert_eq!(read(b"x,y,z,nx,ny,nz\n").unwrap(), []);
    }

    #[test]
    fn a_point_without_light_gets_empty_fields() {
        let query = SurfaceQuery { position: DVec3::ONE, normal: DVec3::Z };
        let mut text = Vec::new();
        write_irradiance(&mut text, &[query; 2], &[None, Some(Rgb::new(0.1, 1e-30, 3e300))], None).unwrap();
        assert!(write_irradiance(io::sink(), &[query], &[], None).is_err());
        assert!(write_irradiance(io::sink(), &[query], &[None], Some(&[])).is_err());
        let text = String::from_utf8(text).unwrap();
        let point = "1.0,1.0,1.0,0.0,0.0,1.0";
        assert_eq!(text, format!("x,y,z,nx,ny,nz,er,eg,eb\n{point},,,\n{point},0.1,1e-30,3e300\n"));
        let (mut text, light) = (Vec::new(), [None, Some(Rgb::ONE)]);
        write_irradiance(&mut text, &[query; 2], &light, Some(&[None, Some(Rgb::ZERO)])).unwrap();
        let text = String::from_utf8(text).unwrap();
        let header = "x,y,z,nx,ny,nz,er,eg,eb,sr,sg,sb";
        assert_eq!(text, format!("{header}\n{point},,,,,,\n{point},1.0,1.0,1.0,0.0,0.0,0.0\n"));
    }

    fn finite() -> impl Strategy<Value = f64> {
        any::<f64>().prop_filter("finite", |value| value.is_finite())
    }

    proptest! {
        #[test]
        fn queries_come_back_bit_for_bit(points in proptest::collection::vec([finite(), finite(), finite()], 0..20)) {
            let queries: Vec<_> = points.iter()
                .map(|&p| SurfaceQuery { position: p.into(), normal: DVec3::new(1.0, p[0].sin(), 0.1) }).collect();
            let mut text = Vec::new();
            write_irradiance(&mut text, &queries, &vec![None; queries.len()], None).unwrap();
            prop_assert_eq!(read(&text).unwrap(), queries);
        }

        #[test]
        fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300), with_header: bool) {
            let header: &[u8] = if with_header { b"x,y,z,nx,ny,nz\n" } else { b"" };
            let _ = read(&[header, &bytes].concat());
        }

        #[test]
        fn no_table_panics(text in "([0-9.,eE#\"+-]|nan|inf|\n){0,80}") {
            let _ = read(format!("x,y,z,nx,ny,nz\n{text}").as_bytes());
        }
    }
}
