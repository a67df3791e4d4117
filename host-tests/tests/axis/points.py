#!/usr/bin/env python3
"""Points beside lines on earth, by GeographicLib: prints points.csv.

    python3 -m venv target/python && target/python/bin/pip install geographiclib
    target/python/bin/python host-tests/tests/axis/points.py > host-tests/tests/axis/points.csv

Angles are in 1e-7 degrees. x_m is from the transmitter to the foot of the point on the geodesic to the receiver, y_m the
distance from that foot, to the right above 0.
"""

import math
import random

from geographiclib.geodesic import Geodesic

EARTH = Geodesic.WGS84
LINES = 100


def unit(degrees):
    return round(degrees * 1e7)


def around(degrees):
    return (degrees + 180.0) % 360.0 - 180.0


def foot(line, lat, lon, x):
    for _ in range(20):
        at = line.Position(x)
        to = EARTH.Inverse(at["lat2"], at["lon2"], lat, lon)
        turn = math.radians(to["azi1"] - at["azi2"])
        step = to["s12"] * math.cos(turn)
        x += step
        if abs(step) < 1e-9:
            break
    return x, to["s12"] * math.sin(turn)


random.seed(1)
print("tx_lat,tx_lon,rx_lat,rx_lon,lat,lon,distance_m,x_m,y_m")
for length in (1e3, 1e4, 1e5):
    for _ in range(LINES):
        tx = [unit(random.uniform(-89, 89)), unit(random.uniform(-180, 180))]
        end = EARTH.Direct(tx[0] / 1e7, tx[1] / 1e7, random.uniform(0, 360), length)
        rx = [unit(end["lat2"]), unit(around(end["lon2"]))]
        line = EARTH.InverseLine(*(part / 1e7 for part in tx + rx))
        x, y = random.uniform(0, length), random.uniform(-500, 500)
        at = line.Position(x)
        beside = EARTH.Direct(at["lat2"], at["lon2"], at["azi2"] + 90, y)
        point = [unit(beside["lat2"]), unit(around(beside["lon2"]))]
        x, y = foot(line, *(part / 1e7 for part in point), x)
        print(*tx, *rx, *point, f"{line.s13:.6f},{x:.6f},{y:.6f}", sep=",")
