//! What the hands hold and have done: window events, gathered into the steering of the next step.

use glam::{DVec2, DVec3};
use winit::{
    event::{KeyEvent, MouseButton, MouseScrollDelta, WindowEvent},
    keyboard::{KeyCode, PhysicalKey},
};

use crate::controls::Steering;

/// Pixels of a touchpad that count as one notch of a wheel.
const PIXELS_PER_NOTCH: f64 = 40.0;

/// Pixels that the cursor may move between press and release of a click: a hand is not still.
const CLICK: f64 = 4.0;

/// What the hands hold and have done since the last step.
#[derive(Default)]
pub(crate) struct Hands {
    keys: Vec<KeyCode>,
    /// Whether the left and the right button are held, and began over the picture.
    left: bool,
    right: bool,
    cursor: Option<DVec2>,
    /// Where the left button was pressed, while that may still become a click.
    pressed: Option<DVec2>,
    click: Option<DVec2>,
    look: DVec2,
    wheel: f64,
}

/// What a mouse in motion does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Drag {
    #[default]
    None,
    Left,
    Right,
}

impl Hands {
    /// Notes an event; `over_panel` where it is a panel's.
    pub fn follow(&mut self, event: &WindowEvent, over_panel: bool) {
        match event {
            &WindowEvent::KeyboardInput {
                event: KeyEvent { physical_key: PhysicalKey::Code(key), state, .. }, ..
            } => {
                self.keys.retain(|&held| held != key);
                if state.is_pressed() && !over_panel {
                    self.keys.push(key);
                }
            }
            WindowEvent::MouseInput { state, button, .. } => {
                let held = state.is_pressed() && !over_panel;
                match button {
                    MouseButton::Left => {
                        self.left = held;
                        let pressed = self.pressed.take();
                        if held {
                            self.pressed = self.cursor;
                        } else if !state.is_pressed() {
                            self.click = pressed;
                        }
                    }
                    MouseButton::Right => self.right = held,
                    _ => {}
                }
            }
            WindowEvent::CursorMoved { position, .. } => {
                let cursor = DVec2::new(position.x, position.y);
                let last = self.cursor.replace(cursor).unwrap_or(cursor);
                if self.pressed.is_some_and(|pressed| pressed.distance(cursor) > CLICK) {
                    self.pressed = None;
                }
                if self.drag() != Drag::None && self.pressed.is_none() {
                    self.look += cursor - last;
                }
            }
            WindowEvent::MouseWheel { delta, .. } if !over_panel => {
                self.wheel += match delta {
                    MouseScrollDelta::LineDelta(_, lines) => f64::from(*lines),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_NOTCH,
                };
            }
            // What is let go elsewhere is never reported.
            WindowEvent::Focused(false) => *self = Self { cursor: self.cursor, ..Self::default() },
            _ => {}
        }
    }

    /// Which button turns the view.
    pub fn drag(&self) -> Drag {
        match (self.left, self.right) {
            (_, true) => Drag::Right,
            (true, false) => Drag::Left,
            (false, false) => Drag::None,
        }
    }

    /// Where the picture was clicked since the last call, pixels.
    pub fn take_click(&mut self) -> Option<DVec2> {
        self.click.take()
    }

    /// Whether Shift and Ctrl are held.
    pub fn modifiers(&self) -> (bool, bool) {
        (
            self.holds(&[KeyCode::ShiftLeft, KeyCode::ShiftRight]),
            self.holds(&[KeyCode::ControlLeft, KeyCode::ControlRight]),
        )
    }

    /// The steering since the last call, in place; keys stay held.
    pub fn take_steering(&mut self) -> Steering {
        let axis = |plus: &[KeyCode], minus: &[KeyCode]| f64::from(self.holds(plus)) - f64::from(self.holds(minus));
        let motion = DVec3::new(
            axis(&[KeyCode::KeyD, KeyCode::ArrowRight], &[KeyCode::KeyA, KeyCode::ArrowLeft]),
            axis(&[KeyCode::KeyE, KeyCode::PageUp], &[KeyCode::KeyQ, KeyCode::PageDown]),
            axis(&[KeyCode::KeyW, KeyCode::ArrowUp], &[KeyCode::KeyS, KeyCode::ArrowDown]),
        );
        let (fast, slow) = self.modifiers();
        let (look, wheel) = (std::mem::take(&mut self.look), std::mem::take(&mut self.wheel));
        Steering { motion, look, around: None, wheel, fast, slow }
    }

    fn holds(&self, keys: &[KeyCode]) -> bool {
        keys.iter().any(|key| self.keys.contains(key))
    }
}

#[cfg(test)]
mod tests {
    use winit::{dpi::PhysicalPosition, event::DeviceId, event::ElementState};

    use super::*;

    fn button(hands: &mut Hands, button: MouseButton, state: ElementState, over_panel: bool) {
        hands.follow(&WindowEvent::MouseInput { device_id: DeviceId::dummy(), state, button }, over_panel);
    }

    fn cursor(hands: &mut Hands, x: f64, y: f64) {
        let position = PhysicalPosition::new(x, y);
        hands.follow(&WindowEvent::CursorMoved { device_id: DeviceId::dummy(), position }, false);
    }

    #[test]
    fn a_short_way_is_a_click_and_a_long_one_turns_the_view() {
        let mut hands = Hands::default();
        cursor(&mut hands, 100.0, 100.0);
        button(&mut hands, MouseButton::Left, ElementState::Pressed, false);
        cursor(&mut hands, 102.0, 101.0);
        button(&mut hands, MouseButton::Left, ElementState::Released, false);
        assert_eq!(hands.take_click(), Some(DVec2::new(100.0, 100.0)));
        assert_eq!((hands.take_click(), hands.take_steering().look), (None, DVec2::ZERO));
        button(&mut hands, MouseButton::Left, ElementState::Pressed, false);
        cursor(&mut hands, 142.0, 81.0);
        assert_eq!((hands.drag(), hands.take_steering().look), (Drag::Left, DVec2::new(40.0, -20.0)));
        button(&mut hands, MouseButton::Left, ElementState::Released, false);
        assert_eq!((hands.drag(), hands.take_click()), (Drag::None, None));
    }

    #[test]
    fn what_is_a_panels_moves_nothing_and_what_is_let_go_elsewhere_is_let_go() {
        let mut hands = Hands::default();
        cursor(&mut hands, 10.0, 10.0);
        button(&mut hands, MouseButton::Left, ElementState::Pressed, true);
        cursor(&mut hands, 90.0, 10.0);
        button(&mut hands, MouseButton::Left, ElementState::Released, true);
        assert_eq!((hands.take_click(), hands.take_steering()), (None, Steering::default()));
        button(&mut hands, MouseButton::Right, ElementState::Pressed, false);
        hands.follow(&WindowEvent::Focused(false), false);
        assert_eq!(hands.drag(), Drag::None);
    }
}
