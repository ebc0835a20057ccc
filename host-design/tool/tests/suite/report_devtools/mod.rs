//! A headless browser, controlled with the Chrome DevTools protocol over a pipe.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

use serde_json::{Value, json};
use upright_test_support::limits::{Running, received};

use crate::equipment::{is_required, not_exercised};

pub(crate) struct Browser {
    process: Running,
    input: ChildStdin,
    messages: Receiver<Value>,
    events: Vec<Value>,
    sent: u64,
    session: Option<String>,
    /// Selector of the page inside the page in which expressions are evaluated; none for the page itself.
    pub(crate) inside: Option<&'static str>,
    /// Whether the pages opened from now on are told that the person prefers reduced motion.
    pub(crate) reduces_motion: bool,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// Starts the browser for a test of `what`; `None` if there is no Chromium or Chrome on this machine, and none is
    /// required.
    pub(crate) fn for_test_of(what: &str) -> Option<Self> {
        let browser = Self::start();
        if browser.is_none() {
            let missing = "no chromium or google-chrome in the PATH";
            assert!(!is_required("UPRIGHT_REQUIRE_BROWSER"), "{missing}");
            not_exercised(&format!("{what} in a browser: {missing}"));
        }
        browser
    }

    /// Starts the browser; `None` if there is no Chromium or Chrome on this machine.
    fn start() -> Option<Self> {
        let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
        let folders = std::env::var_os("PATH")?;
        let program = std::env::split_paths(&folders)
            .flat_map(|folder| names.map(|name| folder.join(name)))
            .find(|path| path.is_file())?;
        let profile = tempfile::tempdir().unwrap();
        // The browser reads messages from descriptor 3 and writes to 4. Its sandbox does not run as root.
        let process = Command::new("sh")
            .args(["-c", r#"exec "$0" "$@" 3<&0 4>&1 0</dev/null 1>/dev/null 2>/dev/null"#])
            .arg(program)
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--remote-debugging-pipe",
                "--no-first-run",
                // For `Browser::heap`.
                "--js-flags=--expose-gc",
                "--enable-precise-memory-info",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut process = Running(process);
        let (input, output) = (process.stdin.take().unwrap(), process.stdout.take().unwrap());
        let (sender, messages) = channel();
        std::thread::spawn(move || {
            for message in BufReader::new(output).split(0).map_while(Result::ok) {
                if sender.send(serde_json::from_slice(&message).unwrap()).is_err() {
                    return;
                }
            }
        });
        let mut browser = Self {
            process,
            input,
            messages,
            events: Vec::new(),
            sent: 0,
            session: None,
            inside: None,
            reduces_motion: false,
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }))["targetId"].clone();
        let attach = json!({ "targetId": target, "flatten": true });
        browser.session =
            browser.call("Target.attachToTarget", attach)["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.sent += 1;
        let mut message = json!({ "id": self.sent, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.input.write_all(format!("{message}\0").as_bytes()).unwrap();
        loop {
            let answer = received(&self.messages, &format!("the browser's answer to {method}"));
            if answer["id"] == json!(self.sent) {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            self.events.push(answer);
        }
    }

    /// Opens a file in a window of this width (CSS pixels), with the colour scheme `scheme` (`light` or `dark`) and
    /// the medium `medium` (`screen` or `print`).
    pub(crate) fn open(&mut self, page: &Path, width: u32, scheme: &str, medium: &str) {
        self.open_address(&format!("file://{}", page.display()), width, scheme, medium);
    }

    /// As [`Browser::open`], with an address.
    pub(crate) fn open_address(&mut self, address: &str, width: u32, scheme: &str, medium: &str) {
        let metrics = json!({ "width": width, "height": 844, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        let motion = if self.reduces_motion { "reduce" } else { "no-preference" };
        let features = [("prefers-color-scheme", scheme), ("prefers-reduced-motion", motion)]
            .map(|(name, value)| json!({ "name": name, "value": value }));
        self.call("Emulation.setEmulatedMedia", json!({ "media": medium, "features": features }));
        self.events.clear();
        self.call("Page.navigate", json!({ "url": address }));
        while !self.events.iter().any(|event| event["method"] == "Page.loadEventFired") {
            let event = received(&self.messages, &format!("{address} is loaded"));
            self.events.push(event);
        }
    }

    /// Memory that the page uses (bytes), after garbage collection: the least of several moments, because messages on
    /// their way count, too.
    pub(crate) fn heap(&mut self) -> f64 {
        let moment = |_| {
            std::thread::sleep(std::time::Duration::from_millis(200));
            // In one expression: the page does nothing in between.
            self.value("(gc(), gc(), performance.memory.usedJSHeapSize)").as_f64().unwrap()
        };
        (0..5).map(moment).fold(f64::INFINITY, f64::min)
    }

    /// Number of objects that the page keeps, after garbage collection: the least of several moments, because messages
    /// on their way count, too. It depends on no timing, unlike the memory that they take.
    pub(crate) fn objects(&mut self) -> f64 {
        let moment = |_| {
            std::thread::sleep(std::time::Duration::from_millis(200));
            let kind =
                self.call("Runtime.evaluate", json!({ "expression": "Object.prototype" }))["result"].clone();
            let of_kind = json!({ "prototypeObjectId": kind["objectId"], "objectGroup": "counted" });
            let found = self.call("Runtime.queryObjects", of_kind)["objects"]["objectId"].clone();
            let count = json!({
                "objectId": found, "functionDeclaration": "function () { return this.length; }", "returnByValue": true
            });
            let number = self.call("Runtime.callFunctionOn", count)["result"]["value"].as_f64().unwrap();
            self.call("Runtime.releaseObjectGroup", json!({ "objectGroup": "counted" }));
            number
        };
        (0..5).map(moment).fold(f64::INFINITY, f64::min)
    }

    /// Processor time of the page's thread for scripts, styles and layout since the first call (s): all but the drawing
    /// itself, which a graphics card does where there is one.
    pub(crate) fn worked_s(&mut self) -> f64 {
        self.call("Performance.enable", json!({ "timeDomain": "threadTicks" }));
        let answer = self.call("Performance.getMetrics", json!({}));
        let metrics = answer["metrics"].as_array().unwrap();
        let work = ["ScriptDuration", "RecalcStyleDuration", "LayoutDuration"];
        let is_work = |metric: &&Value| work.iter().any(|name| metric["name"] == *name);
        metrics.iter().filter(is_work).map(|metric| metric["value"].as_f64().unwrap()).sum()
    }

    /// Moves, presses or releases the mouse at a point of the window (CSS pixels), as the system would.
    pub(crate) fn mouse(&mut self, kind: &str, [x, y]: [f64; 2]) {
        let buttons = i32::from(kind != "mouseReleased");
        let event =
            json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Presses and releases a key.
    pub(crate) fn key(&mut self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key }));
        }
    }

    /// Presses or releases a key (`keyDown`, `keyUp`) so that the browser does what it does for it: writes a letter,
    /// moves the focus (Tab), presses a button (Enter).
    pub(crate) fn key_event(&mut self, kind: &str, key: &str) {
        let (text, code) = match key {
            "Enter" => ("\r", 13),
            "Tab" => ("", 9),
            key if key.len() == 1 => (key, 0),
            _ => ("", 0),
        };
        let text = if kind == "keyDown" { text } else { "" };
        let event = json!({ "type": kind, "key": key, "text": text, "windowsVirtualKeyCode": code });
        self.call("Input.dispatchKeyEvent", event);
    }

    /// Presses and releases a key, as [`Browser::key_event`].
    pub(crate) fn strike(&mut self, key: &str) {
        self.key_event("keyDown", key);
        self.key_event("keyUp", key);
    }

    /// An editing command at the focus, such as `selectAll`, which the keys of each system give in another way.
    pub(crate) fn edit(&mut self, command: &str) {
        self.call("Input.dispatchKeyEvent", json!({ "type": "keyDown", "key": "", "commands": [command] }));
    }

    /// Roles of the controls without a name, which a screen reader cannot tell apart.
    pub(crate) fn unnamed_controls(&mut self) -> Vec<String> {
        let tree = self.call("Accessibility.getFullAXTree", json!({}));
        let roles = ["slider", "button", "textbox", "combobox", "checkbox", "spinbutton", "link"];
        let is_control = |node: &&Value| roles.iter().any(|role| node["role"]["value"] == *role);
        let controls: Vec<&Value> = tree["nodes"].as_array().unwrap().iter().filter(is_control).collect();
        assert!(!controls.is_empty(), "no controls");
        let has_no_name =
            |node: &&&Value| node["name"]["value"].as_str().unwrap_or_default().trim().is_empty();
        controls.iter().filter(has_no_name).map(|node| node["role"]["value"].to_string()).collect()
    }

    /// The upper part of the page, as wide as the window, as a PNG in the letters of RFC 4648.
    pub(crate) fn picture(&mut self, [width, height]: [u32; 2]) -> String {
        let clip = json!({ "x": 0, "y": 0, "width": width, "height": height, "scale": 1 });
        let how = json!({ "format": "png", "clip": clip, "captureBeyondViewport": true });
        self.call("Page.captureScreenshot", how)["data"].as_str().unwrap().to_owned()
    }

    /// From now on, what the page saves goes into this folder.
    pub(crate) fn save_into(&mut self, folder: &Path) {
        let behaviour = json!({ "behavior": "allow", "downloadPath": folder });
        self.call("Page.setDownloadBehavior", behaviour);
    }

    /// Memory of the pages' processes (KiB); `None` where the system does not tell.
    pub(crate) fn resident_kib(&self) -> Option<u64> {
        let read = |id: u32, file: &str| std::fs::read_to_string(format!("/proc/{id}/{file}")).ok();
        let field = |id: u32, name: &str| -> Option<u64> {
            let status = read(id, "status")?;
            status.lines().find(|line| line.starts_with(name))?.split_whitespace().nth(1)?.parse().ok()
        };
        let is_own = |mut id: u32| {
            while id > 1 && id != self.process.id() {
                id = field(id, "PPid:").map_or(0, |parent| parent as u32);
            }
            id == self.process.id()
        };
        let processes = std::fs::read_dir("/proc").ok()?;
        let ids = processes.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse::<u32>().ok());
        let pages = ids.filter(|&id| {
            read(id, "cmdline").is_some_and(|line| line.contains("--type=renderer")) && is_own(id)
        });
        pages.filter_map(|id| field(id, "RssAnon:")).reduce(|one, other| one + other)
    }

    /// The value of an expression; waits for promises.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let expression = match self.inside {
            Some(frame) => {
                format!("with (document.querySelector('{frame}').contentWindow) {{ {expression} }}")
            }
            None => expression.to_owned(),
        };
        let parameters = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", parameters);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Errors of the page since it was opened, and its requests to a network.
    pub(crate) fn errors(&mut self) -> Vec<String> {
        // By the time of this answer, the browser has reported everything that happened before.
        self.value("0");
        let told = |event: &Value| match event["method"].as_str()? {
            "Runtime.exceptionThrown" => Some(event["params"]["exceptionDetails"].to_string()),
            "Log.entryAdded" => Some(event["params"]["entry"].to_string()),
            "Runtime.consoleAPICalled" => Some(event["params"]["args"].to_string()),
            "Network.requestWillBeSent" => {
                let url = event["params"]["request"]["url"].as_str()?;
                let is_own = ["file:", "data:", "blob:", "about:", "http://127.0.0.1:"]
                    .iter()
                    .any(|own| url.starts_with(own));
                (!is_own).then(|| format!("request for {url}"))
            }
            _ => None,
        };
        self.events.iter().filter_map(told).collect()
    }
}
