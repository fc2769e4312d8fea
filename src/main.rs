//! Halflight's command line: flags → validated options → one subcommand → one exit.
//!
//! Exit codes: 0 done, 1 failed, 2 wrong usage, 3 a comparison or verification did not hold, 130 interrupted.

mod args;
mod artist;
mod bake;
mod baked_points;
mod compare;
mod environment;
mod error_map;
mod error_picture;
mod export;
mod failure;
mod frame_timing;
mod ground_truth;
mod info;
mod input;
mod interrupt;
mod light_sources;
mod memory;
mod output;
mod output_folder;
mod picture;
mod pipeline;
mod point_gather;
mod probe;
mod progress;
mod radiance;
mod refine;
mod render;
mod report;
mod resume;
mod shot;
mod sky;
mod validate;
mod verification;
mod verify;
mod view;
mod watch;

use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;

use args::{Command, Flags};
use failure::Outcome;
use interrupt::Interrupt;
use output::Outputs;
use progress::say;

/// A bake is many short lists that come and go on all threads: the allocator of glibc takes a tenth more memory and time for them.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let flags = match Flags::try_parse() {
        Ok(flags) => flags,
        Err(error) if error.use_stderr() => {
            say(error.to_string().trim_end());
            return ExitCode::from(error.exit_code() as u8);
        }
        Err(help) => {
            // To a closed pipe, too, help has been given.
            _ = help.print();
            return ExitCode::SUCCESS;
        }
    };
    let result = run(flags.command);
    if let Err(error) = &result {
        say(format_args!("error: {}", failure::sentence(error)));
    }
    failure::exit_code(&result)
}

fn run(command: Command) -> Result<Outcome> {
    let outputs = Outputs::default();
    let interrupt = Interrupt::default();
    let (held, pressed) = (outputs.clone(), interrupt.clone());
    ctrlc::set_handler(move || {
        if pressed.press() {
            return;
        }
        let _held = held.hold();
        say("interrupted; what was not finished is not kept");
        std::process::exit(i32::from(failure::INTERRUPTED));
    })
    .context("cannot listen for Ctrl-C")?;
    match command {
        Command::Bake(flags) => bake::run(&flags, &outputs, &interrupt),
        Command::Shot(flags) => shot::run(&flags, &outputs),
        Command::Render(flags) => render::run(&flags, &outputs, &interrupt),
        Command::View(flags) => view::run(&flags, &outputs),
        Command::Export(flags) => export::run(&flags, &outputs),
        Command::Probe(flags) => probe::run(&flags, &outputs),
        Command::Verify(flags) => verify::run(&flags, &outputs),
        Command::Info(flags) => info::run(&flags),
        Command::Validate(flags) => validate::run(&flags),
    }
}
