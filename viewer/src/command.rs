//! What a walk is told to do, and the keys that say it.

use winit::keyboard::KeyCode;

use crate::{Mode, PictureKind};

/// Something that a key or a button asks for once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Command {
    /// Shows a mode.
    Show(Mode),
    /// Shows the mode after the present one.
    NextMode,
    /// Goes to the camera of a number from 0.
    Visit(usize),
    /// Stores the present camera under a number from 0.
    Store(usize),
    /// Brings what was clicked, or all of the scene, into the picture.
    Frame,
    /// Changes between flying and going around a point.
    ToggleOrbit,
    /// Copies the camera to the clipboard.
    CopyCamera,
    /// Writes a picture of the view.
    Save(PictureKind),
    /// Refines the picture while the view rests, or not.
    ToggleRefinement,
    /// Records the camera's path, or ends that and writes it.
    Record,
    /// Makes the picture brighter by so many stops.
    Brighten(f32),
    /// Meters the view, or keeps the exposure that it has.
    ToggleMetering,
    /// Takes the next tone curve.
    NextCurve,
    /// Draws the sources of the light at a point as lines, or not.
    ToggleLines,
    /// Shows the panels, or the picture alone.
    TogglePanels,
    /// Shows the keys.
    ToggleHelp,
    /// Ends the walk.
    Close,
}

/// Stops that a key makes the picture brighter by.
const STOPS: f32 = 0.5;

/// Keys of the modes, in the order of [`Mode::ALL`].
const MODE_KEYS: [KeyCode; 12] = [
    KeyCode::F1,
    KeyCode::F2,
    KeyCode::F3,
    KeyCode::F4,
    KeyCode::F5,
    KeyCode::F6,
    KeyCode::F7,
    KeyCode::F8,
    KeyCode::F9,
    KeyCode::F10,
    KeyCode::F11,
    KeyCode::F12,
];

/// Keys of the cameras, in order.
const CAMERA_KEYS: [KeyCode; 9] = [
    KeyCode::Digit1,
    KeyCode::Digit2,
    KeyCode::Digit3,
    KeyCode::Digit4,
    KeyCode::Digit5,
    KeyCode::Digit6,
    KeyCode::Digit7,
    KeyCode::Digit8,
    KeyCode::Digit9,
];

/// What the keys do, as the window tells it.
pub(crate) const KEYS: [(&str, &str); 19] = [
    ("W A S D  Q E", "move; sink and rise"),
    ("Shift  Ctrl", "faster; slower"),
    ("left drag", "look around"),
    ("right drag", "go around the clicked point"),
    ("wheel", "speed; distance when going around"),
    ("click", "ask the light"),
    ("O", "fly, or go around"),
    ("F", "frame the clicked point, or all"),
    ("1 – 9", "cameras; with Ctrl, store one"),
    ("C", "copy the camera as flags of shot"),
    ("F1 F2 …  M", "modes; the next one"),
    ("[  ]  X", "darker; brighter; metered"),
    ("T", "next tone curve"),
    ("L", "lines to the sources"),
    ("V", "refine the picture at rest"),
    ("P", "picture: PNG; with Shift, EXR"),
    ("R", "record the path; write it"),
    ("Tab  H", "panels; these keys"),
    ("Esc", "close"),
];

impl Command {
    /// What a key asks for, if it is not one that is held to move.
    pub fn of_key(key: KeyCode, shift: bool, control: bool) -> Option<Self> {
        if let Some(number) = MODE_KEYS.iter().position(|&other| other == key) {
            return Mode::ALL.get(number).map(|&mode| Self::Show(mode));
        }
        if let Some(number) = CAMERA_KEYS.iter().position(|&other| other == key) {
            return Some(if control { Self::Store(number) } else { Self::Visit(number) });
        }
        Some(match key {
            KeyCode::KeyM => Self::NextMode,
            KeyCode::KeyF => Self::Frame,
            KeyCode::KeyO => Self::ToggleOrbit,
            KeyCode::KeyC => Self::CopyCamera,
            KeyCode::KeyV => Self::ToggleRefinement,
            KeyCode::KeyP if shift => Self::Save(PictureKind::Exr),
            KeyCode::KeyP => Self::Save(PictureKind::Png),
            KeyCode::KeyR => Self::Record,
            KeyCode::BracketLeft => Self::Brighten(-STOPS),
            KeyCode::BracketRight => Self::Brighten(STOPS),
            KeyCode::KeyX => Self::ToggleMetering,
            KeyCode::KeyT => Self::NextCurve,
            KeyCode::KeyL => Self::ToggleLines,
            KeyCode::Tab => Self::TogglePanels,
            KeyCode::KeyH => Self::ToggleHelp,
            KeyCode::Escape => Self::Close,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modifiers_change_what_keys_mean_and_other_keys_mean_nothing() {
        assert_eq!(Command::of_key(KeyCode::Digit2, false, false), Some(Command::Visit(1)));
        assert_eq!(Command::of_key(KeyCode::Digit2, false, true), Some(Command::Store(1)));
        assert_eq!(Command::of_key(KeyCode::KeyP, true, false), Some(Command::Save(PictureKind::Exr)));
        assert_eq!(Command::of_key(KeyCode::F2, false, false), Some(Command::Show(Mode::Gouraud)));
        assert_eq!(Command::of_key(KeyCode::KeyW, false, false), None);
    }
}
