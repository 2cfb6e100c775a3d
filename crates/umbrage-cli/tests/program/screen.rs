//! A screen that nobody sees, on which the program opens its window, and what pictures of the
//! window show.

use crate::desk::Desk;
use image::RgbImage;
use serde_json::json;
use std::collections::HashSet;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Longer than any script takes, even on a busy machine without a GPU.
const TOO_LONG: Duration = Duration::from_secs(300);

/// A display of its own, which is gone when this is dropped.
struct Screen {
    server: Running,
    display: String,
}

/// A process that is ended when this is dropped, also by a test that fails.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Screen {
    fn new([width, height]: [u32; 2]) -> Self {
        let size = format!("{width}x{height}x24");
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0", &size])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts");
        let mut server = Running(server);
        let mut number = String::new();
        let told = server.0.stdout.take().unwrap();
        BufReader::new(told).read_line(&mut number).unwrap();
        let display = format!(":{}", number.trim().parse::<u32>().expect("Xvfb tells its display"));
        Self { server, display }
    }
}

/// Runs scripts in windows, one after the other: a window draws with all cores where there is no
/// GPU, and two of them would only wait for each other.
pub(crate) struct Windows {
    pub(crate) desk: Desk,
    screen: Screen,
    /// Where pictures and messages are kept: a failure leaves them to be looked at.
    folder: PathBuf,
    _alone: MutexGuard<'static, ()>,
}

/// A line of a script as the program reads it.
fn json_line(line: &str) -> String {
    let (verb, rest) = line.split_once(' ').unwrap_or((line, ""));
    match verb {
        _ if line.is_empty() || line.starts_with('{') => line.to_owned(),
        "open" => json!({"load": rest}).to_string(),
        "fail-to-open" => json!({"load-fails": rest}).to_string(),
        "size" => {
            let sides: Vec<u32> = rest.split(' ').map(|side| side.parse().unwrap()).collect();
            json!({"size": sides}).to_string()
        }
        _ => json!({"do": line}).to_string(),
    }
}

/// What a script left behind.
pub(crate) struct Scripted {
    pub(crate) code: i32,
    pub(crate) stderr: String,
    folder: PathBuf,
}

impl Windows {
    /// On a screen of a common size. The test's name is that of the folder.
    pub(crate) fn new(test: &str) -> Self {
        Self::on_screen(test, [1600, 1200])
    }

    /// On a screen of this size, pixels.
    pub(crate) fn on_screen(test: &str, size: [u32; 2]) -> Self {
        static ALONE: Mutex<()> = Mutex::new(());
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("window").join(test);
        // There need not be any of the last run.
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        Self { desk: Desk::new(), screen: Screen::new(size), folder, _alone: alone }
    }

    /// Opens a scene, goes through a script, and gives what came of it. Lines of the script that
    /// are no JSON are words as `do` takes them, or `open NAME`, `fail-to-open NAME` and
    /// `size WIDTH HEIGHT`.
    pub(crate) fn try_script(&mut self, scene: &str, script: &str) -> Scripted {
        assert!(self.screen.server.0.try_wait().unwrap().is_none(), "Xvfb runs");
        let path = self.folder.join("script.jsonl");
        let lines: String = script.lines().map(|line| json_line(line) + "\n").collect();
        std::fs::write(&path, lines).unwrap();
        let [script, pictures] = [&path, &self.folder].map(|p| p.to_str().unwrap());
        let messages = self.folder.join("messages.txt");
        let mut command = self.desk.command(&["-v", "view", scene, "--script", script]);
        command
            .args(["--screenshot", pictures])
            .env("DISPLAY", &self.screen.display)
            .env("XDG_RUNTIME_DIR", self.desk.path(""))
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .stdout(Stdio::null())
            .stderr(File::create(&messages).unwrap());
        let began = Instant::now();
        let mut program = Running(command.spawn().unwrap());
        let read = || String::from_utf8_lossy(&std::fs::read(&messages).unwrap()).into_owned();
        let status = loop {
            if let Some(status) = program.0.try_wait().unwrap() {
                break status;
            }
            assert!(began.elapsed() < TOO_LONG, "the script takes too long:\n{}", read());
            std::thread::sleep(Duration::from_millis(20));
        };
        let stderr = read();
        let code = status.code().unwrap_or_else(|| panic!("{status}:\n{stderr}"));
        // What egui says of frames of a lost device.
        let told = stderr.to_lowercase().replace("dropped frame with error: validation", "");
        for word in ["panicked", "validation", "refused", "error:"] {
            assert!(!told.contains(word), "{word}:\n{stderr}");
        }
        Scripted { code, stderr, folder: self.folder.clone() }
    }

    /// Goes through a script that must succeed.
    pub(crate) fn script(&mut self, scene: &str, script: &str) -> Scripted {
        let run = self.try_script(scene, script);
        assert_eq!(run.code, 0, "{}", run.stderr);
        run
    }
}

impl Scripted {
    /// A picture of the whole window.
    pub(crate) fn shot(&self, name: &str) -> Shot {
        let path = self.folder.join(format!("{name}.png"));
        let image = image::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Shot { name: name.to_owned(), pixels: image.to_rgb8() }
    }
}

/// A picture of the window.
pub(crate) struct Shot {
    name: String,
    pub(crate) pixels: RgbImage,
}

type Rgb = [u8; 3];

/// Sides of the bars at the top (two rows of controls in a small window) and at the bottom, pixels.
const TOP: u32 = 56;
const BOTTOM: u32 = 26;

impl Shot {
    pub(crate) fn size(&self) -> [u32; 2] {
        self.pixels.dimensions().into()
    }

    /// The pixels from shares of the width and the height to others.
    fn part(&self, x: [f64; 2], y: [f64; 2]) -> impl Iterator<Item = Rgb> {
        let [width, height] = self.size();
        let range = |ends: [f64; 2], side: u32| {
            let [begin, end] = ends.map(|end| (end * f64::from(side)).round() as u32);
            begin..end.min(side)
        };
        let xs = range(x, width);
        range(y, height).flat_map(move |y| xs.clone().map(move |x| self.pixels.get_pixel(x, y).0))
    }

    /// Those pixels of the area between the bars.
    pub(crate) fn picture(&self, x: [f64; 2], y: [f64; 2]) -> impl Iterator<Item = Rgb> {
        let height = f64::from(self.size()[1]);
        let [top, bottom] = [TOP, self.size()[1] - BOTTOM].map(|y| f64::from(y) / height);
        self.part(x, y.map(|share| top + share * (bottom - top)))
    }

    fn all(&self) -> impl Iterator<Item = Rgb> {
        self.picture([0.0, 1.0], [0.0, 1.0])
    }

    /// Fails if the area between the bars is of few colours, or if there is a message of an error.
    pub(crate) fn is_fine(&self) -> &Self {
        let colors = self.all().collect::<HashSet<_>>().len();
        assert!(colors > 60, "{}: {colors} colours", self.name);
        assert!(!self.has_error(), "{}: a message of an error", self.name);
        self
    }

    /// Whether there is a message of an error: nothing else in the lower bar is red.
    pub(crate) fn has_error(&self) -> bool {
        let [_, height] = self.size();
        let bar = [1.0 - f64::from(BOTTOM) / f64::from(height), 1.0];
        self.part([0.0, 1.0], bar).filter(|&[r, g, b]| r > 200 && g < 40 && b < 40).count() > 20
    }

    /// Fails if one of the colours of a legend is not in the picture's lower left corner.
    pub(crate) fn has_legend(&self, colors: &[Rgb]) {
        let seen: HashSet<Rgb> = self.picture([0.0, 0.5], [0.7, 1.0]).collect();
        let is_near = |a: &Rgb, b: &Rgb| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 3);
        for color in colors {
            let is_there = seen.iter().any(|seen| is_near(seen, color));
            assert!(is_there, "{}: {color:?} is not in the legend", self.name);
        }
    }

    /// The mean difference of the areas between the bars, of 255, from shares of width and height
    /// to others.
    pub(crate) fn difference(&self, other: &Self, x: [f64; 2], y: [f64; 2]) -> f64 {
        assert_eq!(self.size(), other.size(), "{} and {}", self.name, other.name);
        let pairs = self.picture(x, y).zip(other.picture(x, y));
        let [mut sum, mut count] = [0.0; 2];
        for (a, b) in pairs {
            sum += a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(b))).sum::<f64>() / 3.0;
            count += 1.0;
        }
        sum / count
    }

    /// Fails if the picture below its caption is not that of another one but for little.
    pub(crate) fn is_like(&self, other: &Self, most: f64) {
        let difference = self.difference(other, [0.0, 1.0], [0.2, 1.0]);
        assert!(difference <= most, "{} and {}: {difference:.2}", self.name, other.name);
    }

    /// Fails if the area between the bars is that of another picture but for little.
    pub(crate) fn is_unlike(&self, other: &Self, least: f64) {
        let difference = self.difference(other, [0.0, 1.0], [0.0, 1.0]);
        assert!(difference >= least, "{} and {}: {difference:.2}", self.name, other.name);
    }
}
