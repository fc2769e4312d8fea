//! The panels over the picture: egui between the window's events and a painting. The only file beside `window.rs` that names both
//! winit and egui.

use std::sync::Arc;

use egui::{Color32, CornerRadius, FontFamily, FontId, Order, Pos2, Stroke, TextStyle, ViewportId, Visuals};
use winit::{event::WindowEvent, window::Window};

use crate::{command::Command, marks, pace::Pace, painting::Painting, panels, screen::Screen, walk::Walk};

/// Opacity of panels, 0..=255: what is behind them still shows.
const OPACITY: u8 = 215;

/// egui, and what it knows of the window.
pub(crate) struct Overlay {
    context: egui::Context,
    state: egui_winit::State,
    window: Arc<Window>,
    /// Where the cursor is, points.
    cursor: Pos2,
}

impl Overlay {
    pub fn new(window: Arc<Window>) -> Self {
        let context = egui::Context::default();
        context.set_theme(egui::Theme::Dark);
        context.set_visuals(visuals());
        context.all_styles_mut(|style| {
            for (text, size) in [
                (TextStyle::Small, 10.5),
                (TextStyle::Body, 12.0),
                (TextStyle::Button, 12.0),
                (TextStyle::Heading, 14.0),
            ] {
                style.text_styles.insert(text, FontId::new(size, FontFamily::Proportional));
            }
            style.text_styles.insert(TextStyle::Monospace, FontId::new(11.5, FontFamily::Monospace));
            style.spacing.item_spacing = egui::vec2(6.0, 4.0);
            style.spacing.slider_width = 110.0;
            style.interaction.selectable_labels = false;
            // Nothing moves by itself: a picture at rest need not be drawn again.
            style.animation_time = 0.0;
        });
        let scale = window.scale_factor() as f32;
        let state = egui_winit::State::new(context.clone(), ViewportId::ROOT, &*window, Some(scale), None, None);
        Self { context, state, window, cursor: Pos2::ZERO }
    }

    /// Notes an event: whether it is a panel's, and whether panels change by it.
    pub fn follow(&mut self, event: &WindowEvent) -> (bool, bool) {
        let response = self.state.on_window_event(&self.window, event);
        if let WindowEvent::CursorMoved { position, .. } = event {
            let scale = self.context.pixels_per_point();
            self.cursor = Pos2::new(position.x as f32, position.y as f32) / scale;
        }
        let over_panel = match event {
            WindowEvent::KeyboardInput { .. } => self.context.text_edit_focused(),
            // By where the cursor is now: what egui itself says is as old as the last frame.
            _ => {
                let layer = self.context.layer_id_at(self.cursor);
                self.context.egui_is_using_pointer() || layer.is_some_and(|layer| layer.order != Order::Background)
            }
        };
        (over_panel, response.repaint)
    }

    /// Lays the panels out over a walk; what their buttons ask for, whether they change by themselves, and how they look.
    pub fn lay_out(&mut self, walk: &mut Walk, pace: &Pace, screen: &Screen) -> (Vec<Command>, bool, Painting) {
        let mut input = self.state.take_egui_input(&self.window);
        // Tab is a key of the walk, and would else go from button to button.
        input.events.retain(|event| !matches!(event, egui::Event::Key { key: egui::Key::Tab, .. }));
        let mut commands = Vec::new();
        let mut output = self.context.run_ui(input, |ui| {
            if walk.panels {
                marks::draw(ui, walk);
                panels::lay_out(ui, walk, pace, screen, &mut commands);
            }
        });
        self.state.handle_platform_output(&self.window, std::mem::take(&mut output.platform_output));
        let changes = output.viewport_output.values().any(|viewport| viewport.repaint_delay.is_zero());
        let primitives = self.context.tessellate(std::mem::take(&mut output.shapes), output.pixels_per_point);
        let textures = std::mem::take(&mut output.textures_delta);
        (commands, changes, Painting { primitives, textures, pixels_per_point: output.pixels_per_point })
    }

    /// Puts a text on the clipboard.
    pub fn copy(&mut self, text: String) {
        self.state.set_clipboard_text(text);
    }
}

/// Dark, plain and see-through.
fn visuals() -> Visuals {
    let mut visuals = Visuals::dark();
    let panel = Color32::from_rgba_unmultiplied(20, 21, 24, OPACITY);
    (visuals.window_fill, visuals.panel_fill) = (panel, panel);
    visuals.window_stroke = Stroke::new(1.0, Color32::from_white_alpha(18));
    visuals.window_corner_radius = CornerRadius::same(6);
    visuals.window_shadow = egui::Shadow::NONE;
    visuals.popup_shadow = egui::Shadow::NONE;
    visuals.override_text_color = Some(Color32::from_gray(225));
    visuals.selection.bg_fill = Color32::from_rgb(166, 110, 32);
    visuals.selection.stroke = Stroke::new(1.0, Color32::WHITE);
    visuals
}
