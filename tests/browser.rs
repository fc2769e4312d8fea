//! A browser of a test's own, without a screen, on a page that the test serves; what the page finds out it posts back.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use tempfile::TempDir;

/// The longest that a report is waited for: shaders are compiled, and pictures drawn, by a processor that may be busy.
const PATIENCE: Duration = Duration::from_secs(120);

/// WebGL2 and WebGPU without a GPU; without a sandbox, because a test may run as root in a container.
const FLAGS: [&str; 8] = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
];

/// A browser and the server of its page; both end with the value.
pub struct Browser {
    process: Child,
    reports: Receiver<Report>,
    _profile: TempDir,
}

/// What a page posted to `/report/NAME`.
pub struct Report {
    pub name: String,
    pub body: Vec<u8>,
}

impl Browser {
    /// Opens `page`, a text that is served as `/test.html`, among the files of a folder. Without a browser the test
    /// skips loudly, and fails where HALFLIGHT_REQUIRE_BROWSER=1.
    #[expect(clippy::print_stderr, reason = "a test that skips says so")]
    pub fn open(folder: &Path, page: &'static str) -> Option<Self> {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("http://{}/test.html", listener.local_addr().unwrap());
        let profile = crate::fixture::folder();
        let Some(process) = start(profile.path(), &address) else {
            assert!(
                std::env::var("HALFLIGHT_REQUIRE_BROWSER").as_deref() != Ok("1"),
                "HALFLIGHT_REQUIRE_BROWSER=1, and yet no Chromium was found"
            );
            eprintln!("SKIPPED, the page was not opened: no Chromium was found");
            return None;
        };
        let (sender, reports) = channel();
        let folder = folder.to_owned();
        std::thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let (folder, sender) = (folder.clone(), sender.clone());
                // A connection that breaks is the browser's to make again.
                std::thread::spawn(move || _ = answer(stream, &folder, page, &sender));
            }
        });
        Some(Self { process, reports, _profile: profile })
    }

    /// The next report; one that is called `error` fails the test.
    pub fn report(&self) -> Report {
        let report = self.reports.recv_timeout(PATIENCE).expect("the page reports");
        assert_ne!(report.name, "error", "{}", String::from_utf8_lossy(&report.body));
        report
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        _ = self.process.kill();
        _ = self.process.wait();
    }
}

/// Starts the first browser that is there.
fn start(profile: &Path, address: &str) -> Option<Child> {
    ["chromium", "chromium-browser", "google-chrome"].iter().find_map(|program| {
        let mut command = Command::new(program);
        command.args(FLAGS).arg(format!("--user-data-dir={}", profile.display())).arg(address);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().ok()
    })
}

/// Answers a request: with a file, or by passing on a report.
fn answer(stream: TcpStream, folder: &Path, page: &str, reports: &Sender<Report>) -> std::io::Result<()> {
    let mut reader = BufReader::new(&stream);
    let (mut request, mut length) = (String::new(), 0);
    reader.read_line(&mut request)?;
    for line in reader.by_ref().lines().map_while(Result::ok).take_while(|line| !line.is_empty()) {
        if let Some(value) = line.to_ascii_lowercase().strip_prefix("content-length:") {
            length = value.trim().parse().unwrap();
        }
    }
    let path = request.split([' ', '?']).nth(1).unwrap_or_default().trim_start_matches('/');
    if let Some(name) = path.strip_prefix("report/") {
        let mut body = vec![0; length];
        reader.read_exact(&mut body)?;
        _ = reports.send(Report { name: name.to_owned(), body });
        return respond(&stream, "200 OK", "text/plain", b"");
    }
    if path == "test.html" {
        return respond(&stream, "200 OK", "text/html", page.as_bytes());
    }
    match std::fs::read(folder.join(path)) {
        Ok(bytes) => respond(&stream, "200 OK", kind(&PathBuf::from(path)), &bytes),
        Err(_) => respond(&stream, "404 Not Found", "text/plain", b""),
    }
}

fn respond(mut stream: &TcpStream, status: &str, kind: &str, body: &[u8]) -> std::io::Result<()> {
    let length = body.len();
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
    )?;
    stream.write_all(body)
}

/// The kind of a file by its name, as servers of files tell it.
fn kind(path: &Path) -> &'static str {
    match path.extension().and_then(|end| end.to_str()) {
        Some("html") => "text/html",
        Some("js") => "text/javascript",
        Some("json") => "application/json",
        _ => "application/octet-stream",
    }
}
