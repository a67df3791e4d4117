//! Bundles of a flight on Linux computers: one folder for each drone, and one for the ground station.

use std::fmt::Write as _;
use std::fs::{File, OpenOptions, Permissions};
use std::io::Write as _;
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
use std::path::Path;

use toml_edit::{DocumentMut, Item, Table, TableLike, value};
use uav_relay::{GuardConfig, Mission, Placement, Profile};
use uav_relay_scenario::Line;
use uav_relay_scenario::deployment::Deployment;
use uav_relay_scenario::fleet::FleetSize;

use crate::plan::terrain_flight::{Flight, ROOM};

/// Text in a udev rule that the operator replaces with the serial number of an adapter.
pub const FILL_IN: &str = "FILL-IN-SERIAL-NUMBER";

/// Start of the port names in `/dev` that the udev rules of a bundle create.
const LINK: &str = "uav-relay-";

const RELAY_UNIT: &str = include_str!("../../../../examples/linux_companion/uav-relay@.service");

/// Folders in which the systemd units of relay and ground station may write.
const WRITABLE: [&str; 2] = ["/var/lib/uav-relay", "/run/uav-relay"];

/// Largest MAVLink system number of a drone. Ground stations have the next numbers.
const MAX_SYSTEM: u16 = 250;

/// Largest lateral distance from the chain at which a drone takes off, m.
pub const ASIDE_M: f64 = 50.0;

/// Largest radius and altitude of ArduCopter's fences, m.
const FENCE_RADIUS_M: f64 = 10_000.0;
const FENCE_ALT_M: f64 = 1_000.0;

/// PX4 type of an integer parameter, `MAV_PARAM_TYPE_INT32`.
const INT: u8 = 6;

/// PX4 type of a parameter with decimals, `MAV_PARAM_TYPE_REAL32`.
const FLOAT: u8 = 9;

/// Data of the flight for which a bundle (folders of the drones and of the ground station) is made.
#[derive(Debug)]
pub struct Bundle<'a> {
    /// Text of the scenario file, with a plan if the positions of the relays are known.
    pub text: String,
    /// Sections `[network]`, `[fleet]`, `[companion]` and `[ground]` of the scenario file.
    pub deployment: &'a Deployment,
    /// Numbers of relays in the fleet and in the chain.
    pub fleet: FleetSize,
    /// Network number of the relays.
    pub network: u16,
    /// Placement method of the relays.
    pub method: &'a str,
    /// Mission that the relays load.
    pub mission: &'a Mission,
    /// Profiles (power, altitude) that differ from the mission's common profile, by relay index.
    pub profiles: &'a [(u16, Profile)],
    /// Positions that the relays of the first chain will agree on; empty if unknown.
    pub places: &'a [(Placement, Profile)],
    /// Simulated flight over the terrain; `None` without terrain.
    pub simulated: Option<&'a Flight>,
    /// Lowest and highest ground, m above the sea; `None` without terrain.
    ///
    /// It is the ground up to [`ASIDE_M`] beside the chain. The highest value includes the smallest permitted height of
    /// relays above the ground.
    pub ground_m: Option<[f64; 2]>,
    /// Line from Tx to Rx.
    pub line: &'a Line,
    /// Key of the network.
    pub key: [u8; 32],
    /// Signing key of the autopilots; `None` for unsigned messages.
    pub autopilot_key: Option<[u8; 32]>,
}

/// File of a bundle (folders of a flight): name, permission bits, content.
type Content = (&'static str, u32, String);

/// Autopilot parameter: name, type and value in PX4; name and value in ArduCopter. Each may be absent.
type Parameter = (Option<(&'static str, u8, f64)>, Option<(&'static str, f64)>);

impl Bundle<'_> {
    /// Writes the folders of the relays `relays` and of the ground station into the new folder `dir`.
    ///
    /// All files are first written into a temporary folder beside `dir`, which is renamed at the end.
    ///
    /// # Errors
    /// A text that names the folder or file and the reason. `dir` then does not exist.
    pub fn write(&self, dir: &Path, relays: &[u16]) -> Result<(), String> {
        let named = |at: &Path, error: &dyn std::fmt::Display| {
            format!("--bundle {}: {error}", at.display())
        };
        if dir.symlink_metadata().is_ok() {
            return Err(named(
                dir,
                &"exists already, and a bundle is never overwritten: name another folder, or remove this one",
            ));
        }
        let parent = dir.parent().filter(|it| !it.as_os_str().is_empty());
        let parent = parent.unwrap_or(Path::new("."));
        let staged = tempfile::Builder::new()
            .prefix(".bundle")
            .tempdir_in(parent)
            .map_err(|error| named(parent, &error))?;
        let ground = (
            "ground".to_owned(),
            self.ground().map_err(|e| named(dir, &e))?,
        );
        let mut folders = vec![ground];
        for index in relays {
            let files = self.relay(*index).map_err(|error| named(dir, &error))?;
            folders.push((format!("relay{index}"), files));
        }
        for (name, files) in folders {
            let folder = staged.path().join(&name);
            std::fs::create_dir(&folder).map_err(|error| named(&dir.join(&name), &error))?;
            for (file, mode, content) in files {
                write(&folder.join(file), mode, &content)
                    .map_err(|error| named(&dir.join(&name).join(file), &error))?;
            }
            sync(&folder).map_err(|error| named(&dir.join(&name), &error))?;
        }
        // Other users of this computer can see the names of the files, but cannot read the keys.
        std::fs::set_permissions(staged.path(), Permissions::from_mode(0o755))
            .and_then(|()| sync(staged.path()))
            .and_then(|()| std::fs::rename(staged.path(), dir))
            .and_then(|()| sync(parent))
            .map_err(|error| named(dir, &error))
    }

    fn key_files(&self) -> impl Iterator<Item = Content> {
        let hex = |key: [u8; 32]| {
            key.iter()
                .fold(String::new(), |hex, byte| hex + &format!("{byte:02x}"))
        };
        let autopilot = self
            .autopilot_key
            .map(|key| ("autopilot.key", 0o600, hex(key)));
        std::iter::once(("network.key", 0o600, hex(self.key))).chain(autopilot)
    }

    /// Returns the files of relay `index`.
    fn relay(&self, index: u16) -> Result<Vec<Content>, String> {
        if index > MAX_SYSTEM {
            return Err(format!(
                "relay {index}: the MAVLink system number of a drone is at most {MAX_SYSTEM}"
            ));
        }
        let own = &self.deployment.companion;
        let mut file = self.document()?;
        _ = file.remove("ground");
        let section = section(&mut file, "companion")?;
        written_files(section, "companion", &["log_file", "capture"])?;
        absolute(section, "companion", &["positions"])?;
        section.insert("index", value(i64::from(index)));
        if self.deployment.fleet.flying.is_some() {
            section.insert("spare", value(self.fleet.rank(index).is_none()));
        }
        let mut ports = vec!["shared"];
        if own.upstream.is_some() || own.downstream.is_some() {
            ports = vec!["upstream", "downstream"];
        }
        // At an end of the chain one port leads to the ground station, or nowhere.
        let at_rx = self.deployment.ground.end.as_deref() == Some("rx");
        let ends = [
            ("upstream", index == 1 && at_rx),
            ("downstream", index == self.fleet.relays && !at_rx),
        ];
        for (port, is_missing) in ends {
            if is_missing && ports.contains(&port) {
                ports.retain(|other| *other != port);
                _ = section.remove(port);
            }
        }
        for port in &ports {
            default(section, port, &format!("/dev/{LINK}{port}"));
        }
        for (key, name) in [
            ("epoch_file", "epoch"),
            ("upload_file", "mission"),
            ("view_file", "views"),
        ] {
            state_file(section, key, name);
        }
        if own.positions.is_none() {
            default(section, "autopilot", "/dev/ttyAMA0");
        }
        if self.autopilot_key.is_some() {
            section.insert("autopilot_key_file", value("autopilot.key"));
        }
        let unit = RELAY_UNIT
            .split_once("\n\n")
            .map_or(RELAY_UNIT, |(_, unit)| unit)
            .replace(" --index %i", "")
            .replace("Relay %i of", &format!("Relay {index} of"))
            .replace("uav-relay@%i", "uav-relay");
        let parameters = self.parameters(index)?;
        let mut px4 = "# Vehicle-Id\tComponent-Id\tName\tValue\tType\n".to_owned();
        let mut ardupilot = String::new();
        for (of_px4, of_ardupilot) in parameters {
            if let Some((name, kind, value)) = of_px4 {
                _ = writeln!(px4, "{index}\t1\t{name}\t{value}\t{kind}");
            }
            if let Some((name, value)) = of_ardupilot {
                _ = writeln!(ardupilot, "{name},{value}");
            }
        }
        let rules = rules(section, &ports)?;
        let mut files = vec![
            ("drone.toml", 0o644, file.to_string()),
            ("uav-relay.service", 0o644, unit),
            ("70-uav-relay.rules", 0o644, rules),
            ("px4.params", 0o644, px4),
            ("ardupilot.parm", 0o644, ardupilot),
            ("page.txt", 0o644, self.page(index)),
            (
                "install.sh",
                0o755,
                install("linux_companion", "drone.toml", "uav-relay"),
            ),
        ];
        files.extend(self.key_files());
        Ok(files)
    }

    /// Returns the files of the ground station.
    fn ground(&self) -> Result<Vec<Content>, String> {
        let own = &self.deployment.companion;
        let is_shared = own.upstream.is_none() && own.downstream.is_none();
        let mut file = self.document()?;
        _ = file.remove("companion");
        let section = section(&mut file, "ground")?;
        written_files(section, "ground", &["log_file", "capture"])?;
        absolute(section, "ground", &["web_password"])?;
        let is_file = |it: &&String| !it.starts_with("udp:");
        if self
            .deployment
            .ground
            .measurements
            .iter()
            .any(|it| is_file(&it))
        {
            absolute(section, "ground", &["measurements"])?;
        }
        default(section, "tty", &format!("/dev/{LINK}shared"));
        default(section, "end", "tx");
        state_file(section, "epoch_file", "epoch");
        if !section.contains_key("shared") {
            section.insert("shared", value(is_shared));
        }
        let unit = RELAY_UNIT
            .split_once("\n\n")
            .map_or(RELAY_UNIT, |(_, unit)| unit)
            .replace("Relay %i of a chain", "Ground station of a chain")
            .replace(
                "linux_companion --config /etc/uav-relay/drone.toml --index %i",
                "linux_ground --config /etc/uav-relay/ground.toml --stand",
            )
            .replace("uav-relay@%i", "uav-relay-ground");
        let rules = rules(section, &["tty"])?;
        let mut page = self.heading("ground station");
        page.push_str(
            "Before flight, while the relays run:\n\
             [ ] serial number of the radio in 70-uav-relay.rules, then: sudo sh install.sh\n\
             [ ] sudo systemctl stop uav-relay-ground; sudo -u uav-relay linux_ground --check --config /etc/uav-relay/ground.toml\n\
             [ ] all relays green, then: sudo systemctl start uav-relay-ground\n",
        );
        let mut files = vec![
            ("ground.toml", 0o644, file.to_string()),
            ("uav-relay-ground.service", 0o644, unit),
            ("70-uav-relay.rules", 0o644, rules),
            ("page.txt", 0o644, page),
            (
                "install.sh",
                0o755,
                install("linux_ground", "ground.toml", "uav-relay-ground"),
            ),
        ];
        files.extend(self.key_files().take(1));
        Ok(files)
    }

    /// Returns the scenario file with the section `[network]` of this flight, and without terrain.
    fn document(&self) -> Result<DocumentMut, String> {
        let mut file: DocumentMut = self
            .text
            .parse()
            .map_err(|error: toml_edit::TomlError| error.message().to_owned())?;
        // Only the planner reads elevation files and no-fly areas. Their files are not in the bundle.
        for section in ["terrain", "no_fly"] {
            _ = file.remove(section);
        }
        let network = section(&mut file, "network")?;
        network.insert("id", value(i64::from(self.network)));
        network.insert("relays", value(i64::from(self.fleet.relays)));
        network.insert("method", value(self.method));
        network.insert("key_file", value("network.key"));
        Ok(file)
    }

    /// Returns the geofence of relay `index`, as its guard (collision avoidance) uses it.
    fn fence(&self, index: u16) -> uav_relay::Geofence {
        let own = self.profiles.iter().find(|(of, _)| *of == index);
        let profile = own.map_or(self.mission.config().common, |(_, profile)| *profile);
        GuardConfig::of(self.mission, profile).geofence
    }

    /// Returns the altitude above home at which relay `index` returns to launch, m.
    ///
    /// The altitudes of any two drones differ, because returning drones cross each other's paths. All are above the
    /// chain and, if there is a terrain, above the ground between Tx and Rx.
    fn return_m(&self, index: u16) -> f64 {
        let [tx, rx] = self.line.sites.map(|site| f64::from(site.amsl_mm) / 1e3);
        let highest = (1..=self.fleet.relays).map(|of| f64::from(self.fence(of).most_altitude_m));
        // A fence altitude is above the line from Tx to Rx. An autopilot's altitude is above its home.
        let highest_m = tx.max(rx) + highest.fold(20.0, f64::max);
        let [low, high] = self.ground_m.unwrap_or([f64::INFINITY, f64::NEG_INFINITY]);
        let top_m = highest_m.max(high) - tx.min(rx).min(low);
        let separation_m = f64::from(self.mission.config().min_separation_m);
        let step_m = (separation_m + 2.0).max(6.0).ceil();
        (top_m + 10.0).ceil() + step_m * f64::from(index - 1)
    }

    /// Returns the parameters that the autopilot of relay `index` needs.
    ///
    /// # Errors
    /// A text if the flight needs a higher geofence than ArduCopter permits.
    fn parameters(&self, index: u16) -> Result<Vec<Parameter>, String> {
        let config = self.mission.config();
        let fence = self.fence(index);
        let return_m = |index: u16| self.return_m(index);
        let wide_m = f64::from(fence.most_y_m.max(-fence.least_y_m));
        // Drones take off near the chain, so that this radius contains the flight.
        let radius_m = (f64::from(config.distance_m) + wide_m + 200.0).ceil();
        let radius_m = radius_m.min(FENCE_RADIUS_M);
        let ceiling_m = return_m(self.fleet.relays) + 20.0;
        if ceiling_m > FENCE_ALT_M {
            let over = self.ground_m.map_or(String::new(), |[low, high]| {
                format!(" and above the ground, {low:.1} to {high:.1} m above the sea,")
            });
            return Err(format!(
                "FENCE_ALT_MAX would be {ceiling_m} m: {} drones that return above each other, above the chain{over} need a fence above {FENCE_ALT_M} m, which ArduCopter does not have",
                self.fleet.relays
            ));
        }
        let baud = self.deployment.companion.autopilot_baud.unwrap_or(115_200);
        let (own, baud) = (f64::from(index), f64::from(baud));
        let px4 = |name, kind, value| (Some((name, kind, value)), None);
        let ardupilot = |name, value| (None, Some((name, value)));
        Ok(vec![
            (Some(("MAV_SYS_ID", INT, own)), Some(("SYSID_THISMAV", own))),
            // Names from ArduCopter 4.7 on. An autopilot knows either the old or the new names.
            ardupilot("MAV_SYSID", own),
            ardupilot("RTL_ALT_M", return_m(index)),
            // TELEM 2, messages for an onboard computer.
            px4("MAV_1_CONFIG", INT, 102.0),
            px4("MAV_1_MODE", INT, 2.0),
            (
                Some(("SER_TEL2_BAUD", INT, baud)),
                Some(("SERIAL2_BAUD", (baud / 1e3).floor())),
            ),
            ardupilot("SERIAL2_PROTOCOL", 2.0),
            ardupilot("BRD_SER2_RTSCTS", 0.0),
            // The autopilot holds when the companion is silent for 1 s. Loss of the remote control is no failure in
            // OFFBOARD.
            px4("COM_OF_LOSS_T", FLOAT, 1.0),
            px4("COM_OBL_RC_ACT", INT, 5.0),
            px4("COM_RCL_EXCEPT", INT, 4.0),
            (
                Some(("RTL_RETURN_ALT", FLOAT, return_m(index))),
                Some(("RTL_ALT", 100.0 * return_m(index))),
            ),
            // A drone under the companion's control continues without its remote control. The 16 is ArduCopter's
            // default.
            ardupilot("FS_OPTIONS", 20.0),
            // A drone also climbs to its return altitude near home.
            px4("RTL_CONE_ANG", INT, 0.0),
            ardupilot("RTL_CONE_SLOPE", 0.0),
            // At the fence the autopilot holds, or brakes. The fence is around home, and contains the flight.
            (Some(("GF_ACTION", INT, 2.0)), Some(("FENCE_ACTION", 4.0))),
            ardupilot("FENCE_ENABLE", 1.0),
            ardupilot("FENCE_TYPE", 3.0),
            (
                Some(("GF_MAX_HOR_DIST", FLOAT, radius_m)),
                Some(("FENCE_RADIUS", radius_m)),
            ),
            (
                Some(("GF_MAX_VER_DIST", FLOAT, ceiling_m)),
                Some(("FENCE_ALT_MAX", ceiling_m)),
            ),
        ])
    }

    fn heading(&self, who: &str) -> String {
        let FleetSize { relays, flying } = self.fleet;
        let (network, digest) = (self.network, self.mission.digest());
        let what = if flying < relays {
            format!("chain of {flying} of {relays} relays")
        } else {
            format!("chain of {relays} relays")
        };
        format!("{who}, {what}, network {network}, mission 0x{digest:04x}\n\n")
    }

    /// Returns the page to print for relay `index`.
    fn page(&self, index: u16) -> String {
        let mut page = self.heading(&format!("RELAY {index}"));
        let fence = self.fence(index);
        let rank = self.fleet.rank(index);
        let place = rank.and_then(|rank| self.places.get(rank));
        let place = place.map(|(place, _)| *place);
        match place {
            None if rank.is_none() => page.push_str(
                "place: spare, which waits beside the line, at least the minimum separation from all relays, until the leader calls it\n",
            ),
            None => page.push_str("place: the relays find it in flight\n"),
            Some(at) => {
                let Placement {
                    x_m,
                    y_m,
                    altitude_m,
                } = at;
                _ = writeln!(
                    page,
                    "place: x {x_m:.1} m, y {y_m:.1} m, altitude {altitude_m:.1} m above the line from Tx to Rx"
                );
                if let Some(point) = self.line.axis.point(at) {
                    let [lat, lon] = [point.lat_e7, point.lon_e7].map(|part| f64::from(part) / 1e7);
                    let amsl = f64::from(point.amsl_mm) / 1e3;
                    _ = writeln!(
                        page,
                        "       {lat:.7}, {lon:.7}, {amsl:.1} m above the mean sea level"
                    );
                }
            }
        }
        _ = writeln!(
            page,
            "limits of the mission: x {:.0} to {:.0} m, y {:.0} to {:.0} m, altitude {:.1} to {:.1} m above the line from Tx to Rx; these limits consider neither the ground nor no-fly areas",
            fence.least_x_m,
            fence.most_x_m,
            fence.least_y_m,
            fence.most_y_m,
            fence.least_altitude_m,
            fence.most_altitude_m
        );
        if let Some(flight) = self.simulated {
            // The simulation numbers the relays of the chain without the spares.
            if let Some(number) = rank.and_then(|it| u16::try_from(it + 1).ok()) {
                let room = flight.room(number);
                _ = writeln!(page, "room over the terrain: {room}\n{ROOM}");
            }
            for line in flight.warnings() {
                _ = writeln!(page, "warning: {line}");
            }
        }
        if let Some([low, high]) = self.ground_m {
            _ = writeln!(
                page,
                "return to launch: {:.0} m above home, at least 10 m above the ground and the chain, if home is at most {ASIDE_M:.0} m beside the chain; lowest and highest ground on these ways home: {low:.1} and {high:.1} m above the mean sea level",
                self.return_m(index)
            );
        }
        let before = self.fleet.first().take_while(|it| *it < index).last();
        let after = self.fleet.first().find(|it| *it > index);
        let named = |relay: Option<u16>, end: &str| {
            relay.map_or_else(|| end.to_owned(), |it| format!("relay {it}"))
        };
        let is_spare = self.fleet.rank(index).is_none();
        _ = writeln!(
            page,
            "{}: {} and {}\n",
            if is_spare {
                "joins between"
            } else {
                "neighbours"
            },
            named(before, "the transmitter"),
            named(after, "the receiver")
        );
        let place = if is_spare {
            "flown by hand to a place beside the line, clear of all relays by at least the minimum separation; it waits there until it is called"
        } else {
            "flown by hand to its place in the order along the line, between its neighbours"
        };
        let (more, parameters) = match self.deployment.companion.positions {
            Some(_) => (" --no-autopilot", ""),
            None => (
                "",
                "[ ] px4.params or ardupilot.parm loaded into the autopilot, which is then restarted\n",
            ),
        };
        _ = write!(
            page,
            "Before flight, propellers off:\n\
             [ ] serial numbers of the adapters in 70-uav-relay.rules, then: sudo sh install.sh\n\
             {parameters}\
             [ ] sudo systemctl stop uav-relay; sudo rm -f /var/lib/uav-relay/views /var/lib/uav-relay/mission\n\
             [ ] sudo -u uav-relay linux_companion --check{more} --config /etc/uav-relay/drone.toml\n\
             [ ] all lines green, then: sudo systemctl start uav-relay\n\
             In the air:\n\
             [ ] {place}\n\
             [ ] OFFBOARD or GUIDED chosen after the log line `ready`; any other mode takes the drone back\n"
        );
        page
    }
}

/// Returns the section `name` of a file. Adds a missing section.
fn section<'a>(file: &'a mut DocumentMut, name: &str) -> Result<&'a mut dyn TableLike, String> {
    let new = || Item::Table(Table::new());
    let item = file.entry(name).or_insert_with(new);
    // The scenario has been read before, so that its sections are tables.
    item.as_table_like_mut()
        .ok_or_else(|| format!("{name} is not a section"))
}

fn default(section: &mut dyn TableLike, key: &str, text: &str) {
    if !section.contains_key(key) {
        section.insert(key, value(text));
    }
}

/// Moves the relative paths of `keys` into the folder that the systemd unit may write to.
///
/// The keys name files that the program writes. A key that is missing is not added.
///
/// # Errors
/// An absolute path is in another folder.
fn written_files(section: &mut dyn TableLike, name: &str, keys: &[&str]) -> Result<(), String> {
    for key in keys {
        let Some(given) = section
            .get(key)
            .and_then(Item::as_str)
            .map(ToOwned::to_owned)
        else {
            continue;
        };
        state_file(section, key, &given);
        let path = section.get(key).and_then(Item::as_str).map(Path::new);
        let may_write = |path: &Path| WRITABLE.iter().any(|folder| path.starts_with(folder));
        if !path.is_some_and(may_write) {
            return Err(format!(
                "{name}.{key} = {given:?}: the systemd unit may write only in {}",
                WRITABLE.join(" and ")
            ));
        }
    }
    Ok(())
}

/// Rejects relative paths of files that are not in the bundle.
///
/// # Errors
/// The key and its path.
fn absolute(section: &dyn TableLike, name: &str, keys: &[&str]) -> Result<(), String> {
    for key in keys {
        let given = section.get(key).and_then(Item::as_str);
        if let Some(given) = given.filter(|path| !Path::new(path).is_absolute()) {
            return Err(format!(
                "{name}.{key} = {given:?}: this file is not in the bundle: give its absolute path (from /) on the computer where the bundle is installed"
            ));
        }
    }
    Ok(())
}

/// Moves a relative path into the folder that the systemd unit may write to.
fn state_file(section: &mut dyn TableLike, key: &str, name: &str) {
    let given = section.get(key).and_then(Item::as_str).unwrap_or(name);
    let path = Path::new("/var/lib/uav-relay").join(given);
    section.insert(key, value(path.display().to_string()));
}

/// Returns the udev rules for those of `ports` whose names begin with [`LINK`]. Other ports need none.
///
/// # Errors
/// A port name has characters other than letters, digits, `.`, `_` and `-`: in a rule they could form a command.
fn rules(section: &dyn TableLike, ports: &[&str]) -> Result<String, String> {
    let paths = ports.iter().filter_map(|port| section.get(port)?.as_str());
    let links: Vec<&str> = paths
        .filter_map(|path| path.strip_prefix("/dev/"))
        .collect();
    let mut rules = format!(
        "# Names of the adapters. Replace {FILL_IN}; this command prints it, for the adapter at /dev/ttyUSB0:\n\
         # udevadm info --query=property --name=/dev/ttyUSB0 | grep ID_SERIAL_SHORT\n\
         # Adapters without a serial number of their own: match ENV{{ID_PATH}}, the USB socket, in its place.\n"
    );
    for link in links.iter().filter(|link| link.starts_with(LINK)) {
        let is_name = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
        if !link.bytes().all(is_name) {
            return Err(format!(
                "port /dev/{link}: allowed are letters, digits, '.', '_' and '-'"
            ));
        }
        _ = writeln!(
            rules,
            "SUBSYSTEM==\"tty\", ENV{{ID_SERIAL_SHORT}}==\"{FILL_IN}\", SYMLINK+=\"{link}\""
        );
    }
    Ok(rules)
}

/// Returns the script that installs `program`, its `config` and its unit on the computer.
fn install(program: &str, config: &str, unit: &str) -> String {
    format!(
        "#!/bin/sh\n\
         # Installs this folder; {program} is already in /usr/local/bin. Type: sudo sh install.sh\n\
         set -e\n\
         cd \"$(dirname \"$0\")\"\n\
         if grep -Hn '^[^#].*{FILL_IN}' *.rules; then echo \"replace {FILL_IN} first: see the comments there\"; exit 1; fi\n\
         test -x /usr/local/bin/{program} || {{ echo \"/usr/local/bin/{program} is missing\"; exit 1; }}\n\
         id uav-relay > /dev/null 2>&1 || useradd --system --groups dialout uav-relay\n\
         install -d -m 755 /etc/uav-relay\n\
         install -d -m 700 -o uav-relay /var/lib/uav-relay\n\
         install -m 640 -g uav-relay *.key /etc/uav-relay/\n\
         install -m 644 {config} *.rules *.txt $(ls *.params *.parm 2> /dev/null) /etc/uav-relay/\n\
         install -m 644 *.rules /etc/udev/rules.d/\n\
         install -m 644 {unit}.service /etc/systemd/system/\n\
         udevadm control --reload && udevadm trigger --subsystem-match=tty\n\
         systemctl daemon-reload\n\
         systemctl enable {unit}\n"
    )
}

fn write(file: &Path, mode: u32, content: &str) -> std::io::Result<()> {
    let mut options = OpenOptions::new();
    let mut new = options.write(true).create_new(true).mode(mode).open(file)?;
    new.write_all(content.as_bytes())?;
    new.sync_all()
}

fn sync(folder: &Path) -> std::io::Result<()> {
    File::open(folder)?.sync_all()
}
