//! Table of keys of the deployment sections, like [`crate::keys`] for a scenario.

use crate::keys::Rule::{Choice, Number, Text, Whole};
use crate::keys::{Keys, Range, Rule, optional, range};

const BAUD: Range = range(1_200.0, 4e6, "bit/s");
const SILENCE: Range = range(1.0, 3.6e6, "ms");

pub(super) const SECTIONS: Keys = &[
    optional("network", Rule::Table(NETWORK)),
    optional("companion", Rule::Table(COMPANION)),
    optional("ground", Rule::Table(GROUND)),
];

const NETWORK: Keys = &[
    optional("id", Whole(range(0.0, 65_535.0, ""))),
    optional("relays", Whole(range(1.0, 1_000.0, ""))),
    optional("key_file", Text),
    optional("method", Choice(&["align", "joint", "adjust"])),
    optional("baud", Whole(BAUD)),
    optional("probe_after_ms", Whole(SILENCE)),
    optional("dead_after_ms", Whole(SILENCE)),
];

const COMPANION: Keys = &[
    optional("index", Whole(range(1.0, 1_000.0, ""))),
    optional("upstream", Text),
    optional("downstream", Text),
    optional("shared", Text),
    optional("epoch_file", Text),
    optional("upload_file", Text),
    optional("view_file", Text),
    optional("autopilot", Rule::TtyOrUdp),
    optional("autopilot_baud", Whole(BAUD)),
    optional("autopilot_key_file", Text),
    optional("speed_m_s", Number(range(0.1, 20.0, "m/s"))),
    optional("positions", Text),
    optional("position_error_m", Number(range(0.0, 1_000.0, "m"))),
    optional("json", Rule::Flag),
    optional("log_file", Text),
    optional("status_socket", Text),
    optional("capture", Text),
];

const GROUND: Keys = &[
    optional("tty", Text),
    optional("shared", Rule::Flag),
    optional("end", Choice(&["tx", "rx"])),
    optional("epoch_file", Text),
    optional("timeout_s", Whole(range(1.0, 86_400.0, "s"))),
    optional("stand", Rule::Flag),
    optional("measurements", Text),
    optional("json", Rule::Flag),
    optional("log_file", Text),
    optional("status_socket", Text),
    optional("capture", Text),
];
