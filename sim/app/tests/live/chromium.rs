//! A headless Chromium, driven through its `DevTools` socket.

use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;
use tungstenite::{Message, WebSocket};

/// Time that the browser has for an answer: software drawing on a busy machine is slow.
const PATIENCE: Duration = Duration::from_secs(120);

const FLAGS: &str = "--headless --no-sandbox --disable-quic --no-first-run \
    --disable-background-networking --disable-component-update --disable-sync \
    --disable-dev-shm-usage --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader \
    --remote-debugging-port=0";

/// Writes a picture where `PHYXEL_SHOTS` says.
pub(crate) fn show(name: &str, png: &[u8]) {
    if let Some(folder) = std::env::var_os("PHYXEL_SHOTS") {
        std::fs::write(PathBuf::from(folder).join(format!("{name}.png")), png).unwrap();
    }
}

/// The browser with one page.
pub(crate) struct Chromium {
    child: Child,
    socket: WebSocket<TcpStream>,
    session: String,
    next: u64,
    _profile: TempDir,
}

/// Where Chromium is: `PHYXEL_CHROMIUM`, or on the path.
pub(crate) fn find() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("PHYXEL_CHROMIUM") {
        return Some(named.into());
    }
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    names
        .iter()
        .flat_map(|name| folders.iter().map(move |folder| folder.join(name)))
        .find(|file| file.is_file())
}

impl Chromium {
    /// Starts the browser with a new profile and an empty page of the given size.
    pub(crate) fn start(program: &Path, [width, height]: [u32; 2]) -> Self {
        let profile = tempfile::tempdir().unwrap();
        let child = Command::new(program)
            .args(FLAGS.split_whitespace())
            .arg(format!("--window-size={width},{height}"))
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // The browser writes its port and the path of its socket there.
        let told = profile.path().join("DevToolsActivePort");
        let begun = Instant::now();
        let text = loop {
            match std::fs::read_to_string(&told) {
                Ok(text) if text.lines().count() == 2 => break text,
                _ => assert!(begun.elapsed() < PATIENCE, "the browser does not start"),
            }
            std::thread::sleep(Duration::from_millis(50));
        };
        let (port, path) = text.split_once('\n').unwrap();
        let stream = TcpStream::connect(format!("127.0.0.1:{port}")).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let url = format!("ws://127.0.0.1:{port}{path}");
        let (socket, _) = tungstenite::client(url, stream).unwrap();
        let mut browser = Self {
            child,
            socket,
            session: String::new(),
            next: 0,
            _profile: profile,
        };
        let target = browser.ask("Target.createTarget", &json!({ "url": "about:blank" }));
        let id = &target["targetId"];
        let attach = json!({ "targetId": id, "flatten": true });
        let attached = browser.ask("Target.attachToTarget", &attach);
        browser.session = attached["sessionId"].as_str().unwrap().to_owned();
        let size =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        browser.ask("Emulation.setDeviceMetricsOverride", &size);
        let fingers = json!({ "enabled": true, "maxTouchPoints": 2 });
        browser.ask("Emulation.setTouchEmulationEnabled", &fingers);
        browser
    }

    /// Calls a method and waits for its result.
    fn ask(&mut self, method: &str, parameters: &Value) -> Value {
        let told = self.call(method, parameters);
        assert!(told.get("error").is_none(), "{method}: {told}");
        told["result"].clone()
    }

    /// Calls a method and waits for what is told of it.
    fn call(&mut self, method: &str, parameters: &Value) -> Value {
        self.next += 1;
        let mut call = json!({ "id": self.next, "method": method, "params": parameters });
        if !self.session.is_empty() {
            call["sessionId"] = json!(self.session);
        }
        self.socket.send(Message::text(call.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else {
                continue;
            };
            let told: Value = serde_json::from_str(&text).unwrap();
            if told["id"] == self.next {
                return told;
            }
        }
    }

    pub(crate) fn go(&mut self, url: &str) {
        self.ask("Page.navigate", &json!({ "url": url }));
    }

    /// The value of an expression, awaited.
    pub(crate) fn evaluate(&mut self, expression: &str) -> Value {
        let parameters =
            json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let found = self.ask("Runtime.evaluate", &parameters);
        let thrown = found.get("exceptionDetails");
        assert!(thrown.is_none(), "{expression}: {found}");
        found["result"]["value"].clone()
    }

    /// The number that an expression gives.
    pub(crate) fn number(&mut self, expression: &str) -> f64 {
        self.evaluate(expression).as_f64().unwrap()
    }

    /// Waits until an expression is true, in a page that may be loaded meanwhile.
    pub(crate) fn wait(&mut self, expression: &str) {
        let begun = Instant::now();
        let asked =
            json!({ "expression": format!("Boolean({expression})"), "returnByValue": true });
        while self.call("Runtime.evaluate", &asked)["result"]["result"]["value"] != json!(true) {
            if begun.elapsed() >= PATIENCE {
                let told = "window.stage && [stage.state?.step, stage.panel?.last, \
                    document.getElementById('notes').textContent]";
                panic!("not in time: {expression}; {}", self.evaluate(told));
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// A pointer event as from a mouse with its left button.
    pub(crate) fn mouse(&mut self, kind: &str, place: [f64; 2]) {
        self.pointer(kind, place, &json!({}));
    }

    /// A pointer event as from a pen's tip, pressed by 0 to 1.
    pub(crate) fn pen(&mut self, kind: &str, place: [f64; 2], force: f64) {
        let pen = json!({ "pointerType": "pen", "force": force });
        self.pointer(kind, place, &pen);
    }

    fn pointer(&mut self, kind: &str, [x, y]: [f64; 2], more: &Value) {
        let pressed = i32::from(kind != "mouseReleased");
        let mut event = json!({
            "type": kind, "x": x, "y": y, "button": "left", "buttons": pressed, "clickCount": 1,
        });
        let more = more.as_object().into_iter().flatten();
        more.for_each(|(key, value)| event[key] = value.clone());
        self.ask("Input.dispatchMouseEvent", &event);
    }

    /// Fingers on the screen, each at a position.
    pub(crate) fn touch(&mut self, kind: &str, places: &[[f64; 2]]) {
        let points = places.iter().enumerate();
        let points = points.map(|(id, [x, y])| json!({ "x": x, "y": y, "id": id }));
        let points: Vec<Value> = points.collect();
        let event = json!({ "type": kind, "touchPoints": points });
        self.ask("Input.dispatchTouchEvent", &event);
    }

    pub(crate) fn key(&mut self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            let event = json!({ "type": kind, "key": key, "text": key });
            self.ask("Input.dispatchKeyEvent", &event);
        }
    }

    /// Presses at the first position and drags to the others, without letting go.
    pub(crate) fn drag(&mut self, places: &[[f64; 2]]) {
        self.mouse("mousePressed", places[0]);
        for pair in places.windows(2) {
            for k in 1..=8 {
                let share = f64::from(k) / 8.0;
                let at = [0, 1].map(|i| pair[0][i] + share * (pair[1][i] - pair[0][i]));
                self.mouse("mouseMoved", at);
            }
        }
    }

    /// The same, and lets go at the last.
    pub(crate) fn stroke(&mut self, places: &[[f64; 2]]) {
        self.drag(places);
        self.mouse("mouseReleased", places[places.len() - 1]);
    }

    /// Writes what the page looks like where `PHYXEL_SHOTS` says; without it, nothing is drawn for that.
    pub(crate) fn shot(&mut self, name: &str) {
        if std::env::var_os("PHYXEL_SHOTS").is_some() {
            let shot = self.ask("Page.captureScreenshot", &json!({ "format": "png" }));
            show(name, &self.bytes(&shot["data"].to_string()));
        }
    }

    /// Bytes of a text in base 64 (RFC 4648) that an expression gives.
    pub(crate) fn bytes(&mut self, base64: &str) -> Vec<u8> {
        let numbers = format!("[...atob({base64})].map((c) => c.charCodeAt(0))");
        serde_json::from_value(self.evaluate(&numbers)).unwrap()
    }
}

impl Drop for Chromium {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
