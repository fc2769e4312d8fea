//! The window: an event loop around the walk.

use std::{
    sync::{Arc, mpsc::Sender},
    time::{Duration, Instant},
};

use scene::{Baked, CameraPath};
use winit::{
    application::ApplicationHandler,
    dpi::LogicalSize,
    event::{ElementState, KeyEvent, WindowEvent},
    event_loop::{ActiveEventLoop, EventLoop, EventLoopProxy},
    keyboard::PhysicalKey,
    platform::run_on_demand::EventLoopExtRunOnDemand,
    window::{Window, WindowId},
};

use crate::{
    PictureKind, Save, SavePath, SurfacePoint, Update, ViewerError, Walkthrough,
    command::Command,
    hands::Hands,
    loader::{Event, GpuSlot, asker, pass_on},
    overlay::Overlay,
    pace::{FrameClock, Pace},
    reading::sources_sentence,
    refinement::Refinements,
    screen::{Presented, Screen},
    walk::{Errand, Walk},
};

/// Size that the window opens with, logical pixels.
const SIZE: LogicalSize<f64> = LogicalSize::new(1280.0, 720.0);

/// Longest time that a step of the walk takes, seconds: after a hiccup the eye must not be behind a wall.
const LONGEST_STEP: f64 = 0.1;

/// How soon a window system is asked again that had no picture to draw into.
const AGAIN: Duration = Duration::from_millis(10);

/// Times that an adapter may fail within a while before the CPU draws in its place.
const FAILURES: usize = 3;
const WHILE: Duration = Duration::from_secs(10);

/// The system that windows are opened on. There is one in a process, and but for Linux it belongs to the main thread.
pub struct WindowSystem {
    event_loop: EventLoop<Event>,
}

impl WindowSystem {
    /// Finds the window system.
    ///
    /// # Errors
    /// [`ViewerError::NoDisplay`] where there is none, or it was found before.
    pub fn connect() -> Result<Self, ViewerError> {
        let mut builder = EventLoop::with_user_event();
        #[cfg(target_os = "linux")]
        {
            use winit::platform::{wayland::EventLoopBuilderExtWayland, x11::EventLoopBuilderExtX11};
            EventLoopBuilderExtX11::with_any_thread(&mut builder, true);
            EventLoopBuilderExtWayland::with_any_thread(&mut builder, true);
        }
        Ok(Self { event_loop: builder.build().map_err(|cause| no_display(&cause))? })
    }

    /// Opens a window for a walk, and returns when it is closed. [`Walkthrough::updates`] may begin at any time: until there is a
    /// bake, the window says what it waits for.
    ///
    /// An adapter that fails, or is lost, is opened again, and after that the CPU draws; the window says so.
    ///
    /// # Errors
    /// [`ViewerError::NoDisplay`] if no window can be opened or drawn into.
    pub fn open(&mut self, walkthrough: Walkthrough) -> Result<(), ViewerError> {
        let session = self.session(walkthrough);
        self.run(session)
    }

    fn session(&self, walkthrough: Walkthrough) -> Session {
        let Walkthrough { name, updates, explain, save, refine, save_path, tell } = walkthrough;
        let events = self.event_loop.create_proxy();
        let gpu = Arc::new(GpuSlot::default());
        pass_on(updates, gpu.clone(), events.clone());
        let refined = events.clone();
        let pass = move |number, refinement| {
            // A closed window has no use for it.
            let _ = refined.send_event(Event::Refined(number, refinement));
        };
        Session {
            name,
            walk: Walk::default(),
            hands: Hands::default(),
            pace: Pace::default(),
            last_step: None,
            stage: None,
            devices: 0,
            failures: Vec::new(),
            gpu,
            questions: asker(explain, events.clone()),
            refinements: Refinements::new(refine, Arc::new(pass)),
            events,
            save,
            save_path,
            tell,
            failure: None,
        }
    }

    fn run(&mut self, mut session: Session) -> Result<(), ViewerError> {
        let ended = self.event_loop.run_app_on_demand(&mut session).map_err(|cause| no_display(&cause));
        // A thread that waits for the adapter need not any more.
        session.gpu.set(None);
        ended.and(session.failure.map_or(Ok(()), Err))
    }
}

fn no_display(cause: &dyn std::fmt::Display) -> ViewerError {
    let cause = cause.to_string();
    // winit begins with the line of its source that noticed, which says nothing to a user.
    let told =
        cause.strip_prefix("os error at ").and_then(|rest| rest.split_once(": ")).map(|(_, told)| told.to_owned());
    ViewerError::NoDisplay(told.unwrap_or(cause))
}

/// The window, what draws into it and what lies over it.
struct Stage {
    window: Arc<Window>,
    screen: Screen,
    overlay: Overlay,
}

/// An open window and the walk in it.
struct Session {
    name: String,
    walk: Walk,
    hands: Hands,
    pace: Pace,
    /// When the walk last moved; none while it rests.
    last_step: Option<Instant>,
    stage: Option<Stage>,
    /// Number of devices that were opened.
    devices: u64,
    /// When adapters failed lately.
    failures: Vec<Instant>,
    gpu: Arc<GpuSlot>,
    questions: Sender<(Arc<Baked>, SurfacePoint)>,
    refinements: Refinements,
    events: EventLoopProxy<Event>,
    save: Arc<Save>,
    save_path: Arc<SavePath>,
    tell: Box<dyn Fn(&str)>,
    failure: Option<ViewerError>,
}

impl Session {
    /// Says something to the user, in the window and beside it.
    fn say(&mut self, what: String) {
        (self.tell)(&what);
        self.walk.notice = Some(what);
    }

    fn redraw(&self) {
        if let Some(stage) = &self.stage {
            stage.window.request_redraw();
        }
    }

    /// Opens the window, or what draws into it anew.
    fn open_stage(&mut self, event_loop: &ActiveEventLoop) -> Result<(), ViewerError> {
        let window = match self.stage.take() {
            Some(Stage { window, .. }) => window,
            None => {
                let attributes = Window::default_attributes().with_title(&self.name).with_inner_size(SIZE);
                Arc::new(event_loop.create_window(attributes).map_err(|cause| no_display(&cause))?)
            }
        };
        self.failures.retain(|failure| failure.elapsed() < WHILE);
        let (mut screen, in_vain) = if self.failures.len() >= FAILURES {
            (Screen::on_cpu(&window, event_loop)?, vec!["the CPU draws".to_owned()])
        } else {
            self.devices += 1;
            Screen::open(&window, event_loop, &self.events, self.devices)?
        };
        if let Some(shown) = self.walk.shown.clone()
            && let Err(error) = screen.show(&shown, None)
        {
            self.say(format!("{error}; the CPU draws"));
            screen = Screen::on_cpu(&window, event_loop)?;
            screen.show(&shown, None)?;
        }
        self.gpu.set(screen.gpu().cloned());
        let overlay = Overlay::new(window.clone(), screen.largest_texture());
        self.stage = Some(Stage { window, screen, overlay });
        if !in_vain.is_empty() {
            self.say(in_vain.join("; "));
        }
        self.redraw();
        Ok(())
    }

    /// Goes on after a failure of the adapter.
    fn recover(&mut self, event_loop: &ActiveEventLoop, failure: &str) {
        self.failures.push(Instant::now());
        let opened = self.open_stage(event_loop);
        match (opened, &self.stage) {
            (Ok(()), Some(stage)) => {
                let name = stage.screen.name();
                self.say(format!("{failure}; drawing goes on with {name}"));
            }
            (Ok(()), None) => {}
            (Err(error), _) => self.fail(event_loop, error),
        }
    }

    /// Ends the walk.
    fn fail(&mut self, event_loop: &ActiveEventLoop, failure: ViewerError) {
        self.failure.get_or_insert(failure);
        event_loop.exit();
    }

    /// Asks for the sources of the light at the clicked point.
    fn ask(&self) {
        if let (Some(shown), Some(clicked)) = (&self.walk.shown, &self.walk.clicked) {
            // The thread that answers lives as long as the session.
            let _ = self.questions.send((shown.baked.clone(), clicked.reading.point));
        }
    }

    fn obey(&mut self, event_loop: &ActiveEventLoop, command: Command) {
        let size = self.size();
        let aspect = f64::from(size.0.max(1)) / f64::from(size.1.max(1));
        match self.walk.obey(command, aspect) {
            None => {}
            Some(Errand::Close) => event_loop.exit(),
            Some(Errand::Copy(flags)) => {
                self.say(format!("camera copied: {flags}"));
                if let Some(stage) = &mut self.stage {
                    stage.overlay.copy(flags);
                }
            }
            Some(Errand::Say(what)) => self.say(what),
            Some(Errand::Save(kind)) => self.save_picture(kind, size),
            Some(Errand::SavePath(path)) => self.save_path(path),
        }
        self.redraw();
    }

    /// Has a picture of the view written, on a thread of its own.
    fn save_picture(&mut self, kind: PictureKind, size: (u32, u32)) {
        let (Some(shown), Some(frame)) = (self.walk.shown.clone(), self.walk.frame(size)) else { return };
        let save = self.save.clone();
        self.aside(move || save(&shown.baked, &frame, kind).unwrap_or_else(|why| format!("no picture: {why}")));
    }

    /// Has a path written, on a thread of its own.
    fn save_path(&mut self, path: CameraPath) {
        let save = self.save_path.clone();
        self.aside(move || save(&path).unwrap_or_else(|why| format!("no path: {why}")));
    }

    /// Does something on a thread of its own, and tells what comes of it.
    fn aside(&self, work: impl FnOnce() -> String + Send + 'static) {
        let events = self.events.clone();
        std::thread::spawn(move || {
            // A closed window has no use for it.
            let _ = events.send_event(Event::Update(Update::Notice(work())));
        });
    }

    /// The window's size, pixels.
    fn size(&self) -> (u32, u32) {
        self.stage.as_ref().map_or((0, 0), |stage| stage.window.inner_size().into())
    }

    /// Moves, meters, lays out the panels and draws; what their buttons ask for. Asks for the next frame if this one is not the
    /// last.
    fn draw(&mut self) -> Result<Vec<Command>, ViewerError> {
        let size = self.size();
        if let Some(place) = self.hands.take_click() {
            self.walk.click(place, size);
            if let Some(clicked) = &self.walk.clicked {
                (self.tell)(&clicked.reading.sentence());
            }
            self.ask();
        }
        let Some(stage) = &mut self.stage else { return Ok(Vec::new()) };
        let mut clock = FrameClock::start();
        let now = Instant::now();
        let seconds = self.last_step.map_or(0.0, |last| (now - last).as_secs_f64().min(LONGEST_STEP));
        let steering = self.walk.steered(self.hands.take_steering(), self.hands.drag());
        let moves = self.walk.step(&steering, seconds, size);
        let is_at_rest = self.walk.refines && !moves;
        let shown = self.walk.shown.as_ref().filter(|_| is_at_rest);
        self.refinements.follow(shown.map(|shown| &shown.baked).zip(self.walk.frame(size)));
        clock.lap();
        let refined = self.refinements.finest().map(|refined| (size, refined));
        let (commands, changes, painting) = stage.overlay.lay_out(&mut self.walk, &self.pace, &stage.screen, refined);
        clock.lap();
        let presented = stage.screen.present(self.walk.frame(size).as_ref(), painting, !moves)?;
        clock.lap();
        if presented == Presented::Late {
            std::thread::sleep(AGAIN);
        } else if self.walk.shown.is_some() {
            self.pace.add(clock);
        }
        self.last_step = moves.then_some(now);
        let goes_on = moves || changes || !commands.is_empty();
        if presented != Presented::Hidden && (goes_on || presented != Presented::Shown) {
            stage.window.request_redraw();
        }
        Ok(commands)
    }
}

impl ApplicationHandler<Event> for Session {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.stage.is_none()
            && let Err(error) = self.open_stage(event_loop)
        {
            self.fail(event_loop, error);
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, event: Event) {
        match event {
            Event::Ready(shown, resident) => {
                self.walk.show(shown.clone(), self.size());
                let Some(stage) = &mut self.stage else { return };
                // What is in the memory of an adapter that is gone is brought into the present one's.
                let is_here = |gpu: &Arc<crate::Gpu>| stage.screen.gpu().is_some_and(|here| Arc::ptr_eq(here, gpu));
                let resident = resident.filter(|(gpu, _)| is_here(gpu)).map(|(_, uploaded)| uploaded).transpose();
                if let Err(error) = resident.and_then(|resident| stage.screen.show(&shown, resident)) {
                    self.recover(event_loop, &error.to_string());
                }
                if self.walk.clicked.is_some() {
                    self.ask();
                }
            }
            Event::Update(Update::Close) => event_loop.exit(),
            Event::Update(Update::Notice(said)) => self.say(said),
            Event::Update(update) => self.walk.note(update),
            Event::Answer(point, sources) => {
                if let Some(clicked) = self.walk.clicked.as_mut().filter(|clicked| clicked.reading.point == point) {
                    (self.tell)(&sources.as_ref().map_or_else(Clone::clone, |sources| sources_sentence(sources)));
                    clicked.sources = Some(sources);
                }
            }
            Event::Refined(number, Ok(refined)) => {
                let (is_known, samples) = (refined.known >= 1.0, refined.samples_a_pixel);
                if self.refinements.take(number, refined) && is_known {
                    (self.tell)(&format!("refined: every pixel is known, by {samples:.2} samples a pixel"));
                }
            }
            Event::Refined(_, Err(why)) => self.say(why),
            Event::DeviceLost(device, said) => {
                let is_ours =
                    matches!(&self.stage, Some(Stage { screen: Screen::Gpu(screen), .. }) if screen.serial == device);
                if is_ours {
                    self.recover(event_loop, &format!("the graphics device was lost: {said}"));
                }
            }
        }
        self.redraw();
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(stage) = &mut self.stage else { return };
        let (over_panel, changes) = stage.overlay.follow(&event);
        self.hands.follow(&event, over_panel);
        let mut redraw = changes;
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => event_loop.exit(),
            WindowEvent::Resized(size) => {
                if let Err(error) = stage.screen.resize(size) {
                    self.recover(event_loop, &error.to_string());
                }
                redraw = true;
            }
            WindowEvent::Occluded(false) => redraw = true,
            // A key that is held while the window is entered is no key that is pressed in it.
            WindowEvent::KeyboardInput {
                event: KeyEvent { physical_key: PhysicalKey::Code(key), state, repeat, .. },
                is_synthetic: false,
                ..
            } => {
                let (shift, control) = self.hands.modifiers();
                let is_first = state == ElementState::Pressed && !repeat && !over_panel;
                if let Some(command) = Command::of_key(key, shift, control).filter(|_| is_first) {
                    self.obey(event_loop, command);
                }
                redraw = true;
            }
            WindowEvent::MouseInput { .. } | WindowEvent::MouseWheel { .. } => redraw = true,
            WindowEvent::RedrawRequested => match self.draw() {
                Ok(commands) => {
                    for command in commands {
                        self.obey(event_loop, command);
                    }
                    redraw = false;
                }
                Err(error) => self.recover(event_loop, &error.to_string()),
            },
            _ => {}
        }
        if redraw {
            self.redraw();
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::print_stderr)]

    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};
    use std::sync::{Mutex, mpsc::channel};

    use super::*;
    use crate::test_room::room;

    /// On a display of its own, because a process has one window system.
    #[test]
    fn a_lost_device_is_opened_again() {
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut server = match server {
            Ok(server) => server,
            Err(error) if std::env::var("HALFLIGHT_REQUIRE_GPU").as_deref() != Ok("1") => {
                eprintln!("SKIPPED, no window was opened: Xvfb: {error}");
                return;
            }
            Err(error) => panic!("Xvfb: {error}"),
        };
        let mut display = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut display).unwrap();
        let run = Command::new(std::env::current_exe().unwrap())
            .args(["window::tests::loses_its_device", "--exact", "--ignored", "--nocapture"])
            .env("DISPLAY", format!(":{}", display.trim()))
            .env_remove("WAYLAND_DISPLAY")
            .output()
            .unwrap();
        server.kill().unwrap();
        server.wait().unwrap();
        let said = String::from_utf8_lossy(&run.stdout);
        let failed = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success() && said.contains("1 passed"), "{said} {failed}");
    }

    #[test]
    #[ignore = "a_lost_device_is_opened_again runs it, on a display of its own"]
    fn loses_its_device() {
        let (updates, received) = channel();
        let said = Arc::new(Mutex::new(Vec::new()));
        let heard = said.clone();
        let walkthrough = Walkthrough {
            name: "Halflight".into(),
            updates: received,
            explain: Arc::new(|_, _| Ok(Vec::new())),
            save: Arc::new(|_, _, _| Ok(String::new())),
            refine: Arc::new(|_, _, _, _| Ok(())),
            save_path: Arc::new(|_| Ok(String::new())),
            tell: Box::new(move |what| heard.lock().unwrap().push(what.to_owned())),
        };
        updates.send(Update::Bake(Arc::new(room()))).unwrap();
        let mut system = WindowSystem::connect().unwrap();
        let session = system.session(walkthrough);
        let slot = session.gpu.clone();
        let vandal = std::thread::spawn(move || {
            let first = slot.wait().unwrap();
            std::thread::sleep(Duration::from_millis(300));
            first.device.destroy();
            // A frame is wanted, and cannot be drawn as before.
            updates.send(Update::Notice("destroyed".into())).unwrap();
            let start = Instant::now();
            while slot.wait().is_some_and(|gpu| Arc::ptr_eq(&gpu, &first)) {
                assert!(start.elapsed() < Duration::from_secs(60), "nothing was opened");
                std::thread::sleep(Duration::from_millis(20));
            }
            std::thread::sleep(Duration::from_millis(300));
            updates.send(Update::Close).unwrap();
        });
        system.run(session).unwrap();
        vandal.join().unwrap();
        let said = said.lock().unwrap();
        assert!(said.iter().any(|line| line.contains("drawing goes on")), "{said:?}");
    }

    #[test]
    fn the_reason_for_no_display_names_no_source_line() {
        let error = no_display(&"os error at /crates/winit/mod.rs:765: neither X nor Y is set.");
        assert_eq!(error.to_string(), "no window can be opened here: neither X nor Y is set.");
        assert_eq!(no_display(&"exit: 3").to_string(), "no window can be opened here: exit: 3");
    }
}
