//! A file that is looked at again and again: told when it has changed, and is whole.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// How often a file is looked at. Twice the same is whole, so a change is seen within two.
const EVERY: Duration = Duration::from_millis(200);

/// What tells a file from the one that was there before.
type Stamp = Option<(SystemTime, u64)>;

/// A file, as it was when it was last read, and when it was last looked at.
pub struct Watch {
    path: PathBuf,
    read: Stamp,
    seen: Stamp,
}

impl Watch {
    /// A watch over a file that is read after this.
    pub fn over(path: &Path) -> Self {
        Self { path: path.to_owned(), read: stamp(path), seen: None }
    }

    /// Calls `changed` whenever the file has changed, until it returns false; for a thread of its own.
    pub fn keep(mut self, mut changed: impl FnMut(&Path) -> bool) {
        loop {
            std::thread::sleep(EVERY);
            if self.look(stamp(&self.path)) && !changed(&self.path) {
                return;
            }
        }
    }

    /// Whether the file, as it is now, is another one than was read, and the same as at the last look.
    fn look(&mut self, now: Stamp) -> bool {
        let settled = now.is_some() && now == self.seen && now != self.read;
        self.seen = now;
        if settled {
            self.read = now;
        }
        settled
    }
}

fn stamp(path: &Path) -> Stamp {
    let metadata = path.metadata().ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_changed_once_it_is_whole() {
        let at = |seconds, length| Some((SystemTime::UNIX_EPOCH + Duration::from_secs(seconds), length));
        let mut watch = Watch { path: PathBuf::new(), read: at(1, 10), seen: None };
        let looks = [
            at(1, 10),
            at(1, 10),
            at(2, 3),
            at(2, 7),
            at(2, 9),
            at(2, 9),
            at(2, 9),
            None,
            at(2, 9),
            at(2, 9),
            at(3, 9),
            at(3, 9),
        ];
        let changes = [false, false, false, false, false, true, false, false, false, false, false, true];
        assert_eq!(looks.map(|look| watch.look(look)), changes);
    }
}
