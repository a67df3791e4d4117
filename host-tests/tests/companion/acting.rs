//! Uploads from the page of a ground station, and requests that must not reach the chain.

use std::io::Read as _;
use std::time::{Duration, Instant};

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde_json::{Value, json};

use crate::chain::{Chain, Place, simulated};
use crate::files::{Files, answer, status_of, until};
use crate::medium::{Medium, QUIET};
use crate::process::{LIMIT, Relay};
use crate::web::{address, connect, snapshots};
use crate::with_source;

/// Web page of a ground station, as a browser uses it.
struct Page {
    address: String,
    token: String,
}

impl Page {
    fn open(station: &mut Relay) -> Self {
        let address = address(station);
        let first = snapshots(&address).next().unwrap();
        let token = first["token"].as_str().unwrap().to_owned();
        Self { address, token }
    }

    /// Returns the newest snapshot that the page has received.
    fn newest(&self) -> Value {
        snapshots(&self.address).next().unwrap()
    }

    /// Sends the page's request for a task, with the text `change[0]` replaced by `change[1]`.
    ///
    /// Returns the status and the body of the answer.
    fn sends(&self, path: &str, body: &Value, change: [&str; 2]) -> (u16, String) {
        let (own, body, token) = (&self.address, body.to_string(), &self.token);
        let length = body.len();
        let request = format!(
            "POST {path} HTTP/1.1\r\nHost: {own}\r\nOrigin: http://{own}\r\nX-Relay-Token: {token}\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
        );
        let request = request.replacen(change[0], change[1], 1);
        let mut answer = String::new();
        let _ = connect(own, request.as_bytes()).read_to_string(&mut answer);
        let status = answer.get(9..12).and_then(|it| it.parse().ok());
        let text = answer.split_once("\r\n\r\n").map(|(_, text)| text.trim());
        (status.unwrap_or(0), text.unwrap_or_default().to_owned())
    }

    fn post(&self, path: &str, body: &Value) -> (u16, String) {
        let mut body = body.clone();
        if path != "/preview" && body["time_s"].is_null() {
            body["time_s"] = self.newest()["time_s"].take();
        }
        self.sends(path, &body, ["", ""])
    }

    /// Checks that the station refuses an upload request that is more than 5 s old or has no time.
    fn refuses_old_times(&self, request: &Value) {
        let refused = self.sends("/upload", request, ["", ""]);
        assert!(refused.1.contains("missing field `time_s`"), "{refused:?}");
        let mut request = request.clone();
        request["time_s"] = json!(self.newest()["time_s"].as_f64().unwrap() - 6.0);
        let refused = self.post("/upload", &request);
        assert!(
            refused.0 == 409 && refused.1.contains("at most 5 s are allowed"),
            "{refused:?}"
        );
    }

    /// Waits until the page shows the task at stage `stage`, and returns the state of the task.
    fn until(&self, stage: &str) -> Value {
        let begun = Instant::now();
        let mut states = snapshots(&self.address).map(|mut it| it["desk"].take());
        let found = states.find(|it| {
            assert!(begun.elapsed() < LIMIT, "{it:#}");
            it["stage"] == stage
        });
        found.unwrap()
    }
}

fn f32_bits(value: &Value) -> u32 {
    (value.as_f64().unwrap() as f32).to_bits()
}

/// Starts two relays and the ground station at Tx (tty 2) on one radio channel. The channel has a free tty (3) for a station at Rx.
fn chain_with_page() -> (Chain, Relay, Page) {
    let mut chain = Chain::on_channel(2, Medium::new(4, QUIET));
    for index in [1, 2] {
        let signed = chain.files.signed("key", &format!("epoch{index}"));
        let relay = chain.relay(index, &signed);
        chain.relays.push(relay);
    }
    chain.lines("converged: ");
    let (tty, signed) = (chain.media[0].tty(2), chain.files.signed("key", "tx"));
    let [socket, capture] = ["status", "ground.pcapng"].map(|name| chain.files.text(name));
    let mut station = Relay::ground(&format!(
        "--of 2 --end tx --shared --stand --web 127.0.0.1:0 --tty {tty} --status-socket {socket} {signed} --capture {capture}"
    ));
    let page = Page::open(&mut station);
    (chain, station, page)
}

#[test]
fn the_page_uploads_what_it_has_shown_once_and_only_to_the_same_chain() {
    let (mut chain, mut station, page) = chain_with_page();
    let refused = page.post("/upload", &json!({ "preview": 1, "digest": "0x0000" }));
    assert_eq!(
        refused,
        (409, "there is no preview: make a preview first".to_owned())
    );
    let refused = page.post("/preview", &json!({ "altitude": "0" }));
    assert!(
        refused.0 == 409 && refused.1.contains("within 0.1 to 10000"),
        "{refused:?}"
    );
    // Outside the geofence: the preview names the relay and the limit, and cannot be uploaded.
    let (status, number) = page.post("/preview", &json!({ "altitude": "50" }));
    assert_eq!((status, &number[..]), (200, "{\"preview\":1}"));
    let state = page.until("failed");
    let why = "altitude 50 m: must be within 20 to 20 m (the relays' geofence, set before flight by --altitude and --band); every relay that controls a drone refuses this mission: relay 1 would be farthest outside, at altitude 50.0 m";
    assert_eq!(state["fault"], why);
    let request = json!({ "preview": 1, "digest": state["digest"] });
    assert_eq!(
        page.post("/upload", &request),
        (
            409,
            "preview 1 is not computed yet: try again later".to_owned()
        )
    );

    let uploaded: Vec<Place> = simulated(&with_source(80.0, 700.0, -300.0), 2);
    assert_eq!(
        page.post("/preview", &json!({ "interferer": "80,700,-300" }))
            .0,
        200
    );
    let state = page.until("ready");
    let preview = &state["preview"];
    let change = json!([{ "value": "interferer", "old": "80 W at x 500 m, y 400 m", "new": "80 W at x 700 m, y -300 m" }]);
    assert_eq!(preview["changes"], change);
    let moves = preview["moves"].as_array().unwrap();
    for (moved, place) in moves.iter().zip(&uploaded) {
        let to = ["x_m", "y_m", "h_m"].map(|part| f32_bits(&moved["to"][part]));
        assert_eq!(to, place[..3]);
        assert!(moved["metres"].as_f64().unwrap() > 10.0, "{moved}");
    }
    assert!(
        moves.len() == 2 && preview["worst_after"][0].is_f64(),
        "{preview}"
    );
    let digest = &state["digest"];
    let refused = page.post("/upload", &json!({ "preview": 1, "digest": digest }));
    assert!(
        refused.1.contains("the newest one, which is preview 2"),
        "{refused:?}"
    );
    let refused = page.post("/upload", &json!({ "preview": 2, "digest": "0x0000" }));
    assert!(refused.1.contains("has the digest 0x"), "{refused:?}");
    assert!(!chain.relays[0].has_printed("uploaded: "));
    let request = json!({ "preview": 2, "digest": digest });
    page.refuses_old_times(&request);
    // A preview is not shown as the flown mission.
    let shown = page.newest();
    assert!(
        shown["desk"]["adopted"] == json!([]) && shown["desk"]["shown"] == "0",
        "{shown:#}"
    );
    assert_eq!(page.post("/upload", &request).0, 200);
    // The same request again is refused at once, and later.
    let again = (
        409,
        "preview 2 was used already: make a new preview".to_owned(),
    );
    assert_eq!(page.post("/upload", &request), again);
    station.line("flown: 2 of 2 relays fly version 1 of the mission");
    assert_eq!(page.post("/upload", &request), again);
    chain.settles_at(&uploaded);
    let state = page.until("flown");
    assert_eq!(state["version"], 1);
    // Coordinates of a map of another mission are refused.
    // The relays' reports have the version with a delay.
    let name = format!("1,{}", digest.as_str().unwrap());
    let mut shown = snapshots(&page.address);
    assert!(shown.any(|it| it["desk"]["shown"] == name[..]));
    let of_before = json!({ "receiver": "990,0", "shown": "0" });
    assert_eq!(page.post("/preview", &of_before).0, 200);
    let why = page.until("failed")["fault"].take();
    assert!(
        why.as_str().unwrap().starts_with(
            "the map shows mission 0 (version and digest), but the chain flies mission 1,0x"
        ),
        "{why}"
    );

    // The other end of the chain uploads a mission after the preview.
    assert_eq!(page.post("/preview", &json!({ "noise": "1e-9" })).0, 200);
    let request = json!({ "preview": 4, "digest": page.until("ready")["digest"] });
    let (tty, signed) = (chain.media[0].tty(3), chain.files.signed("key", "rx"));
    Relay::ground(&format!(
        "--of 2 --end rx --shared --tty {tty} {signed} --version 2 --new-tx-power 2 --yes"
    ))
    .succeeds();
    assert_eq!(page.post("/upload", &request).0, 200);
    let state = page.until("failed");
    let why = "preview 4 was computed for version 1 of the mission, but the chain flies another mission now, version 2: make a new preview";
    assert_eq!(state["fault"], why);
    station.stopped();
    for relay in &mut chain.relays {
        assert!(!relay.has_printed("uploaded: version 3"));
    }
}

/// Checks that random previews equal, to the bit, the setpoints that the relays have after the upload.
///
/// `COUNT=200 cargo test --test companion acting::random_previews -- --nocapture` uploads 200 missions.
#[test]
fn random_previews_are_flown_as_they_were_shown() {
    let number = |name, default| {
        std::env::var(name).map_or(default, |it: String| it.parse::<u64>().unwrap())
    };
    let (count, seed) = (number("COUNT", 3), number("SEED", 1));
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut chain, station, page) = chain_with_page();
    // Rx beyond the geofence: no relay would be outside, but the refusal names the limit and a relay.
    assert_eq!(
        page.post("/preview", &json!({ "receiver": "1010,0" })).0,
        200
    );
    let fault = page.until("failed")["fault"].take();
    let why = "distance 1010 m: must be within 0 to 1000 m (the relays' geofence, set before flight by --distance); every relay that controls a drone refuses this mission: relay 2 would be nearest to the limit, at x ";
    assert!(fault.as_str().unwrap().starts_with(why), "{fault}");
    let (mut flown, mut refused) = (0, 0);
    while flown < count {
        let mut body = json!({ "interferer": format!(
            "{},{:.1},{:.1}",
            rng.random_range(20..200),
            rng.random_range(0.0..1_000.0),
            rng.random_range(150.0..600.0) * [1.0, -1.0][rng.random_range(0..2)],
        ) });
        if rng.random_bool(0.5) {
            body["receiver"] = json!(format!("{:.1},0", rng.random_range(700.0..1_010.0)));
        }
        if rng.random_bool(0.5) {
            body["tx-power"] = json!(format!("{:.2}", rng.random_range(0.5..4.0)));
        }
        if rng.random_bool(0.3) {
            body["uav-power"] = json!(format!("{:.2}", rng.random_range(0.5..4.0)));
        }
        if rng.random_bool(0.1) {
            body["altitude"] = json!("50");
        }
        let (status, answer) = page.post("/preview", &body);
        assert_eq!(status, 200, "{answer}");
        let number = serde_json::from_str::<Value>(&answer).unwrap()["preview"].take();
        let begun = Instant::now();
        let state = snapshots(&page.address)
            .map(|mut it| it["desk"].take())
            .find(|it| {
                assert!(begun.elapsed() < LIMIT, "{it:#}");
                it["number"] == number && (it["stage"] == "ready" || it["stage"] == "failed")
            });
        let state = state.unwrap();
        if state["stage"] == "failed" {
            // The limit is named, and a relay: with Rx beyond the line of the loaded mission all positions are within it.
            let why = state["fault"].as_str().unwrap();
            let place = if body["altitude"].is_null() {
                "relay 2 would be nearest to the limit, at x "
            } else {
                "relay 1 would be farthest outside, at altitude "
            };
            let names = why.contains("must be within") && why.contains(place);
            assert!(names, "{body}: {why}");
            refused += 1;
            continue;
        }
        assert!(body["altitude"].is_null(), "{body}");
        let moves = state["preview"]["moves"].as_array().unwrap();
        let request = json!({ "preview": number, "digest": state["digest"] });
        assert_eq!(page.post("/upload", &request).0, 200);
        assert_eq!(page.until("flown")["number"], number);
        for (relay, moved) in chain.relays.iter_mut().zip(moves) {
            let to = ["x_m", "y_m", "h_m"].map(|part| f32_bits(&moved["to"][part]));
            // A setpoint that stays has no new line.
            while moved["metres"] != 0.0 && crate::process::bits(&relay.line("setpoint: ")) != to {}
        }
        flown += 1;
    }
    println!("{flown} uploads flown as shown, {refused} refused");
    station.stopped();
}

/// Checks that a lost relay is cleared only at the station, and is shown again at its next report.
///
/// The capture records that the relay was cleared.
#[test]
fn a_lost_relay_is_cleared_from_the_page_until_it_reports_again() {
    let (mut chain, station, page) = chain_with_page();
    let numbers = |snapshot: &Value| {
        let relays = snapshot["relays"].as_array().unwrap().iter();
        relays
            .map(|it| it["number"].as_u64().unwrap())
            .collect::<Vec<_>>()
    };
    let lasting = |snapshot: &Value| {
        let alarms = snapshot["alarms"].as_array().unwrap().iter();
        alarms.filter(|it| it["cleared_s"].is_null()).count()
    };
    let shows = |is_so: &dyn Fn(&Value) -> bool| {
        let begun = Instant::now();
        snapshots(&page.address).find(|it| {
            assert!(begun.elapsed() < LIMIT, "{it:#}");
            is_so(it)
        })
    };
    shows(&|it| lasting(it) == 0);
    let refused = page.post("/clear", &json!({ "relay": 2 }));
    assert_eq!(refused, (409, "relay 2 is not lost".to_owned()));
    chain.relays.pop().unwrap().stopped();
    shows(&|it| {
        it["alarms"]
            .as_array()
            .unwrap()
            .iter()
            .any(|it| it["lost"] == 2 && it["cleared_s"].is_null())
    });
    shows(&|it| it["relays"][1]["age_s"].as_f64().unwrap() > 5.0);
    // A request of another origin, without the token, or that was held on the way clears nothing.
    let request = json!({ "relay": 2, "time_s": page.newest()["time_s"] });
    let foreign = [
        ["Origin: http://127", "Origin: http://evil.example?127"],
        ["X-Relay-Token", "X-Other"],
    ];
    for change in foreign {
        assert_eq!(page.sends("/clear", &request, change).0, 403);
    }
    let held = json!({ "relay": 2, "time_s": page.newest()["time_s"].as_f64().unwrap() - 6.0 });
    assert!(
        page.post("/clear", &held)
            .1
            .contains("at most 5 s are allowed")
    );
    assert_eq!(numbers(&page.newest()), [1, 2]);
    assert_eq!(
        page.post("/clear", &json!({ "relay": 2 })),
        (200, "{\"relay\":2}".to_owned())
    );
    shows(&|it| numbers(it) == [1] && lasting(it) == 0);
    // Replayed, and at the socket: it is not lost any more.
    assert_eq!(page.post("/clear", &json!({ "relay": 2 })).0, 409);
    let socket = chain.files.path("status");
    let told = answer(&socket, "clear-lost 2\n", false);
    assert!(told.contains("relay 2 is not lost"), "{told}");
    let signed = chain.files.signed("key", "epoch2b");
    std::fs::remove_file(chain.files.path("epoch2")).ok();
    let relay = chain.relay(2, &signed);
    chain.relays.push(relay);
    shows(&|it| numbers(it) == [1, 2] && it["relays"][1]["age_s"].as_f64().unwrap() < 5.0);
    // Lost again, it is cleared at the socket.
    chain.relays.pop().unwrap().stopped();
    let begun = Instant::now();
    loop {
        let told = answer(&socket, "clear-lost 2\n", false);
        if told.contains("\"done\":true") {
            break;
        }
        assert!(told.contains("relay 2 is not lost"), "{told}");
        assert!(begun.elapsed() < LIMIT, "{told}");
        std::thread::sleep(Duration::from_millis(500));
    }
    assert!(begun.elapsed() > Duration::from_secs(4));
    shows(&|it| numbers(it) == [1] && lasting(it) == 0);
    // The acts are in the capture with the frames that follow.
    std::thread::sleep(Duration::from_secs(2));
    station.stopped();
    let capture = std::fs::read(chain.files.path("ground.pcapng")).unwrap();
    for by in ["the page at 127.0.0.1", "user "] {
        let act = format!("operator: clear-lost 2 by {by}");
        let acts = capture.windows(act.len());
        assert_eq!(acts.filter(|it| *it == act.as_bytes()).count(), 1, "{act}");
    }
}

#[test]
fn requests_without_their_secrets_do_not_reach_the_chain() {
    let (mut chain, station, page) = chain_with_page();
    let received = || {
        let said = status_of(chain.files.path("status"));
        assert!(said["station"]["upload"].is_null(), "{said:#}");
        (
            Instant::now(),
            said["station"]["counters"]["received"].as_f64().unwrap(),
        )
    };
    let rate =
        |from: (Instant, f64), to: (Instant, f64)| (to.1 - from.1) / (to.0 - from.0).as_secs_f64();
    std::thread::sleep(Duration::from_secs(2));
    let first = received();
    std::thread::sleep(Duration::from_secs(8));
    let quiet = rate(first, received());
    assert!(quiet > 0.5, "{quiet} frames/s: the relays report");
    let begun = received();
    let browsers: Vec<_> = (0..50)
        .map(|_| {
            connect(
                &page.address,
                format!("GET /events HTTP/1.1\r\nHost: {}\r\n\r\n", page.address).as_bytes(),
            )
        })
        .collect();
    let (body, mut count) = (json!({ "interferer": "80,700,-300" }), 0);
    let mut longest = Duration::ZERO;
    while count < 5_000 || begun.0.elapsed() < Duration::from_secs(8) {
        for (change, expected) in [
            (["Host: 127.0.0.1", "Host: evil.example"], 403),
            (
                ["Origin: http://127.0.0.1", "Origin: http://evil.example"],
                403,
            ),
            (["Origin", "X-Origin"], 403),
            (["X-Relay-Token: ", "X-Relay-Token: 0"], 403),
            (["X-Relay-Token", "X-Token"], 403),
            (["application/json", "text/plain"], 400),
        ] {
            let (status, text) = page.sends("/preview", &body, change);
            // Slow readers take connections until they are dropped.
            assert!(
                status == expected || status == 503,
                "{change:?}: {status} {text}"
            );
            count += 1;
        }
        let asked = Instant::now();
        received();
        longest = longest.max(asked.elapsed());
    }
    let loaded = rate(begun, received());
    println!(
        "{count} requests; {quiet:.1} frames/s before, {loaded:.1} meanwhile; longest status {longest:?}"
    );
    assert!(loaded > 0.7 * quiet && longest < Duration::from_millis(1_500));
    drop(browsers);
    station.stopped();
    for relay in &mut chain.relays {
        assert!(!relay.has_printed("uploaded: "));
    }
}

#[test]
fn the_page_asks_for_the_password_in_the_file() {
    let (files, tty) = (Files::new(), crate::pty::Pty::new());
    let (signed, tty) = (files.signed("key", "epoch"), tty.path().display());
    let file = files.write_key("password", "correct horse\n");
    let web = format!("--web 127.0.0.1:0 --web-password {file}");
    let mut station = Relay::ground(&format!(
        "--of 1 --end tx --stand --tty {tty} {signed} {web}"
    ));
    let own = address(&mut station);
    for (password, status) in [
        ("OmNvcnJlY3QgaG9yc2Y=", "401"),
        ("OmNvcnJlY3QgaG9yc2U=", "200"),
    ] {
        let request =
            format!("GET / HTTP/1.1\r\nHost: {own}\r\nAuthorization: Basic {password}\r\n\r\n");
        let mut answer = String::new();
        let _ = connect(&own, request.as_bytes()).read_to_string(&mut answer);
        assert_eq!(&answer[9..12], status);
    }
    station.stopped();
}

#[test]
fn the_status_socket_takes_the_same_tasks() {
    let chain = Chain::with_ground(1, QUIET);
    let files = &chain.files;
    let mut relay = chain.relay(1, &files.signed("key", "relay"));
    relay.line("converged: ");
    let (socket, tty) = (files.text("status"), chain.tx.as_ref().unwrap().tty(0));
    let own = format!("--status-socket {socket} {}", files.signed("key", "ground"));
    let mut station = Relay::ground(&format!("--stand --end tx --of 1 --tty {tty} {own}"));
    let commanded = |line: &str| {
        let said = answer(&socket, &format!("{line}\n"), false);
        let said: Value = serde_json::from_str(&said).unwrap();
        (
            said["done"] == true,
            said["text"].as_str().unwrap().to_owned(),
        )
    };
    let usage = "must be `preview NAME=VALUE ...`, `upload NUMBER DIGEST` or `clear-lost NUMBER`, which need a station with --stand, or empty to read the state";
    for line in ["land", "preview altitude", "upload 1", "upload x 0x1"] {
        assert_eq!(
            commanded(line),
            (false, format!("command {line:?}: {usage}"))
        );
    }
    let refused = commanded("clear-lost 1");
    assert!(
        !refused.0 && refused.1.contains("start the station with --web"),
        "{refused:?}"
    );
    let refused = commanded("preview land=1");
    assert!(
        refused.1.contains("unexpected argument '--new-land'"),
        "{refused:?}"
    );
    assert_eq!(
        commanded("preview interferer=80,700,-300"),
        (true, "{\"preview\":1}".to_owned())
    );
    let said = until(&socket, |said| {
        said["station"]["upload"]["stage"] == "ready"
    });
    let digest = said["station"]["upload"]["digest"].as_str().unwrap();
    assert!(commanded(&format!("upload 1 {digest}")).0);
    station.line("flown: 1 of 1 relays fly version 1 of the mission");
    let refused = commanded(&format!("upload 1 {digest}"));
    assert_eq!(
        refused,
        (
            false,
            "preview 1 was used already: make a new preview".to_owned()
        )
    );
    relay.settles_at(simulated(&with_source(80.0, 700.0, -300.0), 1)[0]);
    station.stopped();
}
