//! The panels over the picture: egui between the window's events and a painting. The only file beside `window.rs` that names both
//! winit and egui.

use std::sync::Arc;

use egui::{
    Color32, ColorImage, CornerRadius, FontFamily, FontId, LayerId, Order, Pos2, Rect, Stroke, TextStyle,
    TextureHandle, TextureOptions, ViewportId, Visuals,
};
use winit::{event::WindowEvent, window::Window};

use crate::{
    Refined,
    command::Command,
    marks,
    pace::Pace,
    painting::Painting,
    panels::{self, Seen},
    screen::Screen,
    walk::Walk,
};

/// Opacity of panels, 0..=255: what is behind them still shows.
const OPACITY: u8 = 215;

/// egui, and what it knows of the window.
pub(crate) struct Overlay {
    context: egui::Context,
    state: egui_winit::State,
    window: Arc<Window>,
    /// Where the cursor is, points.
    cursor: Pos2,
    /// The longest side of a texture, texels.
    largest_texture: usize,
    /// The finer picture that was painted last.
    refined: Option<(Arc<Refined>, TextureHandle)>,
}

impl Overlay {
    /// The panels of a window, where a texture has so many texels to a side at most.
    pub fn new(window: Arc<Window>, largest_texture: usize) -> Self {
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
        let state = egui_winit::State::new(
            context.clone(),
            ViewportId::ROOT,
            &*window,
            Some(scale),
            None,
            Some(largest_texture),
        );
        Self { context, state, window, cursor: Pos2::ZERO, largest_texture, refined: None }
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

    /// Lays the panels out over a walk, and a finer picture of a size in pixels below them; what their buttons ask for, whether
    /// they change by themselves, and how they look.
    pub fn lay_out(
        &mut self,
        walk: &mut Walk,
        pace: &Pace,
        screen: &Screen,
        refined: Option<((u32, u32), &Arc<Refined>)>,
    ) -> (Vec<Command>, bool, Painting) {
        self.load(refined);
        let mut input = self.state.take_egui_input(&self.window);
        // Tab is a key of the walk, and would else go from button to button.
        input.events.retain(|event| !matches!(event, egui::Event::Key { key: egui::Key::Tab, .. }));
        let mut commands = Vec::new();
        let finer = self.refined.as_ref();
        let mut output = self.context.run_ui(input, |ui| {
            if let Some((_, texture)) = finer {
                // Texel by pixel, whatever a point is.
                let area = Rect::from_min_size(Pos2::ZERO, texture.size_vec2() / ui.ctx().pixels_per_point());
                let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
                ui.ctx().layer_painter(LayerId::background()).image(texture.id(), area, whole, Color32::WHITE);
            }
            if walk.panels {
                marks::draw(ui, walk);
                let refined = finer.map(|(refined, _)| refined.as_ref());
                panels::lay_out(ui, walk, &Seen { pace, screen, refined }, &mut commands);
            }
        });
        self.state.handle_platform_output(&self.window, std::mem::take(&mut output.platform_output));
        let changes = output.viewport_output.values().any(|viewport| viewport.repaint_delay.is_zero());
        let primitives = self.context.tessellate(std::mem::take(&mut output.shapes), output.pixels_per_point);
        let textures = std::mem::take(&mut output.textures_delta);
        (commands, changes, Painting { primitives, textures, pixels_per_point: output.pixels_per_point })
    }

    /// Makes a texture of a finer picture, unless it is the one that there is.
    fn load(&mut self, refined: Option<((u32, u32), &Arc<Refined>)>) {
        let Some(((width, height), refined)) = refined else {
            self.refined = None;
            return;
        };
        let is_loaded = self.refined.as_ref().is_some_and(|(loaded, _)| Arc::ptr_eq(loaded, refined));
        let size = [width as usize, height as usize];
        let fits = size[0] * size[1] == refined.pixels.len() && size[0].max(size[1]) <= self.largest_texture;
        if is_loaded || !fits {
            return;
        }
        let pixels = refined.pixels.iter().map(|&[r, g, b]| Color32::from_rgb(r, g, b)).collect();
        let texture = self.context.load_texture("refined", ColorImage::new(size, pixels), TextureOptions::NEAREST);
        self.refined = Some((refined.clone(), texture));
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
