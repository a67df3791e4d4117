//! Screen of a station that stands: five snapshots a second of the relays' reports.

use std::net::SocketAddr;
use std::sync::mpsc::Receiver;

use serde_json::json;
use uav_relay::flight::axis::Axis;
use uav_relay::{Duration, Ground, GuardConfig, Instant, Mission, Report, Upload};
use uav_relay_linux::log::Log;
use uav_relay_screen::chain::Chain;
use uav_relay_screen::station::{Frames, StationView};
use uav_relay_screen::{Post, Screen};

use crate::desk::state;
use crate::options::Plan;
use crate::terrain::Elevation;
use crate::tiles;
use crate::uploading::{Uploading, name_of};

/// Time between two updates of the page.
const PERIOD: Duration = Duration::from_millis(200);

/// Time between two requests for the mission that the chain flies, while the station does not know it.
const ASK_AGAIN: Duration = Duration::from_millis(10_000);

/// Page of the station for browsers: its server, and the state of the chain that it shows.
pub(crate) struct Web {
    screen: Screen,
    view: StationView,
    /// Reports received since the last snapshot.
    arrived: Vec<Report>,
    /// Uploaded mission that the chain flies. `None` if the chain flies the mission loaded before flight.
    ///
    /// It is also `None` if the values of the flown mission are unknown.
    flown: Option<Upload>,
    /// Elevation model of the ground below the chain. `None` if the configuration file names none.
    ///
    /// It is also `None` if the elevation model cannot be read.
    elevation: Option<Elevation>,
    next_at: Instant,
    ask_at: Instant,
}

impl Web {
    /// Starts the server of the page, logs its address, and requests the relays' reports.
    ///
    /// Returns the page, and the channel from which the page's tasks (previews and uploads) are received.
    ///
    /// # Errors
    /// One line that names the option, its value and the fault.
    pub(crate) fn start(
        address: SocketAddr,
        now: Instant,
        log: &Log,
        plan: &Plan,
        ground: &mut Ground,
    ) -> Result<(Self, Receiver<Post>), String> {
        let tiles = plan.options.tiles.as_deref().map(tiles::open).transpose()?;
        let (screen, posts) = Screen::start_acting(address, plan.web_password.clone(), tiles)
            .map_err(|error| format!("--web {address}: {error}"))?;
        let who = match (plan.web_password.is_some(), screen.is_public()) {
            (true, false) => "; the page asks for the password",
            (true, true) => {
                "; other computers can reach it, too: the browser asks for the password, and sends it without encryption"
            }
            _ => "; every user of this computer can use it",
        };
        let url = screen.url();
        let what = format_args!("open {url} in a browser{who}");
        log.event(now, "screen", json!({ "url": url }), what);
        ground.watch(now, true);
        let elevation = plan.terrain.as_ref().and_then(|spec| {
            let loaded = Elevation::load(spec);
            let why = |error| log.line(now, "terrain", format!("not shown: {error}"));
            loaded.map_err(why).ok()
        });
        let web = Self {
            screen,
            view: StationView::default(),
            arrived: Vec::new(),
            flown: None,
            elevation,
            next_at: now,
            ask_at: now,
        };
        Ok((web, posts))
    }

    /// Removes a lost relay from the page, until the relay reports again.
    ///
    /// # Errors
    /// The reason if the relay is not lost.
    pub(crate) fn clear(&mut self, now: Instant, relay: u16) -> Result<(), String> {
        self.view.clear(now, relay, &self.arrived)
    }

    /// Stores reports that the station has received, for the next snapshot.
    pub(crate) fn take(&mut self, reports: &[Report]) {
        self.arrived.extend(reports);
    }

    /// Shows a new snapshot on the page if one is due, without waiting for a browser.
    ///
    /// Returns the time of the next snapshot.
    pub(crate) fn turn(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        ground: &mut Ground,
        uploading: Option<&Uploading>,
    ) -> Instant {
        if now < self.next_at {
            return self.next_at;
        }
        self.next_at = now + PERIOD;
        let version = self.view.version().unwrap_or(0);
        let own = uploading.filter(|it| it.is_adopted());
        let own = own.and_then(Uploading::upload);
        let answered = ground.flown().and_then(|flown| flown.upload.as_ref());
        let mut uploads = answered.into_iter().chain(own).chain(self.flown.as_ref());
        let upload = uploads.find(|it| it.version() == version).copied();
        self.flown = upload;
        let is_known = version == 0 || upload.is_some();
        // A question would end an upload.
        if !is_known && self.ask_at <= now && uploading.is_none_or(Uploading::is_idle) {
            self.ask_at = now + ASK_AGAIN;
            ground.request_flown(now);
        }
        let loaded = &plan.loaded.mission;
        let flown = upload.and_then(|it| Mission::try_new(*it.config()).ok());
        let own_sites = upload.as_ref().and_then(Upload::sites);
        let sites = own_sites.or(plan.sited).filter(|_| is_known);
        let axis = sites.and_then(|sites| Axis::between(sites).ok());
        // The relays' geofence is that of the mission loaded before flight, on the line of that mission.
        let is_same_line = is_known && own_sites.is_none();
        let chain = Chain {
            mission: if version == 0 {
                Some(loaded)
            } else {
                flown.as_ref()
            },
            end: plan.end,
            relays: loaded.relays(),
            flying: plan.options.flying,
            profiles: &plan.loaded.profiles,
            is_estimated: false,
            axis: axis.as_ref(),
            geofence: is_same_line
                .then(|| GuardConfig::of(loaded, loaded.config().common).geofence),
        };
        let stats = ground.stats();
        let frames = Frames {
            received: stats.received.saturating_add(stats.handshakes),
            rejected: ground.refused(),
        };
        self.view.overhear(now, ground.poll_overheard());
        let arrived = std::mem::take(&mut self.arrived);
        let mut snapshot = self.view.snapshot(now, &chain, &arrived, frames);
        let shown = is_known.then(|| name_of(version, upload.as_ref()));
        if let (Some(elevation), Some(sites)) = (&mut self.elevation, sites) {
            let along = elevation.along(sites).unwrap_or_else(|error| {
                log.line(now, "terrain", format!("not shown: {error}"));
                None
            });
            snapshot.ground = along;
        }
        let reports: Vec<_> = self.view.reports().collect();
        snapshot.desk = Some(state(plan, shown.as_deref(), &reports, uploading));
        self.screen.show(snapshot);
        self.next_at
    }
}
