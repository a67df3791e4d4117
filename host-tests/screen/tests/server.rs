//! Server under load: many browsers, foreign pages, malformed requests and slow readers.
//!
//! The chain must not notice them: each test measures how long `Screen::show` takes meanwhile.
#![cfg(test)]

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use uav_relay_screen::{
    Hop, LogLine, MAX_STREAMS, Node, Position, Post, RelaySnapshot, Screen, ScreenError, Snapshot,
    Task,
};

/// Time within which 99 % of the calls of `Screen::show` return, or half of fewer than [`MANY`] calls.
///
/// The others may be late, because a busy machine may take the processor away at any time.
const SHOW_TIME: Duration = Duration::from_millis(1);

/// Number of calls of `Screen::show` whose slowest 1 % are judged.
const MANY: usize = 1000;

/// Time within which all calls of `Screen::show` have to return: far less than a browser's time limits.
const NEVER: Duration = Duration::from_millis(500);

fn started() -> Screen {
    Screen::start("127.0.0.1:0".parse().unwrap()).unwrap()
}

/// Returns a snapshot of `relays` relays at the time `time_s`, with one log line.
fn snapshot(relays: u16, time_s: f64) -> Snapshot {
    let place = |number: u16| Position {
        x_m: 10.0 * f64::from(number),
        y_m: 0.123_456_789,
        altitude_m: Some(20.0),
    };
    let relay = |number| RelaySnapshot {
        age_s: Some(0.1),
        position: Some(place(number)),
        setpoint: Some(place(number)),
        agreed: Some(place(number)),
        phase: Some("agreed".to_owned()),
        ..RelaySnapshot::new(number)
    };
    Snapshot {
        time_s: Some(time_s),
        relays: (1..=relays).map(relay).collect(),
        hops: (1..relays)
            .map(|number| Hop::new(Node::Relay(number), Node::Relay(number + 1)))
            .collect(),
        log: vec![LogLine {
            time_s,
            text: "relay 1  setpoint".to_owned(),
        }],
        ..Snapshot::default()
    }
}

fn connect(screen: &Screen) -> TcpStream {
    let stream = TcpStream::connect(screen.address()).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(20)))
        .unwrap();
    stream
}

/// Sends `request` and returns the response.
///
/// The response is empty if the server closes the connection without a response.
fn asked(screen: &Screen, request: &[u8]) -> String {
    let mut stream = connect(screen);
    _ = stream.write_all(request);
    _ = stream.shutdown(Shutdown::Write);
    let mut response = Vec::new();
    _ = stream.read_to_end(&mut response);
    String::from_utf8(response).unwrap()
}

fn get(screen: &Screen, path: &str) -> Vec<u8> {
    format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", screen.address()).into_bytes()
}

/// Opens the server's stream of snapshots of the chain.
fn events(screen: &Screen) -> BufReader<TcpStream> {
    let mut stream = connect(screen);
    stream.write_all(&get(screen, "/events")).unwrap();
    BufReader::new(stream)
}

/// Reads the stream until a snapshot of at least the time `time_s` has arrived; returns its JSON.
fn until(reader: &mut BufReader<TcpStream>, time_s: f64) -> serde_json::Value {
    loop {
        let mut line = String::new();
        assert!(reader.read_line(&mut line).unwrap() > 0, "the stream ended");
        if let Some(text) = line.strip_prefix("data: {") {
            let json: serde_json::Value = serde_json::from_str(&format!("{{{text}")).unwrap();
            if json["time_s"].as_f64() >= Some(time_s) {
                return json;
            }
        }
    }
}

/// Simulated flight: a thread that shows snapshots of 100 relays and measures the time of each call.
struct Flight {
    has_ended: Arc<AtomicBool>,
    thread: thread::JoinHandle<Vec<Duration>>,
}

impl Flight {
    fn begin(screen: &Arc<Screen>, period: Duration) -> Self {
        let has_ended = Arc::new(AtomicBool::new(false));
        let (screen, stop) = (Arc::clone(screen), Arc::clone(&has_ended));
        let thread = thread::spawn(move || {
            let mut took = Vec::new();
            let mut time_s = 0.0;
            while !stop.load(Ordering::Relaxed) {
                time_s += 0.01;
                let snapshot = snapshot(100, time_s);
                let begun = Instant::now();
                screen.show(snapshot);
                took.push(begun.elapsed());
                thread::sleep(period);
            }
            took
        });
        Self { has_ended, thread }
    }

    /// Stops the thread, and asserts that no call of `Screen::show` waited for a browser.
    fn end(self, what: &str) {
        self.has_ended.store(true, Ordering::Relaxed);
        let mut took = self.thread.join().unwrap();
        took.sort();
        let calls = took.len();
        let late = if calls < MANY { calls / 2 } else { calls / 100 };
        let (median, slow, longest) = (took[calls / 2], took[calls - 1 - late], took[calls - 1]);
        println!(
            "{what}: {calls} calls of show: median {median:?}, all but {late} within {slow:?}, longest {longest:?}"
        );
        assert!(slow < SHOW_TIME, "{what}: {slow:?}");
        assert!(longest < NEVER, "{what}: {longest:?}");
    }
}

/// Returns the memory that this process uses, bytes.
fn memory() -> usize {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = text.split(' ').nth(1).and_then(|it| it.parse().ok());
    4096 * pages.unwrap_or(0_usize)
}

#[test]
fn the_page_comes_with_a_policy_and_needs_nothing_from_elsewhere() {
    let screen = started();
    let mut page = String::new();
    for path in [
        "/",
        "/screen.css",
        "/map.js",
        "/alarms.js",
        "/screen.js",
        "/icon.svg",
    ] {
        let response = asked(&screen, &get(&screen, path));
        let (head, body) = response.split_once("\r\n\r\n").unwrap();
        assert!(head.starts_with("HTTP/1.1 200 OK\r\n"), "{path}: {head}");
        assert!(head.contains("Content-Security-Policy: default-src 'none'; script-src 'self'"));
        assert!(!head.contains("unsafe"), "{head}");
        let length = format!("Content-Length: {}\r\n", body.len());
        assert!(head.contains(&length), "{path}: {head}");
        page += body;
    }
    assert!(!page.contains("https://"), "nothing from elsewhere");
    let foreign = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!foreign.contains("http://"), "nothing from elsewhere");
}

#[test]
fn a_browser_gets_snapshots_and_every_line_of_the_log() {
    let screen = started();
    screen.show(snapshot(3, 1.0));
    let mut reader = events(&screen);
    let json = until(&mut reader, 1.0);
    assert_eq!(json["relays"][2]["number"], 3);
    assert_eq!(json["relays"][2]["hold_reason"], serde_json::Value::Null);
    assert_eq!(json["hops"][0]["to"], "2");
    // Faster than the browser gets snapshots: it misses some of them, but no line.
    for step in 0..200 {
        screen.show(snapshot(3, 2.0 + f64::from(step)));
    }
    let mut lines = Vec::new();
    while lines.len() < 201 {
        let mut line = String::new();
        reader.read_line(&mut line).unwrap();
        if let Some(text) = line.strip_prefix("data: [") {
            let all: serde_json::Value = serde_json::from_str(&format!("[{text}")).unwrap();
            lines.extend(
                all.as_array()
                    .unwrap()
                    .iter()
                    .map(|it| it["time_s"].as_f64().unwrap()),
            );
        }
    }
    let expected: Vec<f64> = (0..=200).map(|step| 1.0 + f64::from(step)).collect();
    assert_eq!(lines, expected);
}

#[test]
fn snapshots_carry_the_run_and_their_age_and_only_values_that_can_be_shown() {
    let shown = || {
        let screen = started();
        let mut flown = snapshot(2, 1.0);
        flown.relays[0].position = Some(Position {
            x_m: 1e22,
            ..Position::default()
        });
        flown.hops[0].sir_db = Some(f64::NEG_INFINITY);
        flown.log[0].text = "a\u{202e}\nb".to_owned();
        screen.show(flown);
        until(&mut events(&screen), 1.0);
        (screen, Instant::now())
    };
    let (screen, at) = shown();
    thread::sleep(Duration::from_millis(300));
    // A browser that comes later gets the same snapshot, and its age before it.
    let mut reader = events(&screen);
    let mut line = String::new();
    while !line.starts_with("event: age") {
        line.clear();
        assert!(reader.read_line(&mut line).unwrap() > 0);
    }
    line.clear();
    reader.read_line(&mut line).unwrap();
    let age: u64 = line.strip_prefix("data: ").unwrap().trim().parse().unwrap();
    assert!(age >= 300, "{age} ms");
    assert!(u128::from(age) <= at.elapsed().as_millis() + 10_000);
    let json = until(&mut reader, 1.0);
    assert_eq!(json["relays"][0]["position"], serde_json::Value::Null);
    assert_eq!(json["hops"][0]["sir_db"], -99.9);
    while !line.starts_with("data: [") {
        line.clear();
        assert!(reader.read_line(&mut line).unwrap() > 0);
    }
    assert!(line.contains("\"ab\""), "{line}");
    let run = json["run"].as_str().unwrap().to_owned();
    assert_eq!(run.len(), 16);
    // Another run of the program has another identifier.
    let (other, _) = shown();
    let json = until(&mut events(&other), 1.0);
    assert_ne!(json["run"].as_str().unwrap(), run);
}

#[test]
fn other_hosts_origins_and_methods_are_refused() {
    let screen = started();
    let own = screen.address();
    for (lines, status) in [
        ("GET /events HTTP/1.1\r\nHost: attacker.example", 403),
        ("GET /events HTTP/1.1\r\nHost: attacker.example:PORT", 403),
        (
            "GET /events HTTP/1.1\r\nHost: OWN\r\nOrigin: http://attacker.example",
            403,
        ),
        ("GET /events HTTP/1.1\r\nHost: OWN\r\nOrigin: null", 403),
        (
            "GET /events HTTP/1.1\r\nHost: OWN\r\nSec-Fetch-Site: cross-site",
            403,
        ),
        ("GET / HTTP/1.0", 400),
        ("POST /events HTTP/1.1\r\nHost: OWN", 405),
        ("OPTIONS / HTTP/1.1\r\nHost: OWN", 405),
        ("GET /no HTTP/1.1\r\nHost: OWN", 404),
        ("GET / HTTP/1.1\r\nHost: OWN\r\nA: LONG", 431),
    ] {
        let lines = lines.replace("OWN", &own.to_string());
        let lines = lines.replace("PORT", &own.port().to_string());
        let lines = lines.replace("LONG", &"a".repeat(9000));
        let response = asked(&screen, format!("{lines}\r\n\r\n").as_bytes());
        let expected = format!("HTTP/1.1 {status} ");
        assert!(
            response.starts_with(&expected),
            "{lines:.80}: {response:.80}"
        );
    }
}

/// Returns pseudorandom numbers (an xorshift generator), so that the requests differ.
fn random(state: &mut u64) -> usize {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    usize::try_from(*state >> 33).unwrap()
}

#[test]
fn ten_thousand_malformed_requests_do_not_disturb_the_chain() {
    let screen = Arc::new(started());
    let good = get(&screen, "/");
    let flight = Flight::begin(&screen, Duration::from_millis(2));
    let (mut seed, mut refused) = (1, 0);
    for number in 0..10_000 {
        let mut request = good.clone();
        match number % 4 {
            // Noise.
            0 => {
                request = (0..random(&mut seed) % 200)
                    .map(|_| random(&mut seed).to_le_bytes()[0])
                    .collect();
            }
            // A request with some bytes replaced.
            1 => {
                for _ in 0..3 {
                    let at = random(&mut seed) % request.len();
                    request[at] = random(&mut seed).to_le_bytes()[0];
                }
            }
            // A request that ends early.
            2 => request.truncate(random(&mut seed) % good.len()),
            // More headers than any browser sends.
            _ => {
                request.truncate(good.len() - 2);
                request.extend("A: b\r\n".repeat(random(&mut seed) % 1000).bytes());
                request.extend(b"\r\n");
            }
        }
        let response = asked(&screen, &request);
        let is_served = response.starts_with("HTTP/1.1 200 ");
        assert!(
            response.is_empty() || is_served || response.starts_with("HTTP/1.1 4"),
            "{request:?}: {response}"
        );
        refused += u32::from(!is_served);
    }
    assert!(refused > 8_000, "{refused} of 10000");
    flight.end("10 000 malformed requests");
    until(&mut events(&screen), 0.0);
}

#[test]
fn fifty_browsers_get_the_newest_snapshot_and_too_many_are_refused() {
    let screen = Arc::new(started());
    let flight = Flight::begin(&screen, Duration::from_millis(20));
    let mut browsers: Vec<_> = (0..50).map(|_| events(&screen)).collect();
    let begun = Instant::now();
    thread::scope(|scope| {
        for browser in &mut browsers {
            scope.spawn(|| {
                assert_eq!(until(browser, 0.5)["relays"].as_array().unwrap().len(), 100);
            });
        }
    });
    println!("50 browsers have the snapshot after {:?}", begun.elapsed());
    for _ in 0..100 {
        // On a busy machine the server drops browsers that this test has not read for 10 to 20 s.
        let status = loop {
            let (mut next, mut status) = (events(&screen), String::new());
            next.read_line(&mut status).unwrap();
            if !status.starts_with("HTTP/1.1 200 ") {
                break status;
            }
            browsers.push(next);
        };
        assert!(status.starts_with("HTTP/1.1 503 "), "{status}");
        assert!(browsers.len() >= MAX_STREAMS, "{}", browsers.len());
        // Streams leave room for files and tasks.
        let response = asked(&screen, &get(&screen, "/"));
        assert!(response.starts_with("HTTP/1.1 200 "), "{response}");
    }
    // Browsers that have left make room.
    drop(browsers);
    let begun = Instant::now();
    while screen.connections() > 0 {
        assert!(
            begun.elapsed() < Duration::from_secs(20),
            "{} left",
            screen.connections()
        );
        thread::sleep(Duration::from_millis(20));
    }
    assert!(asked(&screen, &get(&screen, "/")).starts_with("HTTP/1.1 200 "));
    flight.end("50 browsers");
}

#[test]
fn a_slow_reader_is_dropped_and_the_memory_stays_bounded() {
    let screen = Arc::new(started());
    let mut reader = events(&screen);
    // These never read; one of them never completes its request.
    let slow: Vec<_> = (0..10).map(|_| events(&screen)).collect();
    let mut half = connect(&screen);
    half.write_all(b"GET / HTTP/1.1\r\n").unwrap();
    let flight = Flight::begin(&screen, Duration::from_micros(500));
    until(&mut reader, 1.0);
    let before = memory();
    let begun = Instant::now();
    while screen.connections() > 1 {
        until(&mut reader, 0.0);
        assert!(
            begun.elapsed() < Duration::from_secs(60),
            "{} left",
            screen.connections()
        );
    }
    println!("slow readers are dropped after {:?}", begun.elapsed());
    let grown = memory().saturating_sub(before);
    println!("memory: {} KiB more than before", grown / 1024);
    assert!(grown < 64 << 20, "{grown} bytes");
    let mut response = String::new();
    half.read_to_string(&mut response).unwrap();
    assert!(response.starts_with("HTTP/1.1 408 "), "{response}");
    flight.end("slow readers");
    drop(slow);
}

/// Checks that a browser that reads nothing is dropped before the system's send buffer is full.
#[test]
fn a_slow_reader_of_few_snapshots_is_dropped() {
    let screen = Arc::new(started());
    let mut slow = events(&screen);
    let flight = Flight::begin(&screen, Duration::from_millis(400));
    until(&mut slow, 0.0);
    let begun = Instant::now();
    while screen.connections() > 0 {
        let took = begun.elapsed();
        assert!(took < Duration::from_secs(30), "still connected");
        thread::sleep(Duration::from_millis(100));
    }
    println!("a slow reader is dropped after {:?}", begun.elapsed());
    flight.end("a slow reader of few snapshots");
    drop(slow);
}

#[test]
fn an_address_that_cannot_be_bound_is_named() {
    let screen = started();
    let refused = |address: &str| Screen::start(address.parse().unwrap()).unwrap_err();
    let again = refused(&screen.address().to_string());
    assert!(matches!(again, ScreenError::Bind(..)), "{again:?}");
    let port = screen.address().port();
    assert!(
        again
            .to_string()
            .starts_with(&format!("port {port} is in use")),
        "{again}"
    );
    let elsewhere = refused("192.0.2.1:8080").to_string();
    assert!(
        elsewhere.starts_with("192.0.2.1 is not an address of this computer"),
        "{elsewhere}"
    );
    // The port is free again after the end of the screen.
    let address = screen.address();
    drop(screen);
    assert_eq!(Screen::start(address).unwrap().address(), address);
}

/// Returns a POST request for a task, as the page sends it.
fn post(screen: &Screen, path: &str, token: &str, body: &str) -> Vec<u8> {
    let (own, length) = (screen.address(), body.len());
    format!("POST {path} HTTP/1.1\r\nHost: {own}\r\nOrigin: http://{own}\r\nX-Relay-Token: {token}\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}").into_bytes()
}

#[test]
fn wrong_passwords_are_limited_and_a_page_without_one_is_refused() {
    let own = "127.0.0.1:0".parse().unwrap();
    let (screen, posts) =
        Screen::start_acting(own, Some("correct horse".to_owned()), None).unwrap();
    let with = |header: &str| {
        let own = screen.address();
        asked(
            &screen,
            format!("GET / HTTP/1.1\r\nHost: {own}\r\n{header}\r\n").as_bytes(),
        )
    };
    // A browser asks without a password first, which is no try.
    for _ in 0..20 {
        let response = with("");
        assert!(response.starts_with("HTTP/1.1 401 "), "{response}");
        assert!(response.contains("WWW-Authenticate: Basic "), "{response}");
    }
    let right = "Authorization: Basic OmNvcnJlY3QgaG9yc2U=\r\n";
    let wrong = "Authorization: Basic OmNvcnJlY3QgaG9yc2Y=\r\n";
    assert!(with(right).starts_with("HTTP/1.1 200 "));
    // A foreign page's link with a wrong password is no try of this browser.
    let link = format!("Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\n{wrong}");
    for _ in 0..20 {
        assert!(with(&link).starts_with("HTTP/1.1 403 "));
    }
    let mut statuses: Vec<String> = Vec::new();
    thread::scope(|scope| {
        let tries: Vec<_> = (0..30).map(|_| scope.spawn(|| with(wrong))).collect();
        statuses.extend(
            tries
                .into_iter()
                .map(|it| it.join().unwrap()[9..12].to_owned()),
        );
    });
    statuses.sort();
    assert_eq!(
        statuses.iter().filter(|it| *it == "401").count(),
        5,
        "{statuses:?}"
    );
    assert_eq!(
        statuses.iter().filter(|it| *it == "429").count(),
        25,
        "{statuses:?}"
    );
    assert!(
        with(right).starts_with("HTTP/1.1 429 "),
        "no guess can be told from others"
    );
    let response = asked(&screen, &post(&screen, "/upload", "", "{}"));
    assert!(response.starts_with("HTTP/1.1 4"), "{response}");
    assert!(posts.try_recv().is_err());
}

#[test]
fn only_tasks_with_the_token_reach_the_program_and_nobody_waits_for_it() {
    let (screen, posts) = Screen::start_acting("127.0.0.1:0".parse().unwrap(), None, None).unwrap();
    let screen = Arc::new(screen);
    screen.show(snapshot(1, 0.0));
    let token = until(&mut events(&screen), 0.0)["token"]
        .as_str()
        .unwrap()
        .to_owned();
    assert_eq!(token.len(), 32);
    let flight = Flight::begin(&screen, Duration::from_millis(2));
    let good = post(&screen, "/upload", &token, "{\"preview\":1}");
    let secret = good
        .windows(32)
        .position(|it| it == token.as_bytes())
        .unwrap();
    let mut seed = 7;
    for number in 0..10_000 {
        let mut request = good.clone();
        if number % 2 == 0 {
            // A token with a wrong character.
            request[secret + random(&mut seed) % 32] = b"ghijk"[random(&mut seed) % 5];
        } else {
            request.truncate(random(&mut seed) % good.len());
        }
        let response = asked(&screen, &request);
        assert!(
            response.is_empty() || response.starts_with("HTTP/1.1 4"),
            "{response}"
        );
    }
    assert!(
        posts.try_recv().is_err(),
        "a request without the token came through"
    );
    // The program takes a task, and answers or refuses it.
    for reply in [
        Ok("{\"preview\":1}".to_owned()),
        Err("was uploaded already".to_owned()),
    ] {
        let response = thread::scope(|scope| {
            let response = scope.spawn(|| asked(&screen, &good));
            let task = posts.recv_timeout(Duration::from_secs(20)).unwrap();
            assert_eq!(
                (task.task, &task.body[..]),
                (Task::Upload, "{\"preview\":1}")
            );
            task.reply(reply.clone());
            response.join().unwrap()
        });
        let (status, text) = match &reply {
            Ok(text) => ("HTTP/1.1 200 ", text),
            Err(text) => ("HTTP/1.1 409 ", text),
        };
        assert!(
            response.starts_with(status) && response.ends_with(&**text),
            "{response}"
        );
    }
    // A program that does not answer: 50 browsers get a refusal in time, and at most four tasks wait.
    let begun = Instant::now();
    thread::scope(|scope| {
        let all: Vec<_> = (0..50)
            .map(|_| scope.spawn(|| asked(&screen, &good)))
            .collect();
        for response in all {
            assert!(response.join().unwrap().starts_with("HTTP/1.1 503 "));
        }
    });
    println!(
        "50 unanswered tasks are refused after {:?}",
        begun.elapsed()
    );
    // A task whose browser got a refusal is not done later.
    let late: Vec<_> = posts.try_iter().collect();
    assert!(late.len() <= 4 && !late.iter().any(Post::begin));
    // A task that has begun is answered, however late.
    thread::scope(|scope| {
        let response = scope.spawn(|| asked(&screen, &good));
        let task = posts.recv_timeout(Duration::from_secs(20)).unwrap();
        assert!(task.begin() && !task.begin());
        thread::sleep(Duration::from_secs(6));
        task.reply(Ok("{}".to_owned()));
        assert!(response.join().unwrap().starts_with("HTTP/1.1 200 "));
    });
    flight.end("tasks");
}
