//! `[companion]` section of the file, as options.

use uav_relay_scenario::deployment::Deployment;

use uav_relay_linux::config::{Given, network};

pub(crate) fn companion(deployment: &Deployment, given: &mut Given) {
    network(deployment, given);
    let own = &deployment.companion;
    given.value("--index", own.index);
    given.path("--upstream", own.upstream.as_ref());
    given.path("--downstream", own.downstream.as_ref());
    given.path("--shared", own.shared.as_ref());
    given.path("--epoch-file", own.epoch_file.as_ref());
    given.path("--upload-file", own.upload_file.as_ref());
    given.path("--view-file", own.view_file.as_ref());
    given.path_or_udp("--autopilot", own.autopilot.as_ref());
    given.value("--autopilot-baud", own.autopilot_baud);
    given.path("--autopilot-key-file", own.autopilot_key_file.as_ref());
    given.value("--speed", own.speed_m_s);
    given.path("--positions", own.positions.as_ref());
    given.value("--position-error", own.position_error_m);
    given.flag("--json", own.json);
    given.path("--log-file", own.log_file.as_ref());
    given.path("--status-socket", own.status_socket.as_ref());
    given.path("--capture", own.capture.as_ref());
}
