//! Three images with their own autopilots in real time: MAVSDK for the first, and two simulated ones.

use std::time::Instant;

use host_tests::firmware::emulator::Life;
use host_tests::make;
use mavlink::dialects::common::MavLandedState;
use uav_relay::Placement;
use uav_relay::flight::autopilot::Kind;
use uav_relay_tools::provision::block::Flight;

use crate::chain::simulated;
use crate::fleet::{Fleet, PATIENCE};
use crate::flight::{axis, scenario};
use crate::mavsdk::Mavsdk;
use crate::vehicle::{Vehicle, apart};

/// Flight of three drones. The autopilot of the first is MAVSDK.
struct Three {
    fleet: Fleet,
    mavsdk: Mavsdk,
    others: [Vehicle; 2],
    /// Number of times that the pilot has reacted to the first relay's refusal of setpoint control.
    found: usize,
    /// True after the pilot has left OFFBOARD because of a refusal, until the pilot chooses OFFBOARD again.
    chooses: bool,
}

impl Three {
    fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        let end = Instant::now() + PATIENCE;
        while !done(self) {
            if Instant::now() > end {
                println!(
                    "{:#?}",
                    self.mavsdk.heard.iter().rev().take(5).collect::<Vec<_>>()
                );
                println!(
                    "{:?}",
                    self.others.each_ref().map(|it| (it.place, it.told.last()))
                );
                self.fleet.give_up(what);
            }
            self.fleet.listen();
            self.mavsdk.drain_messages();
            self.others.iter_mut().for_each(Vehicle::step);
            self.choose_again();
        }
    }

    /// Chooses another mode, and then OFFBOARD again, if the first drone's relay refused setpoint control. The relay
    /// refuses a mode that was chosen before it started.
    fn choose_again(&mut self) {
        let count = |text: &str| {
            self.fleet
                .of_drone(1)
                .filter(|line| line.text == text)
                .count()
        };
        let found = count(
            "autopilot: setpoint control cannot be engaged: OFFBOARD or GUIDED was chosen before the relay started: choose another mode, then OFFBOARD or GUIDED again",
        );
        if found > self.found {
            self.found = found;
            self.chooses = true;
            self.mavsdk.order("mode hold");
            self.mavsdk.order("active");
        }
        let last = self.fleet.of_drone(1).last().map(|line| &*line.text);
        if self.chooses && last == Some("autopilot: ready: the pilot may choose OFFBOARD or GUIDED")
        {
            self.chooses = false;
            self.mavsdk.order("mode offboard");
        }
    }

    fn has_logged(&self, drone: u16, text: &str) -> bool {
        self.fleet.of_drone(drone).any(|line| line.text == text)
    }

    /// Returns the last target of the first drone, and the positions of the other two drones.
    ///
    /// Returns `None` if the first drone has no target yet.
    fn places(&self) -> Option<[Placement; 3]> {
        let first = axis().place(self.mavsdk.target()?)?;
        let [second, third] = self.others.each_ref().map(|vehicle| vehicle.place);
        Some([first, second, third])
    }
}

#[test]
fn three_images_fly_with_autopilots_one_by_mavsdk() {
    let flight = Flight::new(&scenario(), 3, 1e-4, 7).unwrap();
    let to = simulated(&flight).into_iter().map(|place| {
        let [x_m, y_m, altitude_m] = place.map(f32::from_bits);
        make::placement(x_m, y_m, altitude_m)
    });
    let to: Vec<Placement> = to.collect();
    // All drones start short of their positions, so that each has to make room for the one behind.
    let from = |index: usize| Placement {
        x_m: to[index].x_m - 25.0,
        altitude_m: to[index].altitude_m - 0.5,
        ..to[index]
    };
    let mut fleet = Fleet::in_real_time(&flight);
    let mut sockets = fleet.autopilots.drain(..);
    let mavsdk = Mavsdk::start(sockets.next().unwrap(), axis().point(from(0)).unwrap());
    let others = [1, 2].map(|index| {
        let socket = sockets.next().unwrap();
        Vehicle::new(Kind::ArduCopter, socket, axis(), from(index), Life::Real)
    });
    drop(sockets);
    let mut three = Three {
        fleet,
        mavsdk,
        others,
        found: 0,
        chooses: false,
    };

    // On the ground each autopilot is found, its messages are requested, and no targets are sent.
    three.until("heartbeat of the first", |three| {
        three.mavsdk.has_received("HEARTBEAT")
    });
    three.mavsdk.order("px4");
    three.until("autopilots found", |three| {
        three.has_logged(1, "autopilot: found: PX4")
            && [2, 3]
                .iter()
                .all(|drone| three.has_logged(*drone, "autopilot: found: ArduCopter"))
    });
    three.until("requests for messages", |three| {
        [33, 245].iter().all(|id| three.mavsdk.has_request_for(*id))
            && three.others.iter().all(|vehicle| vehicle.asked.len() >= 2)
    });
    assert_eq!(three.mavsdk.target(), None);

    // The pilots take off.
    three.mavsdk.order("arm");
    three.mavsdk.order("air");
    three.mavsdk.order("active");
    for vehicle in &mut three.others {
        vehicle.armed = true;
        vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
    }
    three.until("flight by the pilots", |three| {
        (1..=3).all(|drone| {
            three.has_logged(
                drone,
                "autopilot: in the air, and not controlled by the relay",
            )
        }) && three.mavsdk.target().is_some()
    });
    assert!(three.others.iter().all(|vehicle| vehicle.told.is_empty()));

    // The pilots give control to the relays.
    three.mavsdk.order("mode offboard");
    for vehicle in &mut three.others {
        vehicle.granted = true;
    }
    three.until("flight to the agreed places", |three| {
        let places = three.places();
        places.is_some_and(|places| places.iter().zip(&to).all(|(at, to)| apart(*at, *to) < 1.0))
    });
    assert!(three.mavsdk.has_text("relay: engaged, flies to position"));
    let flies = |text: &String| text == "relay: engaged, flies to position";
    assert!(
        three
            .others
            .iter()
            .all(|vehicle| vehicle.texts.iter().any(flies))
    );

    // One pilot takes control: that drone is released, and the others stay.
    three.others[0].granted = false;
    three.until("release", |three| {
        let released = |text: &String| text.starts_with("relay: released");
        three.others[0].texts.iter().any(released)
    });
    assert!(!three.mavsdk.has_text("relay: released, holds position"));
    let places = three.places().unwrap();
    for (at, to) in [(places[0], to[0]), (places[2], to[2])] {
        assert!(apart(at, to) < 1.0, "{at:?}, {to:?}");
    }
}
