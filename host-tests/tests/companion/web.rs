//! Screen of a ground station: its page, its snapshots, and a serial loop that no browser disturbs.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::chain::Chain;
use crate::files::{Files, status_of, until};
use crate::medium::QUIET;
use crate::process::{LIMIT, Relay};
use crate::pty::Pty;

/// Maximum time in which the station's main loop answers a status request, on a busy machine.
const LATE: Duration = Duration::from_millis(1_500);

/// Returns the address of the page, which the station logs.
pub(crate) fn address(station: &mut Relay) -> String {
    let line = station.line("screen: open http://127.0.0.1:");
    let url = line.split("http://").nth(1).unwrap();
    url.split('/').next().unwrap().to_owned()
}

pub(crate) fn connect(address: &str, request: &[u8]) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    let _ = stream.write_all(request);
    stream
}

fn get(address: &str, path: &str) -> TcpStream {
    let request = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\n\r\n");
    connect(address, request.as_bytes())
}

/// Returns the snapshots of the page from the station's event stream.
pub(crate) fn snapshots(address: &str) -> impl Iterator<Item = Value> {
    let lines = BufReader::new(get(address, "/events")).lines();
    let data = lines.map_while(Result::ok).filter_map(|line| {
        let text = line.strip_prefix("data: {")?.to_owned();
        Some(serde_json::from_str(&format!("{{{text}")).unwrap())
    });
    data.filter(|json: &Value| json["relays"].is_array())
}

fn alarm(snapshot: &Value) -> &str {
    snapshot["alarms"][0]["text"].as_str().unwrap()
}

#[test]
fn a_station_without_a_chain_has_a_page_with_snapshots() {
    let (files, tty) = (Files::new(), Pty::new());
    let signed = files.signed("key", "epoch");
    let path = tty.path().display();
    let stand =
        format!("--of 3 --flying 2 --end tx --stand --web 127.0.0.1:0 --tty {path} {signed}");
    let mut station = Relay::ground(&stand);
    let address = address(&mut station);
    let mut page = String::new();
    get(&address, "/").read_to_string(&mut page).unwrap();
    assert!(
        page.starts_with("HTTP/1.1 200 ") && page.contains("<title>"),
        "{page}"
    );
    let begun = Instant::now();
    let shown: Vec<Value> = snapshots(&address).take(11).collect();
    println!("11 snapshots in {:?}", begun.elapsed());
    let times = shown.iter().map(|it| it["time_s"].as_f64().unwrap());
    assert!(times.is_sorted_by(|one, next| next - one > 0.19));
    let last = &shown[10];
    assert_eq!(last["relays"].as_array().unwrap().len(), 3);
    assert_eq!(last["name"], "Chain of 2 relays, of a fleet of 3");
    let size = serde_json::json!({ "present": 0, "meant": 2 });
    assert_eq!(last["chain_size"], size);
    assert!(
        last["relays"]
            .as_array()
            .unwrap()
            .iter()
            .all(|it| it["position"].is_null())
    );
    assert_eq!(
        (
            last["rx"]["x_m"].as_f64(),
            last["hops"].as_array().unwrap().len()
        ),
        (Some(1_000.0), 0)
    );
    assert_eq!(
        alarm(last),
        "no report yet from relays 1 to 3; nothing received from the chain yet"
    );
    assert_eq!(last["alarms"].as_array().unwrap().len(), 1);
    let last = station.stopped().pop().unwrap();
    assert!(last.contains("stopped"), "{last}");
}

/// Returns a PMTiles archive with a single tile: the `picture` of the whole earth.
fn archive(picture: &[u8]) -> Vec<u8> {
    let metadata = br#"{"attribution":"<b>Somebody</b>"}"#;
    // One entry: tile 0, one tile long, with the length and the offset (plus one) of its picture.
    let directory = [1, 0, 1, picture.len() as u8, 1];
    let [root, about] = [127, 127 + directory.len() as u64];
    let data = about + metadata.len() as u64;
    let mut file = b"PMTiles\x03".to_vec();
    for (offset, len) in [
        (root, directory.len()),
        (about, metadata.len()),
        (0, 0),
        (data, picture.len()),
    ] {
        file.extend(offset.to_le_bytes());
        file.extend((len as u64).to_le_bytes());
    }
    file.extend([1_u64; 3].map(u64::to_le_bytes).concat());
    // Clustered, nothing compressed, PNG, zoom levels 0 to 3.
    file.extend([1, 1, 1, 2, 0, 3]);
    file.extend([0; 25]);
    [&file[..], &directory, metadata, picture].concat()
}

#[test]
fn a_station_serves_the_map_tiles_of_a_file() {
    let (files, tty) = (Files::new(), Pty::new());
    let signed = files.signed("key", "epoch");
    let path = tty.path().display();
    let file = files.text("map.pmtiles");
    std::fs::write(&file, archive(b"a picture")).unwrap();
    let stand =
        format!("--of 3 --end tx --stand --web 127.0.0.1:0 --tty {path} {signed} --tiles {file}");
    let mut station = Relay::ground(&stand);
    let address = address(&mut station);
    let answer = |path: &str| {
        let mut answer = String::new();
        get(&address, path).read_to_string(&mut answer).unwrap();
        answer
    };
    let tile = answer("/tiles/0/0/0");
    assert!(
        tile.starts_with("HTTP/1.1 200 OK\r\nContent-Type: image/png\r\n")
            && tile.ends_with("\r\n\r\na picture"),
        "{tile}"
    );
    let none = answer("/tiles/1/1/1");
    assert!(
        none.starts_with("HTTP/1.1 204 No Content\r\n") && none.ends_with("\r\n\r\n"),
        "{none}"
    );
    assert!(answer("/tiles/1/2/1").starts_with("HTTP/1.1 404 "));
    let shown = snapshots(&address).next().unwrap();
    assert_eq!(
        shown["tiles"].to_string(),
        r#"{"attribution":"Somebody","zooms":[0,3]}"#
    );
    // A file that is removed from the disk in flight, or cut off, ends neither the page nor the station.
    std::fs::File::options()
        .write(true)
        .open(&file)
        .unwrap()
        .set_len(140)
        .unwrap();
    assert!(answer("/tiles/0/0/0").starts_with("HTTP/1.1 204 "));
    assert!(snapshots(&address).next().is_some());
    station.stopped();
}

#[test]
fn no_request_disturbs_the_serial_loop() {
    let chain = Chain::with_ground(1, QUIET);
    let files = &chain.files;
    let mut relay = chain.relay(1, &files.signed("key", "relay"));
    relay.line("converged: ");
    let (socket, tty) = (files.text("status"), chain.tx.as_ref().unwrap().tty(0));
    let own = format!("--status-socket {socket} {}", files.signed("key", "ground"));
    let upload = "--version 2 --new-altitude 30 --yes --no-fence";
    let stand = format!("--stand --web 127.0.0.1:0 --end tx --of 1 --tty {tty} {own} {upload}");
    let mut station = Relay::ground(&stand);
    let address = address(&mut station);
    let slow: Vec<_> = (0..10).map(|_| get(&address, "/events")).collect();
    let (has_ended, count) = (AtomicBool::new(false), AtomicUsize::new(0));
    let mut answers = Vec::new();
    std::thread::scope(|scope| {
        for part in 0..4_u8 {
            let (address, has_ended, count) = (&address, &has_ended, &count);
            scope.spawn(move || {
                while !has_ended.load(Ordering::Relaxed) {
                    let request = match part {
                        0 => vec![0xFF; 20_000],
                        1 => b"POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\nclear-all".to_vec(),
                        2 => b"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n".to_vec(),
                        _ => b"GET /../../etc/passwd".to_vec(),
                    };
                    let mut stream = connect(address, &request);
                    let (_, mut answer) = (stream.shutdown(Shutdown::Write), String::new());
                    let _ = stream.read_to_string(&mut answer);
                    assert!(!answer.starts_with("HTTP/1.1 200"), "{answer}");
                    count.fetch_add(1, Ordering::Relaxed);
                }
            });
        }
        // The upload passes, and the main loop answers in time.
        station.wait_for("flown: 1 of 1 relays fly version 2 of the mission");
        while answers.len() < 30 || count.load(Ordering::Relaxed) < 400 {
            let asked = Instant::now();
            let said = status_of(files.path("status"));
            answers.push(asked.elapsed());
            assert_eq!(said["station"]["upload"]["progress"], "flown", "{said:#}");
        }
        has_ended.store(true, Ordering::Relaxed);
    });
    answers.sort();
    println!(
        "{count:?} requests; status after {:?} (median), {:?} (longest)",
        answers[answers.len() / 2],
        answers[answers.len() - 1]
    );
    assert!(answers[answers.len() - 1] < LATE, "{answers:?}");
    drop(slow);
    // Frames were received from the relay, which has not reported.
    let said = until(files.path("status"), |said| {
        said["station"]["hears"][0] == 1
    });
    assert!(
        said["station"]["counters"]["received"].as_u64() > Some(0),
        "{said:#}"
    );
    assert_eq!(
        snapshots(&address).next().unwrap()["name"],
        "Chain of 1 relays"
    );
    station.stopped();
}
