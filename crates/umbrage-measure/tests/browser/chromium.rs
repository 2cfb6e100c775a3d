//! The part of the DevTools protocol that these tests need to drive a real Chromium.

use base64::prelude::{BASE64_STANDARD, Engine};
use serde_json::{Value, json};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// Programs to try, unless `CHROMIUM` names one.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
/// How long the browser may take for one action before the test fails.
const PATIENCE: Duration = Duration::from_secs(60);

/// A Chromium with one open page. Dropping this value ends the process.
pub(crate) struct Browser {
    process: Child,
    socket: WebSocket<TcpStream>,
    session: String,
    next_id: u64,
    /// What the page reported: exceptions, messages on the console, files that did not load.
    pub(crate) complaints: Vec<String>,
    /// The addresses that the page requested.
    pub(crate) requests: Vec<String>,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// Starts Chromium.
    pub(crate) fn start() -> Self {
        let profile = tempfile::tempdir().unwrap();
        let process = launch(profile.path());
        let mut browser = Self {
            socket: connect(profile.path()),
            process,
            session: String::new(),
            next_id: 0,
            complaints: Vec::new(),
            requests: Vec::new(),
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}));
        let attach = json!({"targetId": target["targetId"], "flatten": true});
        let attached = browser.call("Target.attachToTarget", attach);
        browser.session = attached["sessionId"].as_str().unwrap().to_owned();
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser
    }

    /// Opens a file in a window of the given size, and waits until the page and its pictures are
    /// loaded.
    pub(crate) fn open(&mut self, file: &Path, [width, height]: [u32; 2], mobile: bool) {
        let metrics =
            json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": mobile});
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        self.call("Emulation.setTouchEmulationEnabled", json!({"enabled": mobile}));
        let motion = json!([{"name": "prefers-reduced-motion", "value": "reduce"}]);
        self.call("Emulation.setEmulatedMedia", json!({"features": motion}));
        let url = format!("file://{}", file.canonicalize().unwrap().display());
        self.call("Page.navigate", json!({"url": url}));
        self.wait_for("document.readyState === 'complete' && location.protocol === 'file:'");
    }

    /// The value of a JavaScript expression; promises are awaited.
    pub(crate) fn eval(&mut self, expression: &str) -> Value {
        self.try_eval(expression).unwrap_or_else(|error| panic!("{expression}: {error:#}"))
    }

    /// The value of a JavaScript expression, or DevTools' error, which is not one that the
    /// expression throws.
    fn try_eval(&mut self, expression: &str) -> Result<Value, Value> {
        let params = json!({"expression": expression, "returnByValue": true, "awaitPromise": true});
        let answer = self.try_call("Runtime.evaluate", params)?;
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer:#}");
        Ok(answer["result"]["value"].clone())
    }

    /// Waits until a JavaScript expression is true. The page may be replaced by another meanwhile.
    pub(crate) fn wait_for(&mut self, expression: &str) {
        const REPLACED: &str = "Inspected target navigated or closed";
        let start = Instant::now();
        loop {
            match self.try_eval(expression) {
                Ok(Value::Bool(true)) => return,
                Err(error) if error["message"] != json!(REPLACED) => {
                    panic!("{expression}: {error:#}")
                }
                Ok(_) | Err(_) => {}
            }
            assert!(start.elapsed() < PATIENCE, "still not true: {expression}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// The position of the element's centre in the window, after scrolling it into view.
    pub(crate) fn middle(&mut self, selector: &str) -> [f64; 2] {
        let [x, y, w, h] = self.rect(selector);
        [x + w / 2.0, y + h / 2.0]
    }

    /// Left, top, width and height of the element in the window, after scrolling it into view.
    pub(crate) fn rect(&mut self, selector: &str) -> [f64; 4] {
        self.eval(&format!(
            "document.querySelector({selector:?}).scrollIntoView({{block: 'center', behavior: 'instant'}})"
        ));
        // Before the new position is painted, a touch would still go to the old one.
        self.wait_for_paint();
        let rect = self.eval(&format!(
            "(() => {{ const r = document.querySelector({selector:?}).getBoundingClientRect(); \
             return [r.x, r.y, r.width, r.height] }})()"
        ));
        serde_json::from_value(rect).unwrap()
    }

    /// A mouse event: `mouseMoved`, `mousePressed` or `mouseReleased`.
    pub(crate) fn mouse(&mut self, kind: &str, [x, y]: [f64; 2], held: bool) {
        let button = if held || kind != "mouseMoved" { "left" } else { "none" };
        let event = json!({"type": kind, "x": x, "y": y, "button": button,
            "buttons": u8::from(held), "clickCount": 1, "pointerType": "mouse"});
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Presses and releases the mouse in the middle of the element.
    pub(crate) fn click(&mut self, selector: &str) {
        let at = self.middle(selector);
        self.mouse("mouseMoved", at, false);
        self.mouse("mousePressed", at, true);
        self.mouse("mouseReleased", at, false);
    }

    /// A finger that touches the window at the first point, moves over the others, and is lifted.
    pub(crate) fn finger(&mut self, points: &[[f64; 2]]) {
        for (i, [x, y]) in points.iter().enumerate() {
            let kind = if i == 0 { "touchStart" } else { "touchMove" };
            self.call(
                "Input.dispatchTouchEvent",
                json!({"type": kind, "touchPoints": [{"x": x, "y": y}]}),
            );
        }
        self.call("Input.dispatchTouchEvent", json!({"type": "touchEnd", "touchPoints": []}));
    }

    /// Presses and releases a key that types no text, by its name in JavaScript.
    pub(crate) fn key(&mut self, name: &str) {
        let code = match name {
            "Tab" => 9,
            "End" => 35,
            "Home" => 36,
            "ArrowLeft" => 37,
            "ArrowUp" => 38,
            "ArrowRight" => 39,
            "ArrowDown" => 40,
            _ => panic!("no code for key {name}"),
        };
        for kind in ["rawKeyDown", "keyUp"] {
            let event =
                json!({"type": kind, "key": name, "code": name, "windowsVirtualKeyCode": code});
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// The content of the window.
    pub(crate) fn screenshot(&mut self) -> image::RgbImage {
        self.wait_for_paint();
        let shot = self.call("Page.captureScreenshot", json!({"format": "png"}));
        let png = BASE64_STANDARD.decode(shot["data"].as_str().unwrap()).unwrap();
        image::load_from_memory(&png).unwrap().to_rgb8()
    }

    /// Waits for two frames, after which everything requested before has been painted.
    fn wait_for_paint(&mut self) {
        self.eval(
            "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(() => r(1))))",
        );
    }

    /// Sends a command and waits for its answer. Events that arrive meanwhile are recorded.
    pub(crate) fn call(&mut self, method: &str, params: Value) -> Value {
        self.try_call(method, params).unwrap_or_else(|error| panic!("{method}: {error:#}"))
    }

    /// The same; an error is DevTools' own.
    fn try_call(&mut self, method: &str, params: Value) -> Result<Value, Value> {
        self.next_id += 1;
        let id = self.next_id;
        let mut message = json!({"id": id, "method": method});
        message["params"] = params;
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        self.socket.send(Message::text(message.to_string())).unwrap();
        loop {
            let answer = match self.socket.read() {
                Ok(Message::Text(text)) => serde_json::from_str::<Value>(&text).unwrap(),
                Ok(_) => continue,
                Err(e) => panic!("Chromium did not answer {method}: {e}"),
            };
            if answer["id"] == json!(id) {
                return match answer.get("error") {
                    Some(error) => Err(error.clone()),
                    None => Ok(answer["result"].clone()),
                };
            }
            self.take_in(&answer);
        }
    }

    fn take_in(&mut self, event: &Value) {
        let params = &event["params"];
        match event["method"].as_str().unwrap_or_default() {
            "Runtime.exceptionThrown"
            | "Runtime.consoleAPICalled"
            | "Log.entryAdded"
            | "Network.loadingFailed" => self.complaints.push(params.to_string()),
            "Page.javascriptDialogOpening" => {
                self.complaints.push(format!("a dialog opened: {}", params["message"]));
            }
            "Network.requestWillBeSent" => {
                let url = params["request"]["url"].as_str().unwrap_or_default();
                self.requests.push(url.to_owned());
            }
            _ => {}
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The process may have ended by itself, and nothing is left to do then.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn launch(profile: &Path) -> Child {
    let wanted = std::env::var("CHROMIUM").ok();
    let names = wanted.as_deref().map_or(NAMES.to_vec(), |name| vec![name]);
    for name in &names {
        let process = Command::new(name)
            .args([
                "--headless=new",
                // Chromium's sandbox does not start for root or in containers. The pages are all
                // our own files.
                "--no-sandbox",
                "--no-first-run",
                "--disable-quic",
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
                "--disable-dev-shm-usage",
                "--remote-debugging-port=0",
            ])
            .arg(format!("--user-data-dir={}", profile.display()))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        match process {
            Ok(process) => return process,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
            Err(e) => panic!("cannot start {name}: {e}"),
        }
    }
    panic!(
        "the report is tested in Chromium, but there is no {}: run tools/setup (Debian: apt-get install \
         chromium), or name the program in the environment variable CHROMIUM",
        names.join(", ")
    );
}

/// When it is ready, Chromium writes the port and path of its socket to a file in its profile.
fn connect(profile: &Path) -> WebSocket<TcpStream> {
    let start = Instant::now();
    let (port, path) = loop {
        let text = std::fs::read_to_string(profile.join("DevToolsActivePort")).unwrap_or_default();
        if let Some((port, path)) = text.split_once('\n') {
            break (port.parse::<u16>().unwrap(), path.trim().to_owned());
        }
        assert!(start.elapsed() < PATIENCE, "Chromium did not start within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(20));
    };
    let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    tungstenite::client(format!("ws://127.0.0.1:{port}{path}"), stream).unwrap().0
}
