//! A desktop of a test's own: an X server without a screen, the program's window on it, synthetic keys and mouse, and pictures of
//! what is seen.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The longest that anything is waited for: the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(60);

/// How often it is looked at meanwhile.
const LOOK: Duration = Duration::from_millis(50);

/// An X server of 800 × 600 pixels, which ends with the value.
pub struct Desktop {
    server: Child,
    display: String,
}

impl Desktop {
    /// Starts a server. Without one, or what drives it, the test skips loudly, and fails where HALFLIGHT_REQUIRE_GPU=1.
    #[expect(clippy::print_stderr, reason = "a test that skips says so")]
    pub fn start() -> Option<Self> {
        let started = Self::find();
        if let Err(why) = &started {
            assert!(
                std::env::var("HALFLIGHT_REQUIRE_GPU").as_deref() != Ok("1"),
                "HALFLIGHT_REQUIRE_GPU=1, and yet: {why}"
            );
            eprintln!("SKIPPED, no window was opened: {why}");
        }
        started.ok()
    }

    fn find() -> Result<Self, String> {
        for (tool, asks) in [("xdotool", "version"), ("import", "-version")] {
            let found = Command::new(tool).arg(asks).stdout(Stdio::null()).stderr(Stdio::null()).status();
            found.map_err(|error| format!("{tool}: {error}"))?;
        }
        // The server chooses a free number, and says which; it does not begin anew when a client leaves it alone.
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| format!("Xvfb: {error}"))?;
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        assert!(!number.trim().is_empty(), "Xvfb found no display");
        Ok(Self { server, display: format!(":{}", number.trim()) })
    }

    /// A command whose windows open here.
    pub fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY");
        command
    }

    /// Opens the program's window on a file, started in a folder, of 640 × 480 pixels in the upper left corner.
    pub fn view(&self, file: &Path, folder: &Path, environment: &[(&str, &str)]) -> Window<'_> {
        let mut program = self
            .command(env!("CARGO_BIN_EXE_halflight"))
            .arg("view")
            .arg(file)
            .current_dir(folder)
            .env("XDG_CACHE_HOME", folder.join("cache"))
            .envs(environment.iter().copied())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let said = Arc::new(Mutex::new(String::new()));
        let (stderr, heard) = (program.stderr.take().unwrap(), said.clone());
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                let mut heard = heard.lock().unwrap();
                heard.push_str(&line);
                heard.push('\n');
            }
        });
        let mut window = Window { desktop: self, program, said, id: String::new() };
        window.id = window.wait_for("a window", |window| {
            let found = window
                .desktop
                .command("xdotool")
                .args(["search", "--onlyvisible", "--name", "Halflight"])
                .output()
                .unwrap();
            let found = String::from_utf8(found.stdout).unwrap();
            found.lines().next().map(str::to_owned)
        });
        window.tool(&["windowmove", "%", "0", "0"]);
        window.resize(640, 480);
        window.tool(&["windowfocus", "--sync", "%"]);
        window
    }

    /// A picture of the upper left 640 × 480 pixels of what is seen.
    pub fn picture(&self, folder: &Path) -> Vec<[u8; 3]> {
        let path = folder.join("screen.png");
        let geometry = ["-window", "root", "-crop", "640x480+0+0", "+repage", "-depth", "8"];
        // PNG24: without an alpha channel, and with as many colours as there are.
        let name = format!("PNG24:{}", path.display());
        assert!(self.command("import").args(geometry).arg(name).status().unwrap().success());
        let (width, height, pixels) = formats::read_png(&path).unwrap();
        assert_eq!((width, height), (640, 480));
        pixels
    }
}

impl Drop for Desktop {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The program's window, which closes with the value.
pub struct Window<'a> {
    desktop: &'a Desktop,
    program: Child,
    said: Arc<Mutex<String>>,
    id: String,
}

impl Window<'_> {
    /// What the program has said so far.
    pub fn said(&self) -> String {
        self.said.lock().unwrap().clone()
    }

    /// Waits until something is there; fails, with what was said, when the program has ended or it takes too long.
    pub fn wait_for<T>(&mut self, what: &str, mut find: impl FnMut(&mut Self) -> Option<T>) -> T {
        let start = Instant::now();
        loop {
            if let Some(found) = find(self) {
                return found;
            }
            let ended = self.program.try_wait().unwrap();
            assert!(ended.is_none(), "the program ended with {ended:?} before {what}: {}", self.said());
            assert!(start.elapsed() < PATIENCE, "no {what}: {}", self.said());
            std::thread::sleep(LOOK);
        }
    }

    /// Waits until the program has said something.
    pub fn wait_until_said(&mut self, what: &str) {
        self.wait_for(what, |window| window.said().contains(what).then_some(()));
    }

    /// Runs xdotool; `%` stands for the window.
    pub fn tool(&self, arguments: &[&str]) {
        let arguments = arguments.iter().map(|&argument| if argument == "%" { self.id.as_str() } else { argument });
        assert!(self.desktop.command("xdotool").args(arguments).status().unwrap().success());
    }

    /// Presses and releases keys, one after another.
    pub fn keys(&self, keys: &[&str]) {
        self.tool(&[&["key", "--delay", "60"], keys].concat());
    }

    /// Gives the window another size, pixels.
    pub fn resize(&self, width: u32, height: u32) {
        self.tool(&["windowsize", "%", &width.to_string(), &height.to_string()]);
    }

    /// The camera, as the program says it: the flags of `shot`.
    pub fn camera(&mut self) -> Vec<String> {
        const SAYS: &str = "camera copied: ";
        let before = self.said().matches(SAYS).count();
        self.keys(&["c"]);
        let said = self.wait_for("camera", |window| {
            let said = window.said();
            (said.matches(SAYS).count() > before).then_some(said)
        });
        let (_, flags) = said.rsplit_once(SAYS).unwrap();
        flags.lines().next().unwrap().split(' ').map(str::to_owned).collect()
    }

    /// Waits until the picture has been the same for three looks in a row, and is not black.
    pub fn picture_at_rest(&mut self, folder: &Path) -> Vec<[u8; 3]> {
        let (mut last, mut same) = (Vec::new(), 0);
        self.wait_for("picture at rest", |window| {
            std::thread::sleep(4 * LOOK);
            let picture = window.desktop.picture(folder);
            same = if picture == last { same + 1 } else { 0 };
            last = picture;
            (same >= 2 && last.iter().any(|pixel| *pixel != [0; 3])).then(|| last.clone())
        })
    }

    /// Closes the window as a user does; the program's exit code.
    pub fn close(mut self) -> Option<i32> {
        self.keys(&["Escape"]);
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Some(status) = self.program.try_wait().unwrap() {
                return status.code();
            }
            std::thread::sleep(LOOK);
        }
        panic!("the window did not close: {}", self.said());
    }
}

impl Drop for Window<'_> {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}
