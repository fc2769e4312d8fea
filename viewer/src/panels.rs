//! The panels: what is shown and how on the left, the light at a clicked point on the right, notices below.

use std::f64::consts::PI;

use egui::{Align2, Area, Color32, Frame, Grid, Id, ProgressBar, RichText, Slider, Ui, Window, vec2};
use scene::{LUMINOUS_EFFICACY, Rgb, ToneCurve, luminance};

use crate::{
    Mode, PictureKind, Refined,
    command::{Command, KEYS},
    digits::{Number, colour, place},
    marks::{self, colour_of},
    pace::{PARTS, Pace},
    recording::Recording,
    screen::Screen,
    walk::{Clicked, Walk},
};

/// Widths of the panels, points: as narrow as their numbers are legible in.
const LEFT: f32 = 214.0;
const RIGHT: f32 = 250.0;

/// Distance of the panels from the window's borders, points.
const MARGIN: f32 = 8.0;

/// Exposure values that the slider reaches, and the keys.
const EVS: std::ops::RangeInclusive<f32> = -12.0..=12.0;
const GREYS: std::ops::RangeInclusive<f64> = 0.02..=0.8;

/// What is seen beside the walk.
pub(crate) struct Seen<'a> {
    pub pace: &'a Pace,
    pub screen: &'a Screen,
    /// The finer picture, where there is one.
    pub refined: Option<&'a Refined>,
}

/// Lays out all panels; what their buttons ask for is added to `commands`.
pub(crate) fn lay_out(ui: &mut Ui, walk: &mut Walk, seen: &Seen<'_>, commands: &mut Vec<Command>) {
    panel("view", Align2::LEFT_TOP).show(ui.ctx(), |ui| {
        ui.set_width(LEFT);
        work(ui, walk);
        speed(ui, walk, seen);
        ui.separator();
        mode(ui, walk);
        refinement(ui, walk, seen, commands);
        brightness(ui, walk, commands);
        ui.separator();
        cameras(ui, walk, commands);
    });
    if let Some(clicked) = &walk.clicked {
        let (mut lines, mut blockers) = (walk.lines, walk.blockers);
        panel("light", Align2::RIGHT_TOP).show(ui.ctx(), |ui| {
            ui.set_width(RIGHT);
            light(ui, clicked);
            sources(ui, clicked, &mut lines, &mut blockers);
        });
        (walk.lines, walk.blockers) = (lines, blockers);
    }
    if walk.help {
        panel("keys", Align2::CENTER_CENTER).show(ui.ctx(), |ui| {
            Grid::new("keys").num_columns(2).spacing([16.0, 3.0]).show(ui, |ui| {
                for (key, does) in KEYS {
                    ui.monospace(key);
                    ui.label(does);
                    ui.end_row();
                }
            });
        });
    }
    notice(ui, walk);
}

fn panel(name: &'static str, corner: Align2) -> Window<'static> {
    let away = vec2(-corner.x().to_sign(), -corner.y().to_sign()) * MARGIN;
    Window::new(name).title_bar(false).resizable(false).movable(false).anchor(corner, away)
}

fn faint(text: impl Into<String>) -> RichText {
    RichText::new(text).color(Color32::from_gray(150)).small()
}

/// What is being done outside, with how much of it.
fn work(ui: &mut Ui, walk: &Walk) {
    if let Some((stage, part)) = walk.work {
        let text = format!("{stage}  {:.0} %", 100.0 * part);
        ui.add(ProgressBar::new(part as f32).text(RichText::new(text).small()).desired_height(14.0));
    }
}

/// Whether the picture is refined at rest, and how far it is.
fn refinement(ui: &mut Ui, walk: &Walk, seen: &Seen<'_>, commands: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        if ui.selectable_label(walk.refines, "refines at rest").on_hover_text("V").clicked() {
            commands.push(Command::ToggleRefinement);
        }
        if let Some(refined) = seen.refined {
            let (known, samples) = (100.0 * refined.known, refined.samples_a_pixel);
            ui.label(faint(format!("{known:.0} %, {samples:.2} a pixel")));
        }
    });
}

fn speed(ui: &mut Ui, walk: &Walk, seen: &Seen<'_>) {
    let Seen { pace, screen, .. } = seen;
    if let Some(shown) = &walk.shown {
        let baked = &shown.baked;
        ui.label(format!("{} triangles", grouped(baked.triangles.len())));
        ui.label(faint(if baked.error.points > 0 {
            format!("error {:.2} % rms, {:.2} % at 99 %", 100.0 * baked.error.rms, 100.0 * baked.error.p99)
        } else {
            "error not measured".to_owned()
        }));
    }
    if let Some((frame, parts)) = pace.medians() {
        let ms = |time: std::time::Duration| 1000.0 * time.as_secs_f64();
        ui.label(format!("{:.1} ms a frame, {:.0} frames/s", ms(frame), 1.0 / frame.as_secs_f64().max(1e-6)));
        let parts: Vec<String> =
            PARTS.iter().zip(parts).map(|(name, part)| format!("{name} {:.1}", ms(part))).collect();
        ui.label(faint(parts.join("   ")));
    }
    for (name, part) in screen.parts() {
        ui.label(faint(format!("{:.1} ms  {}", part, name.replace('_', " ").replace('+', ", "))));
    }
    let drawn_by = screen.name();
    let name = drawn_by.split(" (").next().unwrap_or(&drawn_by);
    ui.label(faint(name)).on_hover_text(drawn_by.as_str());
}

/// A number with spaces between its thousands.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = (0..digits.len())
        .step_by(3)
        .rev()
        .map(|end| &digits[digits.len().saturating_sub(end + 3)..digits.len() - end])
        .collect();
    groups.join("\u{2009}")
}

fn mode(ui: &mut Ui, walk: &mut Walk) {
    Grid::new("modes").num_columns(2).min_col_width(LEFT / 2.0 - 6.0).spacing([4.0, 1.0]).show(ui, |ui| {
        for (number, mode) in Mode::ALL.into_iter().enumerate() {
            ui.selectable_value(&mut walk.mode, mode, mode.name()).on_hover_text(format!("F{}", number + 1));
            if number % 2 == 1 {
                ui.end_row();
            }
        }
    });
}

fn brightness(ui: &mut Ui, walk: &mut Walk, commands: &mut Vec<Command>) {
    ui.separator();
    let exposure = &mut walk.exposure;
    ui.horizontal(|ui| {
        if ui.selectable_label(exposure.metered, "metered").on_hover_text("X").clicked() {
            commands.push(Command::ToggleMetering);
        }
        ui.label(faint(format!("EV {:+.2}", exposure.ev)));
    });
    if exposure.metered {
        ui.add(Slider::new(&mut exposure.key, GREYS).logarithmic(true).fixed_decimals(2).text("key"));
    } else {
        ui.add(Slider::new(&mut exposure.ev, EVS).fixed_decimals(2).text("EV"));
    }
    ui.horizontal(|ui| {
        for curve in ToneCurve::ALL {
            ui.selectable_value(&mut walk.curve, curve, curve.name()).on_hover_text("T");
        }
    });
}

fn cameras(ui: &mut Ui, walk: &mut Walk, commands: &mut Vec<Command>) {
    let stored = walk.cameras.iter().enumerate().filter_map(|(number, stored)| Some((number, stored.as_ref()?)));
    for (number, stored) in stored {
        let here = walk.flight.is_some_and(|flight| flight.camera == stored.camera);
        if ui.selectable_label(here, format!("{}  {}", number + 1, stored.name)).clicked() {
            commands.push(Command::Visit(number));
        }
    }
    ui.horizontal(|ui| {
        if ui
            .selectable_label(walk.orbits, if walk.orbits { "goes around" } else { "flies" })
            .on_hover_text("O")
            .clicked()
        {
            commands.push(Command::ToggleOrbit);
        }
        if let Some(flight) = walk.flight {
            ui.label(faint(format!("{:.2} m/s", flight.speed)));
        }
        let recorded = walk.recording.as_ref().map(Recording::seconds);
        let text = recorded.map_or_else(|| "record".to_owned(), |seconds| format!("{seconds:.1} s recorded"));
        if ui.selectable_label(recorded.is_some(), text).on_hover_text("the camera's path, into a file: R").clicked() {
            commands.push(Command::Record);
        }
    });
    ui.horizontal(|ui| {
        let buttons = [
            ("camera", "copy the camera as flags of halflight shot: C", Command::CopyCamera),
            ("PNG", "picture as displayed: P", Command::Save(PictureKind::Png)),
            ("EXR", "picture of radiance: Shift P", Command::Save(PictureKind::Exr)),
            ("keys", "H", Command::ToggleHelp),
        ];
        for (text, hover, command) in buttons {
            if ui.small_button(text).on_hover_text(hover).clicked() {
                commands.push(command);
            }
        }
    });
}

/// What the bake says of the clicked point.
fn light(ui: &mut Ui, clicked: &Clicked) {
    let reading = &clicked.reading;
    ui.label(RichText::new(format!("{:.4} lx", Number(reading.illuminance()))).heading());
    ui.label(faint(format!("at {LUMINOUS_EFFICACY:.0} lm/W, as Radiance counts")));
    Grid::new("light").num_columns(2).spacing([8.0, 2.0]).show(ui, |ui| {
        let mut row = |name: &str, value: String| {
            ui.label(faint(name));
            ui.label(value);
            ui.end_row();
        };
        row("irradiance", format!("{} W/m²", colour(reading.irradiance)));
        row("radiosity", format!("{} W/m²", colour(reading.radiosity())));
        row("radiance", format!("{} W/(sr m²)", colour(reading.radiosity() / PI)));
        row("luminance", format!("{:.4} cd/m²", Number(reading.luminance())));
        row("reflectance", colour(reading.reflectance));
        row("error here", reading.error.map_or("not measured".into(), |error| format!("{:.2} %", 100.0 * error)));
        row("material", reading.material.clone());
        row("object", reading.object.clone());
        row("leaf", format!("{} of polygon {}", reading.leaf, reading.polygon));
        row("triangle", reading.point.triangle.to_string());
        row("place", format!("{} m", place(reading.position, 3, "  ")));
    });
}

/// What the light at the clicked point is made of.
fn sources(ui: &mut Ui, clicked: &Clicked, lines: &mut bool, blockers: &mut bool) {
    ui.separator();
    let sources = match &clicked.sources {
        None => {
            ui.label(faint("finding the sources …"));
            return;
        }
        Some(Err(why)) => {
            ui.label(faint(why.as_str()));
            return;
        }
        Some(Ok(sources)) => sources,
    };
    let lux = |irradiance: Rgb| LUMINOUS_EFFICACY * luminance(irradiance);
    let total = lux(sources.iter().map(|source| source.irradiance).sum());
    ui.horizontal(|ui| {
        ui.checkbox(lines, "lines").on_hover_text("L");
        ui.checkbox(blockers, "blockers");
    });
    Grid::new("sources").num_columns(3).spacing([8.0, 1.0]).show(ui, |ui| {
        let mut row = |name: RichText, lux: f64| {
            ui.label(name);
            ui.label(format!("{:.1} %", 100.0 * lux / total.max(f64::MIN_POSITIVE)));
            ui.label(format!("{:.3} lx", Number(lux)));
            ui.end_row();
        };
        for source in sources.iter().take(marks::SOURCES) {
            row(RichText::new(short(&source.name)).color(colour_of(source)), lux(source.irradiance));
        }
        if sources.len() > marks::SOURCES {
            let rest = sources.iter().skip(marks::SOURCES).map(|source| lux(source.irradiance)).sum();
            row(faint(format!("{} more", sources.len() - marks::SOURCES)), rest);
        }
        row(faint("gathered here"), total);
    });
}

/// The beginning of a name that is too long for its column.
fn short(name: &str) -> String {
    const LONGEST: usize = 22;
    if name.chars().count() <= LONGEST {
        name.to_owned()
    } else {
        name.chars().take(LONGEST - 1).chain(['…']).collect()
    }
}

fn notice(ui: &mut Ui, walk: &mut Walk) {
    let Some(said) = &walk.notice else { return };
    let area = Area::new(Id::unique("notice")).anchor(Align2::LEFT_BOTTOM, vec2(MARGIN, -MARGIN));
    let mut is_read = false;
    area.show(ui.ctx(), |ui| {
        Frame::window(ui.style()).show(ui, |ui| {
            ui.set_max_width(560.0);
            ui.horizontal_top(|ui| {
                is_read = ui.small_button("×").clicked();
                ui.label(said.as_str());
            });
        });
    });
    if is_read {
        walk.notice = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_grouped() {
        let written = [0, 12, 123, 1234, 1_234_567].map(|number| grouped(number).replace('\u{2009}', " "));
        assert_eq!(written, ["0", "12", "123", "1 234", "1 234 567"]);
    }

    #[test]
    fn long_names_are_cut_between_letters() {
        assert_eq!(short("plinth"), "plinth");
        assert_eq!(short("Leuchtkörper über dem großen Tisch").chars().count(), 22);
    }
}
