"""pymavlink as the autopilot of a drone, an ArduCopter or a PX4, on a pseudo-terminal or a UDP port.

    autopilot.py arducopter|px4 LINK LAT LON AMSL [KEY]

LINK becomes a symbolic link to the tty, or is `udp:PORT@PARTNER`: a UDP port of this computer, used as a PX4 uses its own. It receives from
anybody. It sends to port PARTNER of this computer until it receives a first datagram, and from then on to the sender of that one, address and
port, until it is rebooted. With KEY, a file with 64 hexadecimal digits, it signs, and ignores what is not signed. The drone stands at LAT, LON, AMSL, on the ground. What it hears goes to standard output, a
JSON object a line, with the drone's own place and mode; standard input has an order a line:

    arm, takeoff                 armed; off the ground, and in the air a second later
    mode pilot|hold|rtl|companion
    sticks NORTH EAST            m/s, in the mode `pilot`
    refuse, accept               targets, as outside a fence: in silence
    lose, find                   its position, as without satellites
    reboot, mute, speak          begins anew on the ground; says nothing; says something
    stranger, vehicle            heartbeats of no known autopilot; of its own kind again
    battery 40 600               40 percent and 600 s are left from now on, as BATTERY_STATUS once a second (ArduCopter: if requested)
    drop 245 147                 it sends none of these messages from now on
    noise 150                    a SiK radio hears so much between frames
    clear 2                      a ground station clears relay 2: MAV_CMD_USER_1 to the companion, by way of this autopilot
    track                        from now on its place is an output line, too, 50 times a second, with this computer's time
    params FILE [4.7]            its parameters, and with them its system number; in the format of its ground station. An
                                 ArduCopter knows the names up to 4.6, or those from 4.7 on
    system 9                     another system number than that of its parameters
    param NAME [VALUE]           another value of one; without VALUE it does not know it
    unplug, plug                 the tty or the UDP port vanishes; another one is there
"""

import collections
import json
import math
import os
import pty
import select
import socket
import struct
import sys
import time
import tty

from pymavlink.dialects.v20 import common

SYSTEM, SPEED, STEP = 7, 8.0, 0.02
MODES = {
    "arducopter": {"pilot": 16, "hold": 5, "rtl": 6, "companion": 4},
    "px4": {"pilot": 3 << 16, "hold": 4 << 16 | 3 << 24, "rtl": 4 << 16 | 5 << 24, "companion": 6 << 16},
}
ON_GROUND, IN_AIR, TAKEOFF = 1, 2, 3
# SET_POSITION_TARGET_GLOBAL_INT: position is given, acceleration is not; above the mean sea level.
POSITION, ACCELERATION, AMSL = 0b111, 0b1_1100_0000, 5
DEGREE_M = 111_200.0
# Of ArduCopter's parameters.
OLD_NAMES, NEW_NAMES = ("SYSID_THISMAV", "RTL_ALT"), ("MAV_SYSID", "RTL_ALT_M")
# Where stamps of signatures begin: 2015-01-01, Unix time.
STAMPS_BEGIN = 1_420_070_400


class Tty:
    """A pseudo-terminal, and the symbolic link to it."""

    def __init__(self, link):
        self.link, self.master = link, None

    def open(self):
        self.master, self.side = pty.openpty()
        tty.setraw(self.side)
        os.set_blocking(self.master, False)
        os.symlink(os.ttyname(self.side), self.link)

    def close(self):
        os.remove(self.link)
        os.close(self.master)
        os.close(self.side)
        self.master = None

    def restart(self):
        """The autopilot restarts: a tty has nothing to forget."""

    def is_open(self):
        return self.master is not None

    def fileno(self):
        return self.master

    def read(self):
        return os.read(self.master, 4096)

    def write(self, data):
        os.write(self.master, data)

    def partner(self):
        return None


class Udp:
    """A UDP port as a PX4 uses it: the first sender is its partner, address and port, until it restarts."""

    def __init__(self, port, partner):
        self.port, self.default, self.socket = port, ("127.0.0.1", partner), None
        self.restart()

    def open(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", self.port))
        self.socket.setblocking(False)

    def close(self):
        self.socket.close()
        self.socket = None

    def restart(self):
        self.first = None

    def is_open(self):
        return self.socket is not None

    def fileno(self):
        return self.socket.fileno()

    def read(self):
        data, sender = self.socket.recvfrom(4096)
        self.first = self.first or sender
        return data

    def write(self, data):
        self.socket.sendto(data, self.partner())

    def partner(self):
        return self.first or self.default


def port_of(link):
    if not link.startswith("udp:"):
        return Tty(link)
    port, partner = link.removeprefix("udp:").split("@")
    return Udp(int(port), int(partner))


class Drone:
    def __init__(self, kind, link, at, key):
        self.kind, self.home, self.key = kind, at, key
        self.at, self.sticks, self.silent, self.refuses = list(at), (0.0, 0.0), False, False
        self.is_stranger = self.is_tracked = self.is_lost = False
        self.system, self.parameters = SYSTEM, {}
        self.battery, self.dropped = None, set()
        self.port = port_of(link)
        self.start()
        self.plug()

    def start(self):
        self.port.restart()
        self.began = time.monotonic()
        self.armed, self.landed, self.mode, self.by_itself = False, ON_GROUND, "pilot", False
        self.goal, self.told_at, self.took_off_at = None, -math.inf, 0.0
        # Since when targets have come without a gap of a second, and where it holds its place.
        self.streamed_at, self.hold = -math.inf, tuple(self.at)
        # Where it has said to be, the last few seconds.
        self.said = collections.deque(maxlen=20)
        self.at[2] = self.home[2]
        # Seconds between two, and when the next is due, by number.
        self.streams = {0: [1.0, 0.0]}
        if self.kind == "px4":
            self.streams[245] = [0.2, 0.0]

    def plug(self):
        self.port.open()
        self.codec, self.reader = common.MAVLink(None, self.system, 1), common.MAVLink(None)
        self.reader.robust_parsing = True
        for end in [self.codec, self.reader] if self.key else []:
            end.signing.secret_key, end.signing.sign_outgoing = self.key, True
            self.stamp(end)

    def stamp(self, end):
        end.signing.timestamp = max(end.signing.timestamp, int((time.time() - STAMPS_BEGIN) * 1e5))

    def order(self, words):
        match words:
            case ["arm"]:
                self.armed = True
            case ["takeoff"]:
                self.landed, self.took_off_at = TAKEOFF, time.monotonic()
            case ["mode", mode]:
                # A PX4 refuses its mode to a companion that does not stream.
                if not (self.kind == "px4" and mode == "companion" and time.monotonic() - self.told_at > 1.0):
                    self.mode, self.by_itself, self.goal, self.hold = mode, False, None, tuple(self.at)
            case ["sticks", north, east]:
                self.sticks = float(north), float(east)
            case ["refuse" | "accept" as word]:
                self.refuses = word == "refuse"
            case ["lose" | "find" as word]:
                self.is_lost = word == "lose"
            case ["reboot"]:
                self.start()
            case ["mute" | "speak" as word]:
                self.silent = word == "mute"
            case ["stranger" | "vehicle" as word]:
                self.is_stranger = word == "stranger"
            case ["track"]:
                self.is_tracked = True
            case ["battery", percent, left]:
                self.battery = int(percent), int(left)
                if self.kind == "px4":
                    self.streams |= {147: [1.0, 0.0], 242: [2.0, 0.0]}
            case ["drop", *numbers]:
                self.dropped = set(map(int, numbers))
            case ["noise", noise]:
                self.noise(int(noise))
            case ["clear", *relays]:
                self.forward(relays)
            case ["system", number]:
                self.system = self.codec.srcSystem = int(number)
            case ["params", file, *version]:
                fields = [line.split("\t" if self.kind == "px4" else ",") for line in open(file) if line[0] != "#"]
                self.parameters = {line[-3 if self.kind == "px4" else 0]: float(line[-2 if self.kind == "px4" else 1]) for line in fields}
                for name in OLD_NAMES if version else NEW_NAMES:
                    self.parameters.pop(name, None)
                self.number()
            case ["param", name, *value]:
                self.parameters.pop(name, None)
                self.parameters.update({name: float(number) for number in value})
                self.number()
            case ["unplug"]:
                self.port.close()
            case ["plug"]:
                self.plug()
            case _:
                raise ValueError(words)

    def number(self):
        """It takes its own system number from its parameters."""
        names = ["MAV_SYS_ID", "MAV_SYSID", "SYSID_THISMAV"]
        self.system = int(next((self.parameters[name] for name in names if name in self.parameters), SYSTEM))
        self.codec.srcSystem = self.system

    def value(self, message):
        """The value of a parameter; a PX4 says the bytes of an integer as those of a float."""
        value = self.parameters.get(message.param_id)
        if value is None or message.target_system != self.system:
            return
        kind = 6 if self.kind == "px4" and value == int(value) and message.param_id[:6] not in ("COM_OF", "RTL_RE", "GF_MAX") else 9
        if kind == 6:
            (value,) = struct.unpack("<f", struct.pack("<i", int(value)))
        self.say(common.MAVLink_param_value_message(message.param_id.encode(), value, kind, len(self.parameters), 0))

    def forward(self, relays):
        """A command of a ground station, which the autopilot forwards to the companion as it is."""
        station = common.MAVLink(None, 255, 190)
        numbers = [float(relay) for relay in relays] + [0.0] * (7 - len(relays))
        self.port.write(common.MAVLink_command_long_message(self.system, 191, 31010, 0, *numbers).pack(station))

    def noise(self, noise):
        """What a SiK radio says on the same link: it cannot sign."""
        radio = common.MAVLink(None, ord("3"), ord("D"))
        self.port.write(common.MAVLink_radio_status_message(200, 190, 100, noise, 60, 0, 0).pack(radio))

    def step(self):
        now = time.monotonic()
        if self.is_tracked:
            print(json.dumps({"mavpackettype": "PLACE", "time_s": time.time(), "at": self.at}), flush=True)
        if self.landed == TAKEOFF:
            self.at[2] += 10.0 * STEP
            if now - self.took_off_at > 1.0:
                self.landed = IN_AIR
        if self.landed != IN_AIR:
            return
        lost = self.kind == "px4" and self.mode == "companion" and now - self.told_at > 1.0
        if lost:
            self.mode, self.by_itself, self.goal = "hold", True, None
        # It goes back to the companion by itself once that has streamed again for a while.
        streams = now - self.told_at < 1.0 and now - self.streamed_at > 1.2
        if self.kind == "px4" and self.mode == "hold" and self.by_itself and streams:
            self.mode, self.by_itself = "companion", False
        if self.mode == "companion" and self.goal:
            self.fly(self.goal)
        elif self.mode == "rtl":
            self.fly((self.home[0], self.home[1], self.at[2]))
        elif self.mode == "pilot":
            self.at[0] += self.sticks[0] * STEP / DEGREE_M
            self.at[1] += self.sticks[1] * STEP / self.east_m()

    def east_m(self):
        return DEGREE_M * math.cos(math.radians(self.at[0]))

    def fly(self, goal):
        scales = DEGREE_M, self.east_m(), 1.0
        way = [(to - at) * scale for to, at, scale in zip(goal, self.at, scales)]
        length = math.hypot(*way)
        part = min(1.0, SPEED * STEP / length) if length > 0 else 1.0
        self.at = [at + (to - at) * part for to, at in zip(goal, self.at)]

    def hear(self):
        try:
            data = self.port.read()
        except (BlockingIOError, OSError):
            return
        self.stamp(self.reader)
        for message in self.reader.parse_buffer(data) or []:
            name = message.get_type()
            # What it does not believe, too.
            if name == "BAD_DATA":
                continue
            if name == "COMMAND_LONG" and message.command == 511:
                # What it does not send, it says so of.
                has = self.has(int(message.param1))
                if has:
                    self.streams[int(message.param1)] = [message.param2 / 1e6, 0.0]
                self.say(common.MAVLink_command_ack_message(511, 0 if has else 2))
            elif name == "PARAM_REQUEST_READ":
                self.value(message)
            elif name == "TIMESYNC" and message.tc1 == 0:
                self.say(common.MAVLink_timesync_message(int(time.monotonic() * 1e9), message.ts1))
            elif name == "SET_POSITION_TARGET_GLOBAL_INT":
                self.take(message)
            fields = message.to_dict()
            fields["from"] = [message.get_srcSystem(), message.get_srcComponent()]
            fields["own"] = {"at": self.at, "mode": self.mode, "landed": self.landed, "by_itself": self.by_itself, "said": list(self.said), "partner": self.port.partner()}
            print(json.dumps(fields), flush=True)

    def take(self, message):
        is_position = message.coordinate_frame == AMSL and message.type_mask & POSITION == 0
        is_mine = (message.target_system, message.target_component) == (self.system, 1)
        if not is_position or message.type_mask & ACCELERATION != ACCELERATION or not is_mine or self.refuses:
            return
        now = time.monotonic()
        if now - self.told_at > 1.0:
            self.streamed_at = now
        self.told_at = now
        if self.mode == "companion":
            self.goal = message.lat_int / 1e7, message.lon_int / 1e7, message.alt

    def has(self, number):
        return number in (33, 245) or self.kind == "arducopter" and number in (87, 147, 162, 242)

    def say(self, message):
        if not self.silent:
            self.stamp(self.codec)
            try:
                self.port.write(message.pack(self.codec))
            except BlockingIOError:
                pass

    def say_what_is_due(self):
        now = time.monotonic()
        for number, stream in self.streams.items():
            if stream[0] > 0 and stream[1] <= now and number not in self.dropped:
                stream[1] = now + stream[0]
                if message := self.message(number, int((now - self.began) * 1e3)):
                    self.say(message)

    def message(self, number, boot_ms):
        lat, lon = (round(degrees * 1e7) for degrees in self.at[:2])
        if number == 0:
            base = 1 | (128 if self.armed else 0)
            autopilot = 0 if self.is_stranger else 12 if self.kind == "px4" else 3
            return common.MAVLink_heartbeat_message(2, autopilot, base, MODES[self.kind][self.mode], 5 if self.by_itself else 4, 3)
        if number == 33 and not self.is_lost:
            self.said.append(list(self.at))
            above = self.at[2] - self.home[2]
            return common.MAVLink_global_position_int_message(
                boot_ms, lat, lon, round(self.at[2] * 1e3), round(above * 1e3), 0, 0, 0, 0
            )
        if number == 245:
            return common.MAVLink_extended_sys_state_message(0, self.landed)
        if number == 147 and self.battery:
            percent, left = self.battery
            return common.MAVLink_battery_status_message(0, 0, 1, 32767, [65535] * 10, -1, -1, -1, percent, left)
        if number == 242:
            lat, lon = (round(degrees * 1e7) for degrees in self.home[:2])
            return common.MAVLink_home_position_message(lat, lon, round(self.home[2] * 1e3), 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)
        # A PX4 does not say it in its mode.
        if number == 162:
            return common.MAVLink_fence_status_message(0, 0, 0, 0)
        if number == 87 and self.mode == "companion":
            lat, lon, amsl = self.goal or self.hold
            return common.MAVLink_position_target_global_int_message(
                boot_ms, AMSL, 0xDF8, round(lat * 1e7), round(lon * 1e7), amsl, 0, 0, 0, 0, 0, 0, 0, 0
            )
        return None


key = bytes.fromhex(open(sys.argv[6]).read()) if len(sys.argv) > 6 else None
drone = Drone(sys.argv[1], sys.argv[2], tuple(map(float, sys.argv[3:6])), key)
print(json.dumps({"mavpackettype": "READY"}), flush=True)
os.set_blocking(0, False)
orders = b""
next_step = time.monotonic()
while True:
    wait = [0, drone.port] if drone.port.is_open() else [0]
    ready, _, _ = select.select(wait, [], [], max(0.0, next_step - time.monotonic()))
    if 0 in ready:
        data = os.read(0, 4096)
        if not data:
            break
        *lines, orders = (orders + data).split(b"\n")
        for line in lines:
            drone.order(line.decode().split())
    if drone.port.is_open():
        drone.hear()
    if time.monotonic() >= next_step:
        next_step += STEP
        drone.step()
        if drone.port.is_open():
            drone.say_what_is_due()
