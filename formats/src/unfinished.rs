//! The sections of a `.hlf` file that hold what an interrupted bake has found out. A finished bake has none of them.
//!
//! They stand behind the bake's own, so that whoever only looks at the bake need not know of them.

use scene::{Answers, Rows, Unfinished};

use crate::record::{from_bytes, to_bytes};

/// The section that an interrupted bake is known by.
pub(crate) const UNFINISHED: &str = "unfinished build";

const OPTIONS: &str = "unfinished options";
const QUESTIONS: &str = "unfinished questions";
const EMITTED: &str = "unfinished emitted";
const SKY: &str = "unfinished sky";
const ROW_LENGTHS: &str = "unfinished row lengths";
const ROWS: &str = "unfinished rows";
const RESIDUALS: &str = "unfinished residuals";

/// Names and bytes of the sections.
pub(crate) fn sections(unfinished: &Unfinished) -> [(&'static str, Vec<u8>); 8] {
    let Unfinished { build, options, answers } = unfinished;
    let lengths: Vec<u32> = answers.rows.iter().map(|row| row.len() as u32).collect();
    [
        (UNFINISHED, build.as_bytes().to_vec()),
        (OPTIONS, options.as_bytes().to_vec()),
        (QUESTIONS, to_bytes(&answers.questions)),
        (EMITTED, to_bytes(&answers.emitted)),
        (SKY, to_bytes(&answers.sky)),
        (ROW_LENGTHS, to_bytes(&lengths)),
        (ROWS, to_bytes(answers.rows.seen())),
        (RESIDUALS, to_bytes(&answers.residuals)),
    ]
}

/// What the sections hold, each got by its name; the name of one that is missing or has no meaning.
pub(crate) fn unfinished<'a>(section: impl Fn(&str) -> Option<&'a [u8]>) -> Result<Unfinished, &'static str> {
    let bytes = |name: &'static str| section(name).ok_or(name);
    let text = |name| String::from_utf8(bytes(name)?.to_vec()).map_err(|_| name);
    let lengths: Vec<u32> = from_bytes(bytes(ROW_LENGTHS)?).ok_or(ROW_LENGTHS)?;
    let answers = Answers {
        questions: from_bytes(bytes(QUESTIONS)?).ok_or(QUESTIONS)?,
        emitted: from_bytes(bytes(EMITTED)?).ok_or(EMITTED)?,
        sky: from_bytes(bytes(SKY)?).ok_or(SKY)?,
        rows: Rows::new(from_bytes(bytes(ROWS)?).ok_or(ROWS)?, &lengths).ok_or(ROW_LENGTHS)?,
        residuals: from_bytes(bytes(RESIDUALS)?).ok_or(RESIDUALS)?,
    };
    Ok(Unfinished { build: text(UNFINISHED)?, options: text(OPTIONS)?, answers })
}
