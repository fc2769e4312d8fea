//! `halflight validate`: the program's own light beside closed forms.
//!
//! Every case has its formula and source beside it, is computed by the code that bakes and probes, and has a bound: 1e-6
//! relative where nothing is interpolated, and where light goes through a solve or a bake what its group says.

mod blocked_light;
mod cie171;
mod closed_form;
mod enclosures;
mod room;
mod view_factors;

use std::io::Write;

use anyhow::{Context, Result};
use serde::Serialize;

use crate::args::ValidateFlags;
use crate::failure::Outcome;
use crate::pipeline::PROGRAM;
use crate::progress::{Stage, say};
use crate::report::print_json;

/// Bound, relative, of what is computed without interpolation: far above the rounding of f64, far below what shows.
const EXACT: f64 = 1e-6;

/// Computes all cases and prints them.
pub fn run(flags: &ValidateFlags) -> Result<Outcome> {
    let cases = all_cases();
    let outside: Vec<String> =
        cases.iter().filter(|case| !case.holds()).map(|case| format!("{}: {}", case.group, case.name)).collect();
    if flags.json {
        print_json(&Report::of(&cases, outside.is_empty()))?;
    } else {
        std::io::stdout().lock().write_all(table(&cases).as_bytes()).context("cannot write to stdout")?;
    }
    if outside.is_empty() {
        return Ok(Outcome::Done);
    }
    say(format_args!(
        "{} of {} cases lie outside their bounds: {}; this build computes wrong light: build another, or report the table",
        outside.len(),
        cases.len(),
        outside.join(", ")
    ));
    Ok(Outcome::Differs)
}

/// Every case, group by group.
fn all_cases() -> Vec<Case> {
    const PARTS: [fn() -> Vec<Case>; 4] = [view_factors::cases, blocked_light::cases, enclosures::cases, cie171::cases];
    let stage = Stage::start("validate");
    let mut cases = Vec::new();
    for (done, part) in (1..).zip(PARTS) {
        cases.extend(part());
        stage.advance(f64::from(done) / PARTS.len() as f64);
    }
    stage.end();
    cases
}

/// What the cases of a group share.
#[derive(Clone, Copy, Debug)]
struct Group {
    /// What is computed, with its unit where it has one.
    name: &'static str,
    /// Where the formula is from.
    source: &'static str,
    /// Largest error that is accepted, relative.
    bound: f64,
}

impl Group {
    fn case(&self, name: impl ToString, published: impl Into<Option<f64>>, exact: f64, ours: f64) -> Case {
        let &Self { name: group, source, bound } = self;
        Case { group, name: name.to_string(), source, published: published.into(), exact, ours, bound }
    }
}

/// One number that has a closed form.
#[derive(Clone, Debug, PartialEq)]
struct Case {
    group: &'static str,
    name: String,
    source: &'static str,
    /// As its source prints it, with the digits it has.
    published: Option<f64>,
    /// By the formula.
    exact: f64,
    /// By the program.
    ours: f64,
    bound: f64,
}

impl Case {
    /// Relative to the exact value; where that is 0, the value itself.
    fn error(&self) -> f64 {
        let difference = (self.ours - self.exact).abs();
        if self.exact == 0.0 { difference } else { difference / self.exact.abs() }
    }

    /// Whether the error is within the bound; never for what is not a number.
    fn holds(&self) -> bool {
        self.error() <= self.bound
    }
}

#[derive(Serialize)]
struct Report {
    program: &'static str,
    /// Whether every case is within its bound.
    holds: bool,
    cases: Vec<CaseReport>,
}

#[derive(Serialize)]
struct CaseReport {
    group: &'static str,
    name: String,
    source: &'static str,
    /// Null where nothing was published.
    published: Option<f64>,
    exact: f64,
    /// Null where the program found no number.
    ours: f64,
    error: f64,
    bound: f64,
    holds: bool,
}

impl Report {
    fn of(cases: &[Case], holds: bool) -> Self {
        let report = |case: &Case| CaseReport {
            group: case.group,
            name: case.name.clone(),
            source: case.source,
            published: case.published,
            exact: case.exact,
            ours: case.ours,
            error: case.error(),
            bound: case.bound,
            holds: case.holds(),
        };
        Self { program: PROGRAM, holds, cases: cases.iter().map(report).collect() }
    }
}

/// The cases as a person reads them.
fn table(cases: &[Case]) -> String {
    let row = |name: &str, numbers: [String; 3], error: &str| {
        let [published, exact, ours] = numbers;
        format!("  {name:<34}{published:>14}{exact:>15}{ours:>15}{error:>10}")
    };
    let headings = ["published", "exact", "ours"].map(str::to_owned);
    let mut text = row("", headings, "error") + "\n";
    for group in cases.chunk_by(|a, b| a.group == b.group) {
        let first = &group[0];
        text += &format!("{} ({}), within {:e}\n", first.group, first.source, first.bound);
        for case in group {
            let numbers = [
                case.published.map(|value| value.to_string()).unwrap_or_default(),
                ten_digits(case.exact),
                ten_digits(case.ours),
            ];
            let mark = if case.holds() { "" } else { "  outside" };
            text += &(row(&case.name, numbers, &format!("{:.1e}", case.error())) + mark + "\n");
        }
    }
    let within = cases.iter().filter(|case| case.holds()).count();
    text + &format!("{within} of {} cases agree with the closed form, each within its bound\n", cases.len())
}

/// A number with ten significant digits or, from 1 on downwards, decimals, as many as the catalogues print.
fn ten_digits(value: f64) -> String {
    let digits = value.abs().log10().floor().max(-1.0);
    format!("{value:.*}", (9.0 - digits).clamp(0.0, 10.0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUP: Group = Group { name: "rooms", source: "by hand", bound: 0.1 };

    #[test]
    fn an_error_is_relative_but_for_zero() {
        assert_eq!(GROUP.case("a", None, 4.0, 5.0).error(), 0.25);
        assert_eq!(GROUP.case("a", None, 0.0, 0.05).error(), 0.05);
        assert!(GROUP.case("a", None, 0.0, 0.05).holds() && !GROUP.case("a", None, 0.0, 0.2).holds());
        assert!(!GROUP.case("a", None, 1.0, f64::NAN).holds());
        assert!(!GROUP.case("a", None, f64::NAN, 1.0).holds());
    }

    #[test]
    fn the_table_has_every_group_once_and_marks_what_is_outside() {
        let cases = [GROUP.case("small", 0.1, 0.1, 0.1), GROUP.case("large", None, 100.0, 150.0)];
        let text = table(&cases);
        assert_eq!(text.matches("rooms (by hand), within 1e-1\n").count(), 1, "{text}");
        assert!(text.contains("5.0e-1  outside\n") && text.contains("\n1 of 2 cases"), "{text}");
    }

    #[test]
    fn numbers_have_ten_digits() {
        assert_eq!(ten_digits(0.199_824_895_7), "0.1998248957");
        assert_eq!(ten_digits(-105.781_234_567_89), "-105.7812346");
        assert_eq!((ten_digits(0.0), ten_digits(1.5e-7)), ("0.0000000000".into(), "0.0000001500".into()));
        assert_eq!(ten_digits(1e12), "1000000000000");
        assert_eq!((ten_digits(f64::NAN), ten_digits(f64::INFINITY)), ("NaN".into(), "inf".into()));
    }
}
