//! A headless Chromium, over its DevTools protocol.

use std::io::{BufRead as _, BufReader};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use base64::Engine as _;
use host_tests::python;
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

/// Longest wait for a condition on the page, chosen so that slow machines pass.
const PATIENCE: Duration = Duration::from_secs(120);

/// Returns the code of axe-core, which finds faults of accessibility.
///
/// The code comes from the file that the environment variable AXE names, or else from the Python package of axe-core.
fn axe() -> String {
    if let Ok(file) = std::env::var("AXE") {
        return std::fs::read_to_string(file).unwrap();
    }
    let script = "import importlib.resources as r; print(r.files('axe_core_python').joinpath('axe.min.js').read_text())";
    let mut python = Command::new(python::interpreter());
    let output = python.args(["-c", script]).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

pub(crate) struct Browser {
    process: Child,
    socket: WebSocket<TcpStream>,
    session: String,
    number: u64,
    errors: Vec<String>,
    _folder: tempfile::TempDir,
}

impl Browser {
    pub(crate) fn start(url: &str, width: u32, height: u32) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut process = Command::new("chromium")
            .args(["--headless", "--no-sandbox", "--disable-gpu"])
            .args(["--disable-dev-shm-usage", "--remote-debugging-port=0"])
            .arg(format!("--user-data-dir={}", folder.path().display()))
            .arg(format!("--window-size={width},{height}"))
            .arg("about:blank")
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("chromium; `cargo ci` adds it");
        let mut lines = BufReader::new(process.stderr.take().unwrap()).lines();
        let address = lines
            .find_map(|line| {
                let line = line.unwrap();
                line.strip_prefix("DevTools listening on ")
                    .map(str::to_owned)
            })
            .expect("an address");
        // Keeps reading, because a full pipe would block the browser.
        std::thread::spawn(move || lines.for_each(drop));
        let host = address
            .strip_prefix("ws://")
            .unwrap()
            .split('/')
            .next()
            .unwrap();
        let stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) = tungstenite::client(&*address, stream).unwrap();
        let mut browser = Self {
            process,
            socket,
            session: String::new(),
            number: 0,
            errors: Vec::new(),
            _folder: folder,
        };
        let target = browser.call("Target.createTarget", &json!({"url": "about:blank"}));
        let attach = json!({"targetId": target["targetId"], "flatten": true});
        let session = browser.call("Target.attachToTarget", &attach);
        session["sessionId"]
            .as_str()
            .unwrap()
            .clone_into(&mut browser.session);
        for domain in ["Page.enable", "Runtime.enable", "Log.enable"] {
            browser.call(domain, &json!({}));
        }
        let metrics = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600});
        browser.call("Emulation.setDeviceMetricsOverride", &metrics);
        let touch = json!({"enabled": width < 600, "maxTouchPoints": 1});
        browser.call("Emulation.setTouchEmulationEnabled", &touch);
        browser.open(url);
        browser
    }

    pub(crate) fn open(&mut self, url: &str) {
        self.call("Page.navigate", &json!({"url": url}));
    }

    fn call(&mut self, method: &str, parameters: &Value) -> Value {
        self.number += 1;
        let mut message = json!({"id": self.number, "method": method, "params": parameters});
        if !self.session.is_empty() {
            message["sessionId"] = self.session.clone().into();
        }
        self.socket
            .send(Message::text(message.to_string()))
            .unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else {
                continue;
            };
            let mut heard: Value = serde_json::from_str(&text).unwrap();
            if heard["id"] == self.number {
                assert!(heard["error"].is_null(), "{method}: {heard}");
                return heard["result"].take();
            }
            let method = heard["method"].as_str().unwrap_or_default();
            let is_bad = method == "Runtime.exceptionThrown"
                || method == "Runtime.consoleAPICalled" && heard["params"]["type"] == "error"
                || method == "Log.entryAdded" && heard["params"]["entry"]["level"] == "error";
            if is_bad {
                self.errors.push(heard["params"].to_string());
            }
        }
    }

    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let parameters =
            json!({"expression": expression, "returnByValue": true, "awaitPromise": true});
        let mut result = self.call("Runtime.evaluate", &parameters);
        assert!(
            result["exceptionDetails"].is_null(),
            "{expression}: {result}"
        );
        result["result"]["value"].take()
    }

    pub(crate) fn text(&mut self, expression: &str) -> String {
        let value = self.value(expression);
        value
            .as_str()
            .unwrap_or_else(|| panic!("{expression}: {value}"))
            .to_owned()
    }

    pub(crate) fn run(&mut self, script: &str) {
        self.value(&format!("(() => {{ {script}; return 0; }})()"));
    }

    pub(crate) fn until(&mut self, condition: &str) {
        let begun = Instant::now();
        while self.value(&format!("Boolean({condition})")) != true {
            assert!(begun.elapsed() < PATIENCE, "never: {condition}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Drags the mouse from one screen point, px, to another in a number of steps.
    pub(crate) fn drag(&mut self, from: [f64; 2], to: [f64; 2], steps: u8) {
        let mut mouse = |kind: &str, [x, y]: [f64; 2]| {
            let parameters = json!({
                "type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1,
            });
            self.call("Input.dispatchMouseEvent", &parameters);
        };
        mouse("mousePressed", from);
        for step in 1..=steps {
            let part = f64::from(step) / f64::from(steps);
            mouse(
                "mouseMoved",
                [0, 1].map(|at| from[at] + part * (to[at] - from[at])),
            );
        }
        mouse("mouseReleased", to);
    }

    /// Drags a finger on the touch screen from one point, px, to another in a number of steps.
    pub(crate) fn finger(&mut self, from: [f64; 2], to: [f64; 2], steps: u8) {
        let mut touch = |kind: &str, points: Value| {
            let parameters = json!({"type": kind, "touchPoints": points});
            self.call("Input.dispatchTouchEvent", &parameters);
        };
        touch("touchStart", json!([{"x": from[0], "y": from[1]}]));
        for step in 1..=steps {
            let part = f64::from(step) / f64::from(steps);
            let [x, y] = [0, 1].map(|at| from[at] + part * (to[at] - from[at]));
            touch("touchMove", json!([{"x": x, "y": y}]));
        }
        touch("touchEnd", json!([]));
    }

    pub(crate) fn prefer_dark(&mut self) {
        let features = json!({"features": [{"name": "prefers-color-scheme", "value": "dark"}]});
        self.call("Emulation.setEmulatedMedia", &features);
    }

    /// Returns all nodes of the page's accessibility tree, which screen readers use.
    pub(crate) fn accessible(&mut self) -> Vec<Value> {
        let tree = self.call("Accessibility.getFullAXTree", &json!({}));
        tree["nodes"].as_array().unwrap().clone()
    }

    /// Checks the page by all rules of axe-core.
    ///
    /// `what` describes the tested page in the message of a failed check.
    pub(crate) fn passes_axe(&mut self, what: &str) {
        self.run(&axe());
        let faults = self.value(
            "axe.run({ resultTypes: ['violations'] }).then((it) => it.violations.map((one) => `${one.impact} ${one.id}: ${one.nodes.map((node) => node.target).join()}`))",
        );
        assert_eq!(faults.to_string(), "[]", "axe-core, {what}");
    }

    pub(crate) fn key(&mut self, key: &str, code: u32) {
        for kind in ["keyDown", "keyUp"] {
            let parameters = json!({"type": kind, "key": key, "windowsVirtualKeyCode": code});
            self.call("Input.dispatchKeyEvent", &parameters);
        }
    }

    pub(crate) fn types(&mut self, text: &str) {
        for letter in text.chars() {
            let parameters = json!({"text": letter.to_string()});
            self.call("Input.insertText", &parameters);
        }
    }

    /// Returns a screenshot of the whole page as PNG bytes.
    pub(crate) fn screenshot(&mut self) -> Vec<u8> {
        let parameters = json!({"format": "png", "captureBeyondViewport": true});
        let picture = self.call("Page.captureScreenshot", &parameters);
        let data = picture["data"].as_str().unwrap();
        base64::prelude::BASE64_STANDARD.decode(data).unwrap()
    }

    /// Returns a screenshot of the visible part of the page as PNG bytes.
    pub(crate) fn seen(&mut self) -> Vec<u8> {
        let picture = self.call("Page.captureScreenshot", &json!({"format": "png"}));
        let data = picture["data"].as_str().unwrap();
        base64::prelude::BASE64_STANDARD.decode(data).unwrap()
    }

    pub(crate) fn errors(&mut self) -> Vec<String> {
        // Waits for a reply, after all earlier messages.
        self.value("0");
        self.errors.clone()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        _ = self.process.kill();
        _ = self.process.wait();
    }
}
