//! What holds the house: one binary of tests over the whole program.
//!
//! Pictures and bakes that several tests look at are made once, by [`fixture`].

#![allow(clippy::unwrap_used)]

mod analytic;
mod architecture;
mod browser;
mod cli;
mod closed_forms;
mod coherence;
mod continuity;
mod daylight;
mod desktop;
mod determinism;
mod environment;
mod fixture;
mod frames;
#[path = "../benches/common/generated/mod.rs"]
mod generated;
mod generated_scenes;
mod golden;
mod known_issues;
mod leaks;
mod licences;
mod long_bakes;
mod many_polygons;
mod parity;
mod readme;
mod real_scenes;
mod reference;
mod render;
mod robustness;
mod sky_bake;
mod smooth_shading;
mod textures;
mod verify;
mod web;
mod window;
