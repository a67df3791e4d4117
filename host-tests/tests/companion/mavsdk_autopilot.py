"""MAVSDK as the autopilot of a drone, on a UDP port or a tty.

    mavsdk_autopilot.py udpin://127.0.0.1:PORT|serial:///dev/TTY:115200 LAT LON AMSL

The drone is where the last target was, from LAT, LON, AMSL on. Arming and modes are those of MAVSDK's action server, its messages those
of its telemetry server. MAVSDK says of itself that it is a generic autopilot: one heartbeat that says PX4 is sent by hand. What it hears
goes to standard output, a JSON object a line; standard input has an order a line:

    px4                      the heartbeat that says PX4
    arm, air
    mode hold|offboard
"""

import json
import os
import select
import sys
import time

from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration, Mavsdk
from mavsdk.plugins.action_server.action_server import ActionServer, AllowableFlightModes, FlightMode
from mavsdk.plugins.mavlink_direct.mavlink_direct import MavlinkDirect, MavlinkMessage
from mavsdk.plugins.telemetry_server.telemetry_server import (
    Heading,
    LandedState,
    Position,
    TelemetryServer,
    VelocityNed,
    VtolState,
)

# MAVSDK logs to standard output, which nobody reads: what is heard has a descriptor of its own.
heard = os.fdopen(os.dup(1), "w")
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def tell(name, fields):
    heard.write(json.dumps({**fields, "mavpackettype": name}) + "\n")
    heard.flush()


configuration = Configuration.create_with_component_type(ComponentType.AUTOPILOT)
configuration.system_id = 1
mavsdk = Mavsdk(configuration)
assert mavsdk.add_any_connection(sys.argv[1]) == 0
tell("READY", {})
at, landed = [float(number) for number in sys.argv[2:5]], LandedState.ON_GROUND

# The companion has the drone's own number, so it is the one system that there is.
while not mavsdk.get_systems():
    time.sleep(0.05)
(system,) = mavsdk.get_systems()
direct = MavlinkDirect(system)
targets = []
# While there is one, it says in a heartbeat of its own that it is active, in a mode of its pilot.
active = []


def hear(message, _):
    fields = json.loads(message.fields_json)
    fields["from"] = [message.system_id, message.component_id]
    if message.message_name == "SET_POSITION_TARGET_GLOBAL_INT":
        targets.append([fields["lat_int"] / 1e7, fields["lon_int"] / 1e7, fields["alt"]])
    tell(message.message_name, fields)


for name in ["HEARTBEAT", "COMMAND_LONG", "SET_POSITION_TARGET_GLOBAL_INT", "STATUSTEXT"]:
    direct.subscribe_message(name, hear)

component = mavsdk.server_component()
action, telemetry = ActionServer(component), TelemetryServer(component)
action.set_armable(True, True)
action.set_allowable_flight_modes(AllowableFlightModes(True, True, True))


def order(words):
    global landed
    match words:
        case ["px4"]:
            says = {"type": 2, "autopilot": 12, "base_mode": 1, "custom_mode": 0, "system_status": 4}
            direct.send_message(MavlinkMessage("HEARTBEAT", 1, 1, 0, 0, json.dumps(says)))
        case ["active"]:
            active.append(time.monotonic())
        case ["arm"]:
            action.set_armed_state(True)
        case ["air"]:
            landed = LandedState.IN_AIR
        case ["mode", mode]:
            active.clear()
            action.set_flight_mode({"hold": FlightMode.HOLD, "offboard": FlightMode.OFFBOARD}[mode])
        case _:
            raise ValueError(words)


orders = b""
while True:
    if select.select([0], [], [], 0.1)[0]:
        data = os.read(0, 4096)
        if not data:
            break
        *lines, orders = (orders + data).split(b"\n")
        for line in lines:
            order(line.decode().split())
    if active and time.monotonic() - active[0] > 0.5:
        active[0] = time.monotonic()
        says = {"type": 2, "autopilot": 12, "base_mode": 129, "custom_mode": 4 << 16 | 3 << 24, "system_status": 4}
        direct.send_message(MavlinkMessage("HEARTBEAT", 1, 1, 0, 0, json.dumps(says)))
    if targets:
        at = targets.pop()
        targets.clear()
    telemetry.publish_position(Position(at[0], at[1], at[2], 20.0), VelocityNed(0, 0, 0), Heading(0.0))
    telemetry.publish_extended_sys_state(VtolState.UNDEFINED, landed)
os._exit(0)
