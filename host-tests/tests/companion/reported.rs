//! Reports of relays with autopilots, on the page of a ground station as a browser receives it.

use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde_json::Value;
use uav_relay_scenario::Scenario;

use crate::chain::{Chain, simulated};
use crate::faults::Stage;
use crate::files::write;
use crate::medium::{Medium, QUIET};
use crate::peer::{Peer, ReceivedMessage, Site, TX, apart_m, distance_to_m, on_earth, options};
use crate::peer::{RX, text};
use crate::process::{LIMIT, Relay};
use crate::web::{address, snapshots};

/// Maximum time from a relay's failure to the alarm about it on the page.
///
/// The chain notices the failure within 15 s.
const LOST: Duration = Duration::from_secs(17);

/// Maximum time until the page shows a change of a drone's control state, or an alarm about it.
///
/// The control state states if the relay or the pilot controls the drone.
const SOON: Duration = Duration::from_secs(2);

/// Maximum distance of a drone on the page from its true position at the time of the report, m.
///
/// A drone flies up to 8 m/s. Each of up to two relays rounds the age of a report to 0.1 s, and positions are rounded
/// to 0.25 m.
const MOST_ERROR_M: f64 = 2.0 * 0.1 * 8.0 + 0.25;

/// Web page of a ground station, as a browser keeps it open.
pub(crate) struct Page {
    arriving: Receiver<(f64, Value)>,
    pub(crate) last: Value,
}

fn now_s() -> f64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap()
        .as_secs_f64()
}

pub(crate) fn relays(snapshot: &Value) -> &[Value] {
    snapshot["relays"].as_array().unwrap()
}

pub(crate) fn has_all(snapshot: &Value) -> bool {
    relays(snapshot).iter().all(|it| it["age_s"].is_number())
}

/// Returns the urgency and the text of each alarm in a page's snapshot that has not been cleared.
pub(crate) fn alarms(snapshot: &Value) -> Vec<String> {
    let all = snapshot["alarms"].as_array().unwrap().iter();
    let lasting = all.filter(|it| it["cleared_s"].is_null());
    lasting
        .map(|it| {
            format!(
                "{} {}",
                it["urgency"].as_str().unwrap(),
                it["text"].as_str().unwrap()
            )
        })
        .collect()
}

impl Page {
    fn open(station: &mut Relay) -> Self {
        let (address, (sender, arriving)) = (address(station), channel());
        std::thread::spawn(move || {
            for snapshot in snapshots(&address) {
                if sender.send((now_s(), snapshot)).is_err() {
                    return;
                }
            }
        });
        Self {
            arriving,
            last: Value::Null,
        }
    }

    /// Returns the next snapshot (state of the chain) that the page receives, and its time of arrival, s.
    pub(crate) fn next(&mut self) -> (f64, Value) {
        let next = self.arriving.recv_timeout(LIMIT).unwrap();
        self.last = next.1.clone();
        next
    }

    /// Waits for the next snapshot, at most for `limit`. Returns false if none has arrived.
    pub(crate) fn arrives(&mut self, limit: Duration) -> bool {
        let next = self.arriving.recv_timeout(limit);
        if let Ok((_, snapshot)) = &next {
            self.last = snapshot.clone();
        }
        next.is_ok()
    }

    /// Waits for a snapshot of the page for which `is_so` is true. Returns the time until then.
    pub(crate) fn until(
        &mut self,
        limit: Duration,
        what: &str,
        is_so: impl Fn(&Value) -> bool,
    ) -> Duration {
        // Snapshots from before the call are not counted.
        self.arriving.try_iter().for_each(drop);
        let begun = Instant::now();
        loop {
            let (_, snapshot) = self.next();
            let took = begun.elapsed();
            if is_so(&snapshot) {
                println!("{what}: after {took:.1?}; alarms: {:?}", alarms(&snapshot));
                return took;
            }
            assert!(
                took < limit,
                "{what}: {:#?}, {:#?}",
                snapshot["alarms"],
                snapshot["relays"]
            );
        }
    }

    /// Waits for the alarm that begins with `part`, and checks that it comes within `limit`.
    fn alarms(&mut self, limit: Duration, part: &str) {
        self.until(limit, part, |it| {
            alarms(it).iter().any(|alarm| alarm.contains(part))
        });
    }
}

/// Simulated drone with its relay process, and the positions at which the drone has been.
pub(crate) struct Flown {
    pub(crate) drone: Peer,
    pub(crate) relay: Relay,
    places: Vec<(f64, Site)>,
}

impl Flown {
    fn is_engaged(&mut self) {
        self.relay.line("autopilot: ready");
        self.drone.order("mode companion");
        self.relay.line("autopilot: setpoint control engaged");
    }

    /// Records all positions of the simulated drone up to now.
    fn follow(&mut self) {
        let all = self.drone.so_far().into_iter();
        for ReceivedMessage(place) in all.filter(|it| it.is("PLACE")) {
            let at = [0, 1, 2].map(|part| place["at"][part].as_f64().unwrap());
            self.places.push((place["time_s"].as_f64().unwrap(), at));
        }
    }

    /// Returns the distance between a reported position and the drone's position at the time `time_s`, m.
    fn error_m(&self, time_s: f64, position: &Value) -> f64 {
        let [x_m, y_m, altitude_m] =
            ["x_m", "y_m", "altitude_m"].map(|axis| position[axis].as_f64().unwrap());
        let after = self.places.partition_point(|(at, _)| *at < time_s);
        let (_, place) = self.places[after.min(self.places.len() - 1)];
        apart_m(on_earth(x_m, altitude_m), place).hypot(y_m)
    }
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share) as usize]
}

/// Starts relay `index` of `chain`, with a drone on the ground at `x_m`.
pub(crate) fn fly(chain: &Chain, index: usize, x_m: f64) -> Flown {
    let link = chain.files.text(&format!("autopilot{index}"));
    let drone = Peer::autopilot(["px4", "arducopter"][index % 2], &link, x_m, None);
    Flown {
        drone,
        relay: restart(chain, index, ""),
        places: Vec::new(),
    }
}

pub(crate) fn restart(chain: &Chain, index: usize, more: &str) -> Relay {
    let options = options(&chain.files.text(&format!("autopilot{index}")));
    let signed = chain.files.signed("key", &format!("epoch{index}"));
    let status = chain.files.text(&format!("status{index}"));
    let own = format!("{options} {signed} --status-socket {status} {more}");
    chain.relay(index, &own)
}

pub(crate) fn station(chain: &Chain, tty: &str) -> Relay {
    let (of, distance, signed) = (
        chain.of,
        distance_to_m(RX),
        chain.files.signed("key", "ground"),
    );
    let (tx, rx) = (text(TX), text(RX));
    Relay::ground(&format!(
        "--of {of} --end tx --stand --web 127.0.0.1:0 --tty {tty} --distance {distance} --site-tx {tx} --site-rx {rx} {signed}"
    ))
}

#[test]
fn the_page_shows_eight_flying_relays_and_their_faults() {
    let chain = Chain::on_channel(8, Medium::paced(9, 57_600));
    let mut station = station(&chain, &format!("{} --shared", chain.media[0].tty(8)));
    let mut page = Page::open(&mut station);
    let distance_m = distance_to_m(RX);
    let scenario = Scenario {
        distance_m,
        ..Scenario::default()
    };
    let agreed = simulated(&scenario, 8).into_iter().zip(1..);
    let agreed = agreed.map(|(at, index)| (index, f64::from(f32::from_bits(at[0]))));
    println!(
        "agreed: {:.0?}",
        agreed.clone().map(|it| it.1).collect::<Vec<_>>()
    );
    // Each drone flies 20 m to its position, and its home keeps the order of the chain.
    let mut flown: Vec<Flown> = agreed
        .map(|(index, x_m)| fly(&chain, index, x_m - 20.0))
        .collect();
    page.until(LIMIT, "all relays", has_all);
    for it in &mut flown {
        it.drone.takes_off();
        it.drone.order("track");
    }
    flown.iter_mut().for_each(Flown::is_engaged);
    page.until(LIMIT, "all engaged", |it| {
        relays(it).iter().all(|it| it["control"] == "engaged") && alarms(it).is_empty()
    });

    // A flight without faults.
    let flight_s = 20.0;
    let (begun, mut shown) = (now_s(), Vec::new());
    while now_s() < begun + flight_s {
        let (at, snapshot) = page.next();
        flown.iter_mut().for_each(Flown::follow);
        if at > begun {
            assert_eq!(alarms(&snapshot), [""; 0], "{snapshot:#}");
            shown.push((at, snapshot));
        }
    }
    let (mut ages, mut errors) = (Vec::new(), Vec::new());
    // The snapshot that arrived fastest relates the clocks; a busy machine delays others.
    let time_s = |snapshot: &Value| snapshot["time_s"].as_f64().unwrap();
    let offsets = shown.iter().map(|(at, snapshot)| at - time_s(snapshot));
    let offset_s = offsets.clone().fold(f64::INFINITY, f64::min);
    let latest_s = offsets.fold(0.0, f64::max) - offset_s;
    println!("snapshots arrive up to {latest_s:.2} s later than the fastest");
    for (_, snapshot) in &shown {
        let at = time_s(snapshot) + offset_s;
        for (relay, flown) in relays(snapshot).iter().zip(&flown) {
            let age_s = relay["age_s"].as_f64().unwrap();
            ages.push(age_s);
            errors.push(flown.error_m(at - age_s, &relay["position"]));
            assert_eq!(relay["control"], "engaged", "{relay:#}");
        }
    }
    let way: Vec<f64> = flown
        .iter()
        .map(|it| apart_m(it.places[0].1, it.places[it.places.len() - 1].1))
        .collect();
    println!("{} snapshots; flown: {way:.0?} m", shown.len());
    let age_s = [0.5, 0.95, 1.0].map(|share| quantile(&mut ages, share));
    let error_m = [0.5, 0.95, 1.0].map(|share| quantile(&mut errors, share));
    println!("median, 95 % and maximum: ages {age_s:.2?} s, errors {error_m:.2?} m");
    assert!(
        shown.len() as f64 > 4.0 * flight_s && age_s[1] <= 2.0,
        "{age_s:?}"
    );
    assert!(
        error_m[1] <= 1.0 && error_m[2] <= MOST_ERROR_M,
        "{error_m:?}"
    );

    let mut stage = Stage::new(chain, flown, page);
    stage.run();
    station.stopped();
}

#[test]
fn the_page_shows_two_relays_on_wires() {
    let chain = Chain::with_ground(2, QUIET);
    let mut station = station(&chain, chain.tx.as_ref().unwrap().tty(0));
    let mut page = Page::open(&mut station);
    let mut flown = fly(&chain, 1, 250.0);
    let fifo = chain.files.fifo("positions");
    let signed = chain.files.signed("key", "epoch2");
    let distance = distance_to_m(RX);
    let second = chain.relay(
        2,
        &format!("--distance {distance} --positions {fifo} {signed}"),
    );
    flown.drone.takes_off();
    flown.drone.order("track");
    let shows = |snapshot: &Value, at_m: f64| {
        let [one, two] = relays(snapshot) else {
            panic!("{snapshot:#}")
        };
        let is_near = |axis: &str, at_m: f64| {
            two["position"][axis]
                .as_f64()
                .is_some_and(|it| (it - at_m).abs() < 0.2)
        };
        one["position"].is_object()
            && two["control"].is_null()
            && is_near("x_m", at_m)
            && is_near("y_m", -3.0)
            && is_near("altitude_m", 21.5)
    };
    page.until(LIMIT, "all relays", has_all);
    for x_m in [900.0, 905.0, 910.0] {
        write(&fifo, &format!("{x_m} -3 21.5\n"));
        page.until(2 * SOON, "position", |it| shows(it, x_m));
    }
    let (at, snapshot) = page.next();
    flown.follow();
    let relay = &relays(&snapshot)[0];
    let error_m = flown.error_m(at - relay["age_s"].as_f64().unwrap(), &relay["position"]);
    assert!(error_m <= MOST_ERROR_M, "{error_m}");
    second.stopped();
    page.alarms(LOST, "critical relay 2");
    station.stopped();
}
