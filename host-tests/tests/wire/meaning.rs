//! Meaning of the fields: the crate's message, made from a body without the crate's decoder.

use host_tests::make;
use uav_relay::guard::Fence;
use uav_relay::optimiser::PerTarget;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::optimiser::pass::Verdict;
use uav_relay::place::{CrossSection, Station};
use uav_relay::sensing::estimate::{InterferenceEstimate, NumberedEstimate, Spread};
use uav_relay::wire::digest::MissionId;
use uav_relay::wire::message::{
    AT_ONCE, AdjustStep, Claim, Coarse, Decision, Detail, Entry, Heard, Hello, Leave, Message,
    Moved, Nodes, Orders, OwnSeat, Poll, Proposal, Pulse, Pulsed, Reports, Requests, Roster,
    Successor, Sweep, SweepVerdict, Token,
};
use uav_relay::{Interference, Local, Placement, Sites, Upload, View, ViewId};
use uav_relay_decode::value::{Fields, Value};

use super::message::{WireMessage, list, number};
use super::offer;

/// Fields of a message, or of a group in it. Each function returns the value of a field in the crate's type.
struct MessageFields<'a>(&'a Fields<'static>);

impl MessageFields<'_> {
    fn byte(&self, name: &str) -> u8 {
        number(self.0, name) as u8
    }

    fn word(&self, name: &str) -> u16 {
        number(self.0, name) as u16
    }

    fn long(&self, name: &str) -> u32 {
        number(self.0, name) as u32
    }

    fn real(&self, name: &str) -> f32 {
        number(self.0, name) as f32
    }

    fn flag(&self, name: &str, bit: u8) -> bool {
        self.byte(name) >> bit & 1 == 1
    }

    fn targets(&self, name: &str) -> PerTarget {
        PerTarget::from_slice(&list(self.0, name)).unwrap()
    }

    /// Returns true if the message's optional field `name` is present.
    fn has(&self, name: &str) -> bool {
        self.0.get(name) != Some(&Value::None)
    }

    fn group(&self, name: &str) -> Option<MessageFields<'_>> {
        match self.0.get(name).unwrap() {
            Value::Group(fields) => Some(MessageFields(fields)),
            _ => None,
        }
    }

    fn id(&self, name: &str) -> ViewId {
        ViewId::from_bits(self.long(name))
    }

    fn view(&self, view: &str, relays: &str) -> View {
        View {
            id: self.id(view),
            relays: self.word(relays),
        }
    }

    fn mission_id(&self, digest: &str, version: &str) -> MissionId {
        MissionId {
            version: self.word(version),
            digest: self.word(digest),
        }
    }

    fn place(&self) -> Placement {
        Placement::on_line(self.real("x_m"), self.real("altitude_m"))
    }
}

/// Returns `wire_message` as the crate's type of message, with the same values.
pub(crate) fn message(wire_message: &WireMessage) -> Message {
    let fields = wire_message.fields();
    let of = MessageFields(&fields);
    match wire_message.name() {
        "Sweep" | "Measured" | "Aside" => Message::Sweep(sweep(wire_message.name(), &of)),
        "Verdict" => Message::Verdict(SweepVerdict {
            number: of.word("number"),
            view_digest: of.word("view_digest"),
            verdict: Verdict {
                commit: of.has("commit").then(|| of.byte("commit")),
                slacks: of.targets("slack_m"),
            },
            required_x_m: of.has("required_x_m").then(|| of.real("required_x_m")),
            own: of.flag("own", 0),
        }),
        "Busy" => Message::Busy {
            number: of.word("number"),
        },
        "Heartbeat" => Message::Heartbeat {
            mission: of.word("mission"),
            request: of.word("request"),
            reply: of.word("reply"),
        },
        "Gather" => Message::Gather(roster(&of)),
        "Gathered" => Message::Gathered(roster(&of)),
        "Token" => Message::Token(Token {
            number: of.word("number"),
            view_digest: of.word("view_digest"),
            place: of.place(),
            power_w: of.real("power_w"),
            turn: match (of.byte("turn"), of.byte("columns")) {
                (0, _) => AdjustStep::Look,
                (1, _) => AdjustStep::Stop,
                (_, columns) => AdjustStep::Move {
                    explore_m: of.real("explore_m"),
                    local: match of.byte("rows") {
                        0 => Local::Fine,
                        rows => Local::Grid { columns, rows },
                    },
                },
            },
            sir: of.real("sir"),
        }),
        "Moved" => Message::Moved(Moved {
            number: of.word("number"),
            view_digest: of.word("view_digest"),
            place: of.place(),
            position_changed: of.flag("position_changed", 0),
            worst_sir: of.real("worst_sir"),
            power_w: of.real("power_w"),
        }),
        "Hello" => Message::Hello(hello(&of)),
        "Proposal" | "Decision" => vote(wire_message.name(), &of),
        "Fence" => Message::Fence {
            line_digest: of.word("line_digest"),
            fence: Fence {
                association: of.word("association"),
                echo: of.word("echo"),
                number: of.word("number"),
                x_m: of.real("x_m"),
                target_m: of.real("target_m"),
                across: CrossSection {
                    y_m: of.real("y_m"),
                    altitude_m: of.real("altitude_m"),
                },
                apart_m: of.real("apart_m"),
                flags: of.byte("flags"),
            },
        },
        "Offer" => Message::Offer {
            upload: upload(wire_message, &of),
            offer_number: of.word("offer_number"),
        },
        "Pulse" => Message::Pulse(pulse(&of)),
        "Pulsed" => Message::Pulsed(pulsed(&of)),
        "Sense" | "Sensed" => sense(wire_message, &of),
        "Level" => Message::Level {
            mission: of.word("mission"),
            power_w: of.real("power_w"),
        },
        "Claim" => Message::Claim(Claim {
            number: of.long("number"),
            other_number: of.long("other_number"),
            passive: of.flag("flags", 0),
            echo: of.flag("flags", 1),
        }),
        "Watch" => Message::Watch {
            number: of.word("number"),
            mission: of.word("mission"),
        },
        "Report" => Message::Report(reports(&of)),
        other => panic!("{other}"),
    }
}

fn sweep(name: &str, of: &MessageFields<'_>) -> Sweep {
    let anchor = of.real("anchor");
    let ladder = Ladder::from_parts(anchor.abs(), of.byte("gap"), of.byte("growth")).unwrap();
    let chosen = name == "Aside";
    Sweep {
        number: of.word("number"),
        view_digest: of.word("view_digest"),
        // The anchor is negative in a plain pass.
        ladder: ladder.plainly(anchor < 0.0),
        relay: Station {
            cross_section: CrossSection {
                y_m: if chosen { of.real("y_m") } else { 0.0 },
                altitude_m: of.real("altitude_m"),
            },
            power_w: of.real("power_w"),
        },
        chosen,
        measured_per_w: (name == "Measured").then(|| of.real("upsilon_per_w")),
        reaches: of.targets("reach_m"),
    }
}

fn roster(of: &MessageFields<'_>) -> Roster {
    let Some(Value::List(seats)) = of.0.get("seats") else {
        panic!("no seats");
    };
    let seat = |seat: &Value<'static>| match seat {
        Value::Group(fields) => OwnSeat {
            index: MessageFields(fields).word("relay"),
            held_m: MessageFields(fields).real("altitude_m"),
            power_w: MessageFields(fields).real("power_w"),
        },
        other => panic!("{other:?}"),
    };
    Roster {
        number: of.word("number"),
        view_digest: of.word("view_digest"),
        after: of.word("after"),
        seats: seats.iter().map(seat).collect(),
    }
}

fn coarse(of: &MessageFields<'_>, name: &str) -> Coarse {
    let Some(Value::List(axes)) = of.0.get(name) else {
        panic!("no {name}");
    };
    Coarse::new([0, 1, 2].map(|axis| match &axes[axis] {
        Value::Signed(quarters) => *quarters as i32,
        other => panic!("{other:?}"),
    }))
}

fn reports(of: &MessageFields<'_>) -> Reports {
    let mut report = Reports::new(of.word("number"), of.word("mission"));
    report.detail = of.group("detail").map(|of| {
        let power_w = f32::from_bits(u32::from(of.word("interference")) << 16);
        let places = ["setpoint", "agreed"].map(|name| coarse(&of, name));
        let neighbours = ["before", "after"].map(|name| of.byte(name));
        Detail::new(places, neighbours, power_w, of.word("version"))
    });
    let Some(Value::List(entries)) = of.0.get("entries") else {
        panic!("no entries");
    };
    for entry in entries {
        let Value::Group(fields) = entry else {
            panic!("{entry:?}");
        };
        let of = MessageFields(fields);
        let at = coarse(&of, "position");
        let entry = Entry::new(of.word("relay"), of.byte("age_ds"), of.word("state"), at);
        report.entries.push(entry).unwrap();
    }
    report
}

/// Returns the elements of the list `name`, padded with `none`.
fn padded<T: Copy>(
    of: &MessageFields<'_>,
    name: &str,
    none: T,
    one: impl Fn(&Value<'static>) -> T,
) -> [T; AT_ONCE] {
    let Some(Value::List(values)) = of.0.get(name) else {
        panic!("no {name}");
    };
    let mut all = [none; AT_ONCE];
    for (place, value) in all.iter_mut().zip(values) {
        *place = one(value);
    }
    all
}

fn nodes(of: &MessageFields<'_>, name: &str) -> Nodes {
    padded(of, name, 0, |node| match node {
        Value::Unsigned(node) => u16::try_from(*node).unwrap(),
        other => panic!("{other:?}"),
    })
}

fn pulse(of: &MessageFields<'_>) -> Pulse {
    Pulse {
        number: of.word("number"),
        view_digest: of.word("view_digest"),
        lease: of.word("lease_ds"),
        orders: Orders {
            leavers: nodes(of, "leavers"),
            joiners: nodes(of, "joiners"),
            in_place: of.flag("in_place", 0),
        },
    }
}

fn pulsed(of: &MessageFields<'_>) -> Pulsed {
    let leave = |request: &Value<'static>| match request {
        Value::Group(fields) => Leave {
            node: MessageFields(fields).word("relay"),
            endurance_s: MessageFields(fields).word("endurance_s"),
        },
        other => panic!("{other:?}"),
    };
    let none = Leave {
        node: 0,
        endurance_s: 0,
    };
    Pulsed {
        number: of.word("number"),
        view_digest: of.word("view_digest"),
        done: of.flag("done", 0),
        requests: Requests {
            leaves: padded(of, "requests", none, leave),
            spares: nodes(of, "spares"),
            in_place: of.flag("in_place", 0),
        },
    }
}

fn hello(of: &MessageFields<'_>) -> Hello {
    Hello {
        mission: of.word("mission"),
        latest_view: of.id("latest_view"),
        neighbour: of.word("neighbour"),
        behind: of.word("behind"),
        hears: of.byte("hears"),
        latest_mission: of.mission_id("latest_mission", "latest_mission_version"),
        offer_number: of.word("offer_number"),
        requests_reply: of.flag("flags", 0),
        requests_view: of.flag("flags", 1),
        fresh: of.flag("flags", 2),
        ready: of.flag("flags", 3),
        active: of.flag("flags", 4),
        active_in_view: of.flag("flags", 5),
        refused: of.flag("flags", 6),
        outside: of.flag("flags", 7),
    }
}

fn vote(name: &str, of: &MessageFields<'_>) -> Message {
    let mission_id = of.mission_id("mission", "version");
    let (view, place) = (of.id("proposed_view"), of.word("place"));
    if name == "Decision" {
        let accepted = of.group("accepted");
        return Message::Decision(Decision {
            mission_id,
            proposed_view: view,
            place,
            reached: of.word("reached"),
            base: of.view("base_view", "base_relays"),
            accepted: accepted.map(|of| of.view("view", "relays")),
            usable_in: of.word("usable_in_ds"),
        });
    }
    let successor = of.group("successor");
    Message::Proposal(Proposal {
        mission_id,
        proposed_view: view,
        place,
        poll: Poll {
            agreed: of.view("agreed_view", "agreed_relays"),
            votes: of.word("votes"),
            proposer: of.flag("proposer", 0),
            lease_left: of.word("lease_left_ds"),
            earlier_lease_left: of.word("earlier_lease_left_ds"),
            successor: successor.map(|of| Successor {
                proposal: of.id("proposal"),
                view: of.view("view", "relays"),
            }),
        },
    })
}

/// Decodes an upload with the crate, and checks each number. Code outside the crate cannot construct an upload.
fn upload(wire_message: &WireMessage, of: &MessageFields<'_>) -> Upload {
    let upload = Upload::decode(&offer::kept(wire_message)).unwrap();
    let config = upload.config();
    let band = |least, most| make::band(of.real(least), of.real(most));
    assert_eq!(
        (upload.version(), upload.base(), config.relays),
        (of.word("version"), of.word("base"), of.word("relays"))
    );
    let common = make::profile(of.real("altitude_m"), of.real("power_w"));
    assert_eq!(config.common, common);
    let numbers = [
        ("distance_m", config.distance_m),
        ("min_separation_m", config.min_separation_m),
        ("tx_power_w", config.tx_power_w),
        ("tolerance", config.tolerance),
        ("noise_w", config.noise_w),
        ("reverse", config.reverse),
        ("rx_power_w", config.rx_power_w),
        ("fitted_gap", config.fitted_gap),
    ];
    for (name, number) in numbers {
        assert_eq!(number, of.real(name), "{name}");
    }
    let interferer = make::interferer(
        of.real("interferer_power_w"),
        of.real("interferer_x_m"),
        of.real("interferer_y_m"),
    );
    let interference = if interferer.power_w == 0.0 {
        Interference::Unknown
    } else {
        Interference::Source(interferer)
    };
    assert_eq!(config.interference, interference);
    let channel = config.channel;
    let factors = [channel.mu_los(), channel.mu_nlos(), channel.eta()];
    assert_eq!(
        factors,
        ["mu_los", "mu_nlos", "eta"].map(|name| number(of.0, name))
    );
    assert_eq!(config.band, band("altitude_min_m", "altitude_max_m"));
    assert_eq!(config.lateral, band("lateral_min_m", "lateral_max_m"));
    let sites = upload.sites().map_or([0; 6], |Sites { tx, rx }| {
        let six = [tx, rx].map(|at| [at.lat_e7, at.lon_e7, at.amsl_mm]);
        six.as_flattened().try_into().unwrap()
    });
    assert_eq!(sites, offer::SITES.map(|name| number(of.0, name) as i32));
    assert_eq!(
        (upload.id().digest, upload.id().version),
        offer::mission_id(wire_message)
    );
    upload
}

/// Decodes summed measurements with the crate, and checks each number. Code outside the crate cannot construct such
/// sums.
fn sense(wire_message: &WireMessage, of: &MessageFields<'_>) -> Message {
    let message = Message::decode(wire_message.body()).unwrap();
    let (Message::Sense(heard) | Message::Sensed(heard)) = &message else {
        panic!("{message:?}");
    };
    let estimate = match of.byte("estimate") {
        0 => InterferenceEstimate::Mission,
        1 => InterferenceEstimate::Unknown(Spread::Even),
        2 => InterferenceEstimate::Unknown(Spread::TowardTx),
        3 => InterferenceEstimate::Unknown(Spread::TowardRx),
        _ => InterferenceEstimate::Source {
            source: make::interferer(
                of.real("source_power_w"),
                of.real("source_x_m"),
                of.real("source_y_m"),
            ),
            receiver_w: of.real("source_at_rx_w"),
        },
    };
    let ends = ["sum_vv", "places", "measurements", "age_s"].map(|name| of.real(name));
    let lists = ["sum_ab", "sum_av"].map(|name| list(of.0, name));
    let numbers: Vec<f32> = lists.concat().into_iter().chain(ends).collect();
    let Heard {
        number,
        view_digest: mission,
        estimate: told,
        sums,
        receiver,
        excluded: off,
    } = heard;
    assert_eq!(*number, of.word("number"));
    assert_eq!(*mission, of.word("view_digest"));
    let number = of.word("estimate_number");
    assert_eq!(*told, NumberedEstimate { number, estimate });
    // The order of the sums can be seen in this text only.
    assert_eq!(
        format!("{sums:?}"),
        format!("Sums {{ numbers: {numbers:?} }}")
    );
    let level = [receiver.power_w, receiver.count];
    assert_eq!(
        level,
        ["rx_power_w", "rx_measurements"].map(|name| of.real(name))
    );
    assert_eq!(*off, of.word("excluded"));
    assert_eq!(
        matches!(message, Message::Sense(_)),
        wire_message.is("Sense")
    );
    message
}
