-- Frames of uav-relay in Wireshark. Written by `cargo decode --dissector` from the tables of FORMAT.md: do not edit it.
--
-- wireshark -X lua_script:examples/wireshark/uav_relay.lua FILE
-- or copy it to the folder that Help > About Wireshark > Folders calls `Personal Lua Plugins`.

local messages = {
    [0x00] = { name = "Sweep", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "anchor", kind = "f32", unit = "linear SIR", text = "anchor of the ladder; negative for a plain pass" },
        { name = "gap", kind = "u8", unit = "", text = "gap code of the ladder" },
        { name = "growth", kind = "u8", unit = "", text = "growth code of the ladder" },
        { name = "altitude_m", kind = "f32", unit = "m", text = "altitude of the sender" },
        { name = "power_w", kind = "f32", unit = "W", text = "transmit power of the sender" },
        { name = "reach_m", kind = "list", most = 16, of = { kind = "f32" }, unit = "m from Tx", text = "reach for target 0, 1, ...: the sender's position" },
    } },
    [0x01] = { name = "Verdict", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "own", kind = "bool", unit = "", text = "true if the sender or a relay after it has a profile of its own: another power than the mission's common one, or a fixed altitude where relays choose theirs" },
        { name = "commit", kind = "option", of = { kind = "u8" }, unit = "", text = "index of the target for which every relay now takes its position" },
        { name = "slack_m", kind = "list", most = 16, of = { kind = "f32" }, unit = "m", text = "slack of target 0, 1, ...: distance by which the chain overshoots Rx (in a field: Tx)" },
        { name = "required_x_m", kind = "option", of = { kind = "f32" }, unit = "m from Tx", text = "required position of the receiver if a target is committed; none: the receiver's reach for that target" },
    } },
    [0x02] = { name = "Busy", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass; for a proposal the mark of its view, see Views" },
    } },
    [0x03] = { name = "Heartbeat", fields = {
        { name = "mission", kind = "digest", unit = "", text = "digest of the sender's mission as loaded before flight" },
        { name = "request", kind = "u16", unit = "", text = "number of the sender's request; 0 for none" },
        { name = "reply", kind = "u16", unit = "", text = "number of the answered request; 0 for none" },
    } },
    [0x04] = { name = "Measured", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "anchor", kind = "f32", unit = "linear SIR", text = "anchor of the ladder; negative for a plain pass" },
        { name = "gap", kind = "u8", unit = "", text = "gap code of the ladder" },
        { name = "growth", kind = "u8", unit = "", text = "growth code of the ladder" },
        { name = "altitude_m", kind = "f32", unit = "m", text = "altitude of the sender" },
        { name = "power_w", kind = "f32", unit = "W", text = "transmit power of the sender" },
        { name = "upsilon_per_w", kind = "f32", unit = "1/W", text = "Upsilon = E[1/I] as measured by the sender" },
        { name = "reach_m", kind = "list", most = 16, of = { kind = "f32" }, unit = "m from Tx", text = "reach for target 0, 1, ..." },
    } },
    [0x05] = { name = "Aside", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "anchor", kind = "f32", unit = "linear SIR", text = "anchor of the ladder; negative for a plain pass" },
        { name = "gap", kind = "u8", unit = "", text = "gap code of the ladder" },
        { name = "growth", kind = "u8", unit = "", text = "growth code of the ladder" },
        { name = "altitude_m", kind = "f32", unit = "m", text = "altitude of the sender" },
        { name = "power_w", kind = "f32", unit = "W", text = "transmit power of the sender" },
        { name = "y_m", kind = "f32", unit = "m", text = "chosen y" },
        { name = "reach_m", kind = "list", most = 16, of = { kind = "f32" }, unit = "m from Tx", text = "reach for target 0, 1, ..." },
    } },
    [0x06] = { name = "Gather", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "after", kind = "u16", unit = "", text = "index of the last relay in earlier passes; 0 in the first pass" },
        { name = "seats", kind = "list", most = 8, of = { kind = "group", fields = {
            { name = "relay", kind = "u16", unit = "", text = "index of the relay in the view, 1 next to Tx" },
            { name = "altitude_m", kind = "f32", unit = "m", text = "fixed altitude; 0 if the relay chooses" },
            { name = "power_w", kind = "f32", unit = "W", text = "transmit power" },
        } }, unit = "", text = "seats, by rising index" },
    } },
    [0x07] = { name = "Gathered", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "after", kind = "u16", unit = "", text = "index of the last relay in earlier passes; 0 in the first pass" },
        { name = "seats", kind = "list", most = 8, of = { kind = "group", fields = {
            { name = "relay", kind = "u16", unit = "", text = "index of the relay in the view, 1 next to Tx" },
            { name = "altitude_m", kind = "f32", unit = "m", text = "fixed altitude; 0 if the relay chooses" },
            { name = "power_w", kind = "f32", unit = "W", text = "transmit power" },
        } }, unit = "", text = "seats, by rising index" },
    } },
    [0x08] = { name = "Token", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "x_m", kind = "f32", unit = "m from Tx", text = "current x of the sender" },
        { name = "altitude_m", kind = "f32", unit = "m", text = "current altitude of the sender" },
        { name = "power_w", kind = "f32", unit = "W", text = "transmit power of the sender" },
        { name = "turn", kind = "words", words = { [0] = "look", [1] = "stop", [2] = "move" }, unit = "", text = "turn: 0 look, 1 stop, 2 move" },
        { name = "explore_m", kind = "f32", unit = "m", text = "maximum change of altitude" },
        { name = "columns", kind = "u8", unit = "", text = "columns of the search grid; 0: from coarse to fine" },
        { name = "rows", kind = "u8", unit = "", text = "rows of the search grid" },
        { name = "sir", kind = "f32", unit = "linear SIR", text = "SIR of the chain before this pass; 0 if unknown" },
    } },
    [0x09] = { name = "Moved", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "x_m", kind = "f32", unit = "m from Tx", text = "current x of the sender" },
        { name = "altitude_m", kind = "f32", unit = "m", text = "current altitude of the sender" },
        { name = "position_changed", kind = "bool", unit = "", text = "true if the sender or any relay after it has moved" },
        { name = "worst_sir", kind = "f32", unit = "linear SIR", text = "SIR of the worst hop after the sender" },
        { name = "power_w", kind = "f32", unit = "W", text = "transmit power of the sender" },
    } },
    [0x0a] = { name = "Hello", fields = {
        { name = "mission", kind = "digest", unit = "", text = "digest of the sender's mission as loaded before flight" },
        { name = "neighbour", kind = "u16", unit = "", text = "selected neighbour of the sender on the destination's side; 0 for none" },
        { name = "behind", kind = "u16", unit = "", text = "number of connected relays from the sender on, away from the destination, with the sender; 1 while the sender is fresh" },
        { name = "latest_view", kind = "view", unit = "", text = "latest view known to the sender" },
        { name = "latest_mission", kind = "digest", unit = "", text = "digest of the newest mission that the sender has" },
        { name = "latest_mission_version", kind = "u16", unit = "", text = "version of the mission in `latest_mission`" },
        { name = "offer_number", kind = "u16", unit = "", text = "number for the offer that answers this hello; 0 at a node that accepts no offers, and at Tx and Rx unless they ask for the flown mission" },
        { name = "hears", kind = "u8", unit = "", text = "nodes on the destination's side that the sender receives, bit 0 for the nearest, bit 3 for the fourth" },
        { name = "flags", kind = "flags", words = { "requests_reply", "requests_view", "fresh", "ready", "active", "active_in_view", "refused", "outside" }, unit = "", text = "flags" },
    } },
    [0x0b] = { name = "Proposal", fields = {
        { name = "mission", kind = "digest", unit = "", text = "digest of the proposed mission" },
        { name = "version", kind = "u16", unit = "", text = "version of the proposed mission" },
        { name = "proposed_view", kind = "view", unit = "", text = "proposed view" },
        { name = "place", kind = "u16", unit = "", text = "number of relays that the proposal has reached, the sender included" },
        { name = "agreed_view", kind = "view", unit = "", text = "newest view that a relay up to the sender knows to be agreed on" },
        { name = "agreed_relays", kind = "u16", unit = "", text = "number of relays of the agreed view" },
        { name = "votes", kind = "u16", unit = "", text = "number of members of the agreed view up to the sender" },
        { name = "lease_left_ds", kind = "u16", unit = "0.1 s", text = "remaining lease of the other members of the agreed view", per = 10, base = "s" },
        { name = "earlier_lease_left_ds", kind = "u16", unit = "0.1 s", text = "time until positions may be used, for leases of earlier views", per = 10, base = "s" },
        { name = "proposer", kind = "bool", unit = "", text = "true if the proposer of the agreed view is one of the voters" },
        { name = "successor", kind = "option", of = { kind = "group", fields = {
            { name = "proposal", kind = "view", unit = "", text = "proposal by which the successor was decided" },
            { name = "view", kind = "view", unit = "", text = "successor" },
            { name = "relays", kind = "u16", unit = "", text = "number of relays of the successor" },
        } }, unit = "", text = "latest successor of the agreed view that a voter has accepted:" },
    } },
    [0x0c] = { name = "Decision", fields = {
        { name = "mission", kind = "digest", unit = "", text = "digest of the proposed mission" },
        { name = "version", kind = "u16", unit = "", text = "version of the proposed mission" },
        { name = "proposed_view", kind = "view", unit = "", text = "proposed view" },
        { name = "place", kind = "u16", unit = "", text = "place of the sender, as in a Proposal" },
        { name = "base_view", kind = "view", unit = "", text = "view that the decision follows: the newest that a voter knows to be agreed on" },
        { name = "base_relays", kind = "u16", unit = "", text = "number of relays of the base view" },
        { name = "accepted", kind = "option", of = { kind = "group", fields = {
            { name = "view", kind = "view", unit = "", text = "the proposed view, or one that was decided before" },
            { name = "relays", kind = "u16", unit = "", text = "number of relays of that view" },
        } }, unit = "", text = "view to accept; none without a quorum:" },
        { name = "reached", kind = "u16", unit = "", text = "number of relays that the proposal has reached" },
        { name = "usable_in_ds", kind = "u16", unit = "0.1 s", text = "time until positions may be used", per = 10, base = "s" },
    } },
    [0x0d] = { name = "Fence", fields = {
        { name = "association", kind = "u16", unit = "", text = "number of the sender's association with the receiver" },
        { name = "line_digest", kind = "digest", unit = "", text = "digest of the sender's line, see Views" },
        { name = "echo", kind = "u16", unit = "", text = "number of the receiver's association as last received; 0 for none" },
        { name = "number", kind = "u16", unit = "", text = "number of the fence; toward Tx, of the newest fence received" },
        { name = "x_m", kind = "f32", unit = "m", text = "x of the fence; toward Tx, the low end of the sender's own interval" },
        { name = "target_m", kind = "f32", unit = "m", text = "agreed x of the sender" },
        { name = "y_m", kind = "f32", unit = "m", text = "y that the sender flies to" },
        { name = "altitude_m", kind = "f32", unit = "m", text = "altitude that the sender flies to" },
        { name = "apart_m", kind = "f32", unit = "m", text = "toward Rx, the distance along x that the sender keeps from the fence; toward Tx 0" },
        { name = "flags", kind = "flags", words = { "arrived", "agrees", "requests_opening", "opening_received", "left", "halts", "unplaced" }, unit = "", text = "flags" },
    } },
    [0x0e] = { name = "Offer", fields = {
        { name = "version", kind = "u16", unit = "", text = "version of the mission" },
        { name = "base", kind = "digest", unit = "", text = "digest of the mission that the relays were loaded with" },
        { name = "relays", kind = "u16", unit = "", text = "N, number of relays" },
        { name = "distance_m", kind = "f32", unit = "m", text = "D, distance from Tx to Rx" },
        { name = "min_separation_m", kind = "f32", unit = "m", text = "S, minimum separation" },
        { name = "tx_power_w", kind = "f32", unit = "W", text = "power of Tx" },
        { name = "altitude_m", kind = "f32", unit = "m", text = "common altitude" },
        { name = "power_w", kind = "f32", unit = "W", text = "common power" },
        { name = "interferer_power_w", kind = "f32", unit = "W", text = "power of the interferer; 0 if unknown, then with an x and y of 0" },
        { name = "interferer_x_m", kind = "f32", unit = "m from Tx", text = "x of the interferer" },
        { name = "interferer_y_m", kind = "f32", unit = "m to the right", text = "y of the interferer" },
        { name = "tolerance", kind = "f32", unit = "", text = "tolerance" },
        { name = "mu_los", kind = "f64", unit = "", text = "mu_LoS" },
        { name = "mu_nlos", kind = "f64", unit = "", text = "mu_NLoS" },
        { name = "eta", kind = "f64", unit = "", text = "eta" },
        { name = "altitude_min_m", kind = "f32", unit = "m", text = "lowest altitude of the band" },
        { name = "altitude_max_m", kind = "f32", unit = "m", text = "highest altitude of the band" },
        { name = "lateral_min_m", kind = "f32", unit = "m", text = "least y" },
        { name = "lateral_max_m", kind = "f32", unit = "m", text = "greatest y" },
        { name = "noise_w", kind = "f32", unit = "W", text = "noise power at every receiver; 0 for none" },
        { name = "reverse", kind = "f32", unit = "", text = "r, the relative SIR of the way back; 0 for one direction" },
        { name = "rx_power_w", kind = "f32", unit = "W", text = "power of Rx on the way back" },
        { name = "fitted_gap", kind = "f32", unit = "", text = "SNR gap of fitted slots, or 0" },
        { name = "tx_lat_e7", kind = "i32", unit = "1e-7 degrees", text = "latitude of Tx, positive north", per = 10000000, base = "degrees" },
        { name = "tx_lon_e7", kind = "i32", unit = "1e-7 degrees", text = "longitude of Tx, positive east", per = 10000000, base = "degrees" },
        { name = "tx_amsl_mm", kind = "i32", unit = "mm", text = "height of the ground at Tx above mean sea level" },
        { name = "rx_lat_e7", kind = "i32", unit = "1e-7 degrees", text = "latitude of Rx, positive north", per = 10000000, base = "degrees" },
        { name = "rx_lon_e7", kind = "i32", unit = "1e-7 degrees", text = "longitude of Rx, positive east", per = 10000000, base = "degrees" },
        { name = "rx_amsl_mm", kind = "i32", unit = "mm", text = "height of the ground at Rx above mean sea level" },
        { name = "offer_number", kind = "u16", unit = "", text = "number of the receiver's hello that the offer answers; 0 for none" },
    } },
    [0x0f] = { name = "Pulse", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the renewal, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "lease_ds", kind = "u16", unit = "0.1 s", text = "duration of the lease after a member has taken part in a renewal", per = 10, base = "s" },
        { name = "in_place", kind = "bool", unit = "", text = "true if all relays are in place, see Departures" },
        { name = "leavers", kind = "list", most = 4, of = { kind = "u16" }, unit = "", text = "relays that may leave the view" },
        { name = "joiners", kind = "list", most = 4, of = { kind = "u16" }, unit = "", text = "relays that are called to join" },
    } },
    [0x10] = { name = "Pulsed", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the renewal, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "in_place", kind = "bool", unit = "", text = "true if the sender and all relays after it are in place" },
        { name = "done", kind = "bool", unit = "", text = "true if the renewal has completed; else the other fields have no meaning" },
        { name = "requests", kind = "list", most = 4, of = { kind = "group", fields = {
            { name = "relay", kind = "u16", unit = "", text = "relay that would leave" },
            { name = "endurance_s", kind = "u16", unit = "s", text = "endurance of its drone, at least 1; 65535 if unknown; 0 if it is a leaver of the Pulse" },
        } }, unit = "", text = "requests to leave, the most urgent one first" },
        { name = "spares", kind = "list", most = 4, of = { kind = "u16" }, unit = "", text = "spares that would join" },
    } },
    [0x11] = { name = "Sense", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "estimate_number", kind = "u16", unit = "", text = "number of the estimate, which the leader increments, wrapping" },
        { name = "estimate", kind = "words", words = { [0] = "that of the mission", [1] = "none, the relays spread evenly", [2] = "none, the first hop half as long as the others", [3] = "none, the last hop half as long as the others", [4] = "one source" }, unit = "", text = "estimate: 0 that of the mission; 1 none, the relays spread evenly; 2 none, the first hop half as long as the others; 3 none, the last hop half as long as the others; 4 one source" },
        { name = "source_power_w", kind = "f32", unit = "W", text = "power of the source" },
        { name = "source_x_m", kind = "f32", unit = "m from Tx", text = "x of the source" },
        { name = "source_y_m", kind = "f32", unit = "m to the right", text = "y of the source" },
        { name = "source_at_rx_w", kind = "f32", unit = "W", text = "power of the source at Rx; 0 if Rx has reported none" },
        { name = "sum_ab", kind = "array", size = 10, of = { kind = "f32" }, unit = "", text = "sums of w a b for the terms a, b = 1 1, 1 2, 1 3, 1 4, 2 2, 2 3, 2 4, 3 3, 3 4, 4 4" },
        { name = "sum_av", kind = "array", size = 4, of = { kind = "f32" }, unit = "", text = "sums of w a v for the first to the fourth term" },
        { name = "sum_vv", kind = "f32", unit = "", text = "sum of w v^2" },
        { name = "places", kind = "f32", unit = "", text = "sum of the weights of the measured positions" },
        { name = "measurements", kind = "f32", unit = "", text = "number of measurements, weighted by position" },
        { name = "age_s", kind = "f32", unit = "s", text = "age of the measurements, weighted by position" },
        { name = "rx_power_w", kind = "f32", unit = "W", text = "mean interference at Rx; 0 if Rx has reported none" },
        { name = "rx_measurements", kind = "f32", unit = "", text = "number of measurements at Rx that have not faded" },
        { name = "excluded", kind = "u16", unit = "", text = "node number of a relay whose measurements are excluded; 0 for none" },
    } },
    [0x12] = { name = "Sensed", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the pass, wrapping" },
        { name = "view_digest", kind = "digest", unit = "", text = "digest of the sender's mission and view" },
        { name = "estimate_number", kind = "u16", unit = "", text = "number of the estimate, which the leader increments, wrapping" },
        { name = "estimate", kind = "words", words = { [0] = "that of the mission", [1] = "none, the relays spread evenly", [2] = "none, the first hop half as long as the others", [3] = "none, the last hop half as long as the others", [4] = "one source" }, unit = "", text = "estimate: 0 that of the mission; 1 none, the relays spread evenly; 2 none, the first hop half as long as the others; 3 none, the last hop half as long as the others; 4 one source" },
        { name = "source_power_w", kind = "f32", unit = "W", text = "power of the source" },
        { name = "source_x_m", kind = "f32", unit = "m from Tx", text = "x of the source" },
        { name = "source_y_m", kind = "f32", unit = "m to the right", text = "y of the source" },
        { name = "source_at_rx_w", kind = "f32", unit = "W", text = "power of the source at Rx; 0 if Rx has reported none" },
        { name = "sum_ab", kind = "array", size = 10, of = { kind = "f32" }, unit = "", text = "sums of w a b for the terms a, b = 1 1, 1 2, 1 3, 1 4, 2 2, 2 3, 2 4, 3 3, 3 4, 4 4" },
        { name = "sum_av", kind = "array", size = 4, of = { kind = "f32" }, unit = "", text = "sums of w a v for the first to the fourth term" },
        { name = "sum_vv", kind = "f32", unit = "", text = "sum of w v^2" },
        { name = "places", kind = "f32", unit = "", text = "sum of the weights of the measured positions" },
        { name = "measurements", kind = "f32", unit = "", text = "number of measurements, weighted by position" },
        { name = "age_s", kind = "f32", unit = "s", text = "age of the measurements, weighted by position" },
        { name = "rx_power_w", kind = "f32", unit = "W", text = "mean interference at Rx; 0 if Rx has reported none" },
        { name = "rx_measurements", kind = "f32", unit = "", text = "number of measurements at Rx that have not faded" },
        { name = "excluded", kind = "u16", unit = "", text = "node number of a relay whose measurements are excluded; 0 for none" },
    } },
    [0x13] = { name = "Level", fields = {
        { name = "mission", kind = "digest", unit = "", text = "digest of the mission that the relays were loaded with" },
        { name = "power_w", kind = "f32", unit = "W", text = "mean received power, with the noise of the receiver" },
    } },
    [0x14] = { name = "Claim", fields = {
        { name = "number", kind = "u32", unit = "", text = "claim number" },
        { name = "other_number", kind = "u32", unit = "", text = "last claim number that the claiming node has received from another node of its number; 0 for none" },
        { name = "flags", kind = "flags", words = { "passive", "echo" }, unit = "", text = "flags" },
    } },
    [0x15] = { name = "Watch", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the request, wrapping" },
        { name = "mission", kind = "digest", unit = "", text = "digest of the mission that the relays were loaded with" },
    } },
    [0x16] = { name = "Report", fields = {
        { name = "number", kind = "u16", unit = "", text = "number of the request, wrapping" },
        { name = "mission", kind = "digest", unit = "", text = "digest of the mission that the relays were loaded with" },
        { name = "detail", kind = "option", of = { kind = "group", fields = {
            { name = "setpoint", kind = "array", size = 3, of = { kind = "i24" }, unit = "0.25 m", text = "x, y, altitude of the setpoint", per = 4, base = "m" },
            { name = "agreed", kind = "array", size = 3, of = { kind = "i24" }, unit = "0.25 m", text = "x, y, altitude of the agreed position", per = 4, base = "m" },
            { name = "before", kind = "u8", unit = "", text = "distance to the neighbour toward Tx, in node numbers; 0 for none" },
            { name = "after", kind = "u8", unit = "", text = "distance to the neighbour toward Rx, in node numbers; 0 for none" },
            { name = "interference", kind = "u16", unit = "", text = "upper half of an f32: measured interference in W; 0 for none" },
            { name = "version", kind = "u16", unit = "", text = "version of the flown mission" },
        } }, unit = "", text = "details of the first entry's relay:" },
        { name = "entries", kind = "list", most = 4, of = { kind = "group", fields = {
            { name = "relay", kind = "u16", unit = "", text = "number of the relay + 1000 m" },
            { name = "age_ds", kind = "u8", unit = "0.1 s", text = "age of the state; 255: 25.5 s or more, the entry is ignored", per = 10, base = "s" },
            { name = "state", kind = "u16", unit = "", text = "phase + 8 h + 64 k + 512 s + 1024 t + 2048 l + 4096 c + 28672 d" },
            { name = "position", kind = "array", size = 3, of = { kind = "i24" }, unit = "0.25 m", text = "x, y, altitude of the drone", per = 4, base = "m" },
        } }, unit = "", text = "states" },
    } },
}

local handshake = { name = "Handshake", fields = {
    { name = "sender_nonce", kind = "u64", unit = "", text = "nonce of the sender toward the receiver" },
    { name = "receiver_nonce", kind = "u64", unit = "", text = "nonce of the receiver toward the sender, as known to the sender; 0 if unknown" },
    { name = "asks", kind = "u8", unit = "", text = "1 if the sender lacks proof that the receiver is present, else 0" },
} }

-- What stands above is data; from here on it is read.

local MOST = 147 -- bytes of a frame without COBS
local HEADER, TAG, CHECK = 10, 8, 4

local proto = Proto("uav_relay", "UAV relay")
local all = {}

local function keep(made)
    all[#all + 1] = made
    return made
end

local head = {
    version = keep(ProtoField.uint8("uav_relay.version", "version")),
    sender = keep(ProtoField.uint16("uav_relay.sender", "sender")),
    flags = keep(ProtoField.uint8("uav_relay.flags", "flags", base.HEX)),
    destination = keep(ProtoField.uint16("uav_relay.destination", "destination")),
    network = keep(ProtoField.uint16("uav_relay.network", "network")),
    counter = keep(ProtoField.uint32("uav_relay.counter", "counter")),
    tag = keep(ProtoField.bytes("uav_relay.tag", "tag")),
    crc = keep(ProtoField.uint32("uav_relay.crc", "CRC", base.HEX)),
    message = keep(ProtoField.string("uav_relay.message", "message")),
    refused = keep(ProtoField.string("uav_relay.refused", "refused")),
}
local wrong = ProtoExpert.new("uav_relay.wrong", "The frame is refused", expert.group.MALFORMED, expert.severity.ERROR)
proto.experts = { wrong }

-- Bytes and constructor of each type of a fixed size.
local plain = {
    u8 = { 1, ProtoField.uint8 },
    u16 = { 2, ProtoField.uint16 },
    u32 = { 4, ProtoField.uint32 },
    u64 = { 8, ProtoField.uint64 },
    i24 = { 3, ProtoField.int24 },
    i32 = { 4, ProtoField.int32 },
    f32 = { 4, ProtoField.float },
    f64 = { 8, ProtoField.double },
    bool = { 1, ProtoField.uint8 },
    digest = { 2, ProtoField.uint16, base.HEX },
    view = { 4, ProtoField.uint32 },
    flags = { 1, ProtoField.uint8, base.HEX },
    words = { 1, ProtoField.uint8 },
}
local yes = { [0] = "no", [1] = "yes" }

-- Makes what Wireshark needs of a field, and of those within it.
local function declare(abbreviation, field)
    local kind = field.kind
    if kind == "group" then
        for _, inner in ipairs(field.fields) do
            declare(abbreviation .. "." .. inner.name, inner)
        end
        return
    end
    if kind == "option" or kind == "array" or kind == "list" then
        if kind == "list" then
            field.count = keep(ProtoField.uint8(abbreviation .. "_count", field.name .. "_count"))
        end
        field.of.name, field.of.text, field.of.unit = field.name, field.text, field.unit
        declare(abbreviation, field.of)
        return
    end
    local make, display = plain[kind][2], plain[kind][3]
    if kind == "f32" or kind == "f64" then
        field.made = keep(make(abbreviation, field.name, field.text))
    elseif kind == "words" or kind == "bool" then
        field.made = keep(make(abbreviation, field.name, base.DEC, kind == "bool" and yes or field.words, nil, field.text))
    else
        field.made = keep(make(abbreviation, field.name, display or base.DEC, nil, nil, field.text))
    end
    if kind == "flags" then
        field.bits = {}
        for bit, name in ipairs(field.words) do
            local mask = 2 ^ (bit - 1)
            field.bits[bit] = keep(ProtoField.bool(abbreviation .. "." .. name, name, 8, nil, mask))
        end
    end
end

local function declare_message(message)
    for _, field in ipairs(message.fields) do
        declare("uav_relay." .. message.name:lower() .. "." .. field.name, field)
    end
end
for _, message in pairs(messages) do
    declare_message(message)
end
declare_message(handshake)
proto.fields = all

-- A body under way: what is refused ends it by an error whose text is the reason.
local function refuse(why)
    error({ why = why }, 0)
end

local function bytes(body, count)
    if body.at + count > body.ends then
        refuse("malformed")
    end
    local range = body.tvb(body.at, count)
    body.at = body.at + count
    return range
end

-- A postcard varint in its one form, and where it stands.
local function varint(body)
    local from, number, factor = body.at, 0, 1
    while true do
        local byte = bytes(body, 1):uint()
        if byte == 0 and factor > 1 or factor > 2 ^ 28 then
            refuse("malformed")
        end
        number = number + byte % 128 * factor
        if byte < 128 then
            return number, body.tvb(from, body.at - from)
        end
        factor = factor * 128
    end
end

local function flag(body)
    local range = bytes(body, 1)
    if range:uint() > 1 then
        refuse("malformed")
    end
    return range:uint() == 1, range
end

local read

local function several(tree, field, body, count)
    for number = 1, count do
        if field.of.kind == "group" then
            local from = body.at
            local branch = tree:add(body.tvb(from, 0), field.name .. " " .. number)
            read(branch, field.of, body)
            branch:set_len(body.at - from)
        else
            read(tree, field.of, body)
        end
    end
end

function read(tree, field, body)
    local kind = field.kind
    if kind == "group" then
        for _, inner in ipairs(field.fields) do
            read(tree, inner, body)
        end
    elseif kind == "array" then
        several(tree, field, body, field.size)
    elseif kind == "list" then
        local count, range = varint(body)
        tree:add(field.count, range, count)
        if count > field.most then
            refuse("malformed")
        end
        several(tree, field, body, count)
    elseif kind == "option" then
        local some, range = flag(body)
        if not some then
            tree:add(range, field.name .. ": none")
        elseif field.of.kind == "group" then
            local branch = tree:add(range, field.name)
            read(branch, field.of, body)
        else
            read(tree, field.of, body)
        end
    else
        local range
        if kind == "bool" then
            range = select(2, flag(body))
        else
            range = bytes(body, plain[kind][1])
        end
        local item = tree:add_le(field.made, range)
        if field.unit ~= "" then
            item:append_text(field.per and string.format(" x %s", field.unit) or " " .. field.unit)
        end
        if field.per then
            local number = (kind == "i24" or kind == "i32") and range:le_int() or range:le_uint()
            item:append_text(string.format(" = %.10g %s", number / field.per, field.base))
        elseif kind == "view" and range:le_uint() > 0 then
            local view = range:le_uint()
            item:append_text(string.format(" (%d by node %d)", math.floor(view / 1024), view % 1024))
        elseif kind == "flags" then
            for _, bit in ipairs(field.bits) do
                item:add(bit, range)
            end
        end
    end
end

-- CRC-32C, reflected. Whichever Lua it is has one of these.
local library = bit32 or bit
local xor = library and library.bxor or load("return function(a, b) return a ~ b end")()
local steps = {}
for byte = 0, 255 do
    local crc = byte
    for _ = 1, 8 do
        local low = crc % 2
        crc = math.floor(crc / 2)
        if low == 1 then
            crc = xor(crc, 0x82f63b78) % 2 ^ 32
        end
    end
    steps[byte] = crc
end

local function crc32c(tvb, count)
    local crc = 0xffffffff
    for at = 0, count - 1 do
        local byte = xor(crc % 256, tvb(at, 1):uint()) % 256
        crc = xor(math.floor(crc / 256), steps[byte]) % 2 ^ 32
    end
    return xor(crc, 0xffffffff) % 2 ^ 32
end

-- What stands before the delimiter without COBS, as a tvb, or why there is nothing.
local function unstuffed(tvb, from, ends, is_ended)
    if not is_ended then
        return nil, "unended"
    end
    local plain_bytes = {}
    local at = from
    while at < ends do
        local run = tvb(at, 1):uint()
        local left = math.min(run - 1, ends - at - 1)
        for more = 1, left do
            plain_bytes[#plain_bytes + 1] = tvb(at + more, 1):uint()
        end
        if #plain_bytes > MOST then
            return nil, "oversized"
        elseif left < run - 1 then
            return nil, "truncated"
        end
        at = at + run
        if at < ends and run < 255 then
            plain_bytes[#plain_bytes + 1] = 0
        end
    end
    if #plain_bytes > MOST then
        return nil, "oversized"
    elseif #plain_bytes < HEADER + CHECK then
        return nil, "short"
    end
    local array = ByteArray.new()
    array:set_size(#plain_bytes)
    for number, byte in ipairs(plain_bytes) do
        array:set_index(number - 1, byte)
    end
    return array:tvb("Frame without COBS")
end

local function header(tvb, tree, pinfo)
    local first, second = tvb(0, 2):le_uint(), tvb(2, 2):le_uint()
    local sender, destination = first % 4096, second % 4096
    local version, flags = math.floor(first / 4096), math.floor(second / 4096)
    if version ~= 1 or flags ~= 0 and flags ~= 1 and flags ~= 3 then
        refuse("version")
    end
    if flags > 0 and tvb:len() < HEADER + TAG + CHECK then
        refuse("short")
    end
    tree:add(head.version, tvb(1, 1), version)
    tree:add(head.sender, tvb(0, 2), sender)
    tree:add(head.flags, tvb(3, 1), flags)
    tree:add(head.destination, tvb(2, 2), destination)
    tree:add_le(head.network, tvb(4, 2))
    tree:add_le(head.counter, tvb(6, 4))
    pinfo.cols.src = tostring(sender)
    pinfo.cols.dst = tostring(destination)
    return flags
end

local function open(tvb, tree, pinfo)
    local ends = tvb:len() - CHECK
    local crc = tree:add_le(head.crc, tvb(ends, CHECK))
    local is = crc32c(tvb, ends)
    if tvb(ends, CHECK):le_uint() ~= is then
        crc:append_text(string.format(", but its bytes give 0x%08x", is))
        refuse("crc")
    end
    local flags = header(tvb, tree, pinfo)
    if flags > 0 then
        ends = ends - TAG
        tree:add(head.tag, tvb(ends, TAG))
    end
    local body = { tvb = tvb, at = HEADER, ends = ends }
    local message = handshake
    if flags < 2 then
        local tag = bytes(body, 1):uint()
        message = messages[tag] or refuse("unknown_tag")
    end
    tree:add(head.message, tvb(HEADER, flags < 2 and 1 or 0), message.name)
    pinfo.cols.info:append(message.name .. " ")
    local branch = tree:add(tvb(HEADER, ends - HEADER), message.name)
    for _, field in ipairs(message.fields) do
        read(branch, field, body)
    end
    if body.at < body.ends then
        refuse("malformed")
    end
end

-- The frame in a piece of a packet.
local function frame(tvb, from, ends, is_ended, tree, pinfo)
    local range = tvb(from, ends - from + (is_ended and 1 or 0))
    local branch = tree:add(proto, range)
    local without, why = unstuffed(tvb, from, ends, is_ended)
    if without then
        local opened, failure = pcall(open, without, branch, pinfo)
        if not opened then
            why = type(failure) == "table" and failure.why or error(failure, 0)
        end
    end
    if why then
        branch:add(head.refused, range, why)
        branch:add_proto_expert_info(wrong, "The frame is refused: " .. why)
        pinfo.cols.info:append("[refused: " .. why .. "] ")
    end
end

function proto.dissector(tvb, pinfo, tree)
    pinfo.cols.protocol = "UAV relay"
    pinfo.cols.info = ""
    local from = 0
    for at = 0, tvb:len() - 1 do
        if tvb(at, 1):uint() == 0 then
            if at > from then
                frame(tvb, from, at, true, tree, pinfo)
            end
            from = at + 1
        end
    end
    if from < tvb:len() then
        frame(tvb, from, tvb:len(), false, tree, pinfo)
    end
end

DissectorTable.get("wtap_encap"):add(wtap.USER0, proto)
