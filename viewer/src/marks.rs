//! What is drawn into the picture itself: the clicked point, lines to the sources of its light, and the halves of a split view.

use egui::{Align2, Color32, FontId, LayerId, Painter, Pos2, Rect, Stroke, Ui, Vec2, pos2, vec2};
use glam::DVec3;
use scene::{Camera, Exposure, luminance};

use crate::{FalseColorScale, LightSource, Mode, digits::Number, walk::Walk};

/// Sources that lines are drawn to at most: the weaker ones only hide the picture.
pub(crate) const SOURCES: usize = 12;

/// Depth at which lines are cut off before the eye, metres.
const NEAR: f64 = 1e-3;

/// Size of the scale of false colours, points.
const SCALE: Vec2 = vec2(130.0, 260.0);

/// Draws a walk's marks under the panels.
pub(crate) fn draw(ui: &Ui, walk: &Walk) {
    let painter = ui.ctx().layer_painter(LayerId::background());
    let screen = ui.ctx().content_rect();
    if walk.mode == Mode::Split && walk.shown.is_some() {
        let middle = screen.center().x;
        painter.vline(middle, screen.y_range(), Stroke::new(1.0, Color32::from_white_alpha(120)));
        for (text, align, gap) in [("Gouraud", Align2::RIGHT_TOP, -10.0), ("interpolants", Align2::LEFT_TOP, 10.0)] {
            let place = pos2(middle + gap, screen.top() + 8.0);
            let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(13.0), Color32::WHITE);
            let rect = align.anchor_size(place, galley.size());
            painter.rect_filled(rect.expand2(vec2(5.0, 2.0)), 3.0, Color32::from_black_alpha(140));
            painter.galley(rect.min, galley, Color32::WHITE);
        }
    }
    if walk.mode == Mode::FalseColor && walk.shown.is_some() {
        scale(&painter, screen, Exposure { ev: walk.exposure.ev });
    }
    let (Some(clicked), Some(flight)) = (&walk.clicked, &walk.flight) else { return };
    let view = View { camera: flight.camera, screen };
    let point = clicked.reading.position;
    if let Some(Ok(sources)) = &clicked.sources {
        let strongest = sources.first().map_or(0.0, |source| luminance(source.irradiance));
        // The strongest are drawn last, over the others.
        for source in sources.iter().take(SOURCES).rev() {
            let share = (luminance(source.irradiance) / strongest.max(f64::MIN_POSITIVE)) as f32;
            if walk.blockers {
                let colour = Color32::from_rgba_unmultiplied(255, 70, 150, 130);
                for outline in &source.blockers {
                    let next = outline.iter().cycle().skip(1);
                    for line in outline.iter().zip(next).filter_map(|(&a, &b)| view.line(a, b)) {
                        painter.line_segment(line, Stroke::new(1.0, colour));
                    }
                }
            }
            if let (true, Some(line)) = (walk.lines, source.middle.and_then(|middle| view.line(point, middle))) {
                painter.line_segment(line, Stroke::new(3.0 + 2.0 * share.sqrt(), Color32::from_black_alpha(90)));
                painter.line_segment(line, Stroke::new(1.0 + 2.0 * share.sqrt(), colour_of(source)));
            }
        }
    }
    if let Some(place) = view.place(point) {
        painter.circle_stroke(place, 6.0, Stroke::new(3.0, Color32::from_black_alpha(160)));
        painter.circle_stroke(place, 6.0, Stroke::new(1.5, Color32::WHITE));
    }
}

/// Draws what false colours mean into the lower right corner.
fn scale(painter: &Painter, screen: Rect, exposure: Exposure) {
    let ground = Rect::from_min_max(screen.max - SCALE - vec2(10.0, 10.0), screen.max - vec2(10.0, 10.0));
    painter.rect_filled(ground, 4.0, Color32::from_black_alpha(170));
    let ramp = Rect::from_center_size(ground.center() + vec2(0.0, 8.0), vec2(18.0, SCALE.y - 36.0));
    let font = || FontId::proportional(11.0);
    for (text, align, x) in [("lx", Align2::RIGHT_TOP, ramp.left()), ("W/m²", Align2::LEFT_TOP, ramp.right())] {
        let gap = if x == ramp.left() { -6.0 } else { 6.0 };
        painter.text(pos2(x + gap, ground.top() + 5.0), align, text, font(), Color32::WHITE);
    }
    let rows = ramp.height() as u32;
    for row in 0..rows {
        let [r, g, b] = FalseColorScale::colour(1.0 - (f64::from(row) + 0.5) / f64::from(rows));
        let stroke = Stroke::new(1.0, Color32::from_rgb(r, g, b));
        painter.hline(ramp.x_range(), ramp.top() + row as f32 + 0.5, stroke);
    }
    for line in FalseColorScale::new(exposure).isolines() {
        let y = ramp.bottom() - line.place as f32 * ramp.height();
        let text = |x, align, number| {
            painter.text(pos2(x, y), align, format!("{:.3}", Number(number)), font(), Color32::WHITE)
        };
        painter.hline(ramp.left() - 4.0..=ramp.left(), y, Stroke::new(1.0, Color32::WHITE));
        text(ramp.left() - 6.0, Align2::RIGHT_CENTER, line.lux);
        text(ramp.right() + 6.0, Align2::LEFT_CENTER, line.irradiance);
    }
}

/// Lamps are yellow, reflectors blue.
pub(crate) fn colour_of(source: &LightSource) -> Color32 {
    if source.emits { Color32::from_rgb(255, 200, 70) } else { Color32::from_rgb(110, 180, 255) }
}

/// A camera whose picture fills the screen.
struct View {
    camera: Camera,
    screen: Rect,
}

impl View {
    /// Right, up and ahead of the eye, metres.
    fn seen_from_eye(&self, point: DVec3) -> DVec3 {
        let (right, up, forward) = self.camera.basis();
        let way = point - self.camera.eye;
        DVec3::new(way.dot(right), way.dot(up), way.dot(forward))
    }

    /// Where a point ahead of the eye is seen.
    fn on_screen(&self, p: DVec3) -> Pos2 {
        let scale = f64::from(self.screen.height()) / (2.0 * (self.camera.vertical_fov / 2.0).tan() * p.z);
        self.screen.center() + vec2((p.x * scale) as f32, (-p.y * scale) as f32)
    }

    fn place(&self, point: DVec3) -> Option<Pos2> {
        let p = self.seen_from_eye(point);
        (p.z > NEAR).then(|| self.on_screen(p))
    }

    /// The part of a line that is ahead of the eye.
    fn line(&self, a: DVec3, b: DVec3) -> Option<[Pos2; 2]> {
        let (a, b) = (self.seen_from_eye(a), self.seen_from_eye(b));
        if a.z.max(b.z) <= NEAR {
            return None;
        }
        let cut = |from: DVec3, to: DVec3| {
            if from.z > NEAR { from } else { from + (to - from) * ((NEAR - from.z) / (to.z - from.z)) }
        };
        Some([self.on_screen(cut(a, b)), self.on_screen(cut(b, a))])
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::test_room::camera;

    #[test]
    fn a_point_is_marked_where_its_ray_is() {
        let view = View { camera: camera(), screen: Rect::from_min_size(Pos2::ZERO, vec2(320.0, 200.0)) };
        for (x, y) in [(0.0, 0.0), (160.0, 100.0), (300.5, 12.25)] {
            let point = camera().ray(glam::DVec2::new(x, y), 320, 200).at(2.5);
            let place = view.place(point).unwrap();
            assert!((place - pos2(x as f32, y as f32)).length() < 1e-3, "{place:?}");
        }
    }

    #[test]
    fn lines_are_cut_off_before_the_eye() {
        let view = View { camera: camera(), screen: Rect::from_min_size(Pos2::ZERO, vec2(320.0, 200.0)) };
        let (.., forward) = camera().basis();
        let (ahead, behind) = (camera().eye + forward, camera().eye - forward);
        assert_eq!((view.place(behind), view.line(behind, behind - forward)), (None, None));
        let [from, to] = view.line(ahead, behind).unwrap();
        assert!((from - pos2(160.0, 100.0)).length() < 1e-2 && to.x.is_finite() && to.y.is_finite());
    }
}
