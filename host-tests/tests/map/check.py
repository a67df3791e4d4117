#!/usr/bin/env python3
"""Reads a plan's GeoJSON and KML by libraries of other people, and says where everything is.

Standard input: a JSON object with `geojson` and `kml`, the texts of both files, and `line`: the sites' latitudes and longitudes, and
`places`: x and y of every point along the line, in the files' order. Standard output: a JSON object with what was found.
"""

import json
import math
import pathlib
import sys
import tempfile

import fastkml.validator
import geojson
from fastkml import kml
from geographiclib.geodesic import Geodesic

# It would round what it reads to 11 cm.
geojson.geometry.DEFAULT_PRECISION = 9

given = json.load(sys.stdin)
EARTH = Geodesic.WGS84


def far(at, to):
    return EARTH.Inverse(at[1], at[0], to[1], to[0])["s12"]


tx, rx = given["line"]
line = EARTH.InverseLine(*tx, *rx)
expected = []
for x, y in given["places"]:
    at = line.Position(x)
    beside = EARTH.Direct(at["lat2"], at["lon2"], at["azi2"] + 90, y)
    expected.append((beside["lon2"], beside["lat2"]))

collection = geojson.loads(given["geojson"])
found = {"geojson_errors": collection.errors() or [], "type": collection["type"]}
points = [one for one in collection["features"] if one["geometry"]["type"] == "Point"]
found["geojson_kinds"] = [one["properties"]["kind"] for one in points]
found["geojson_dimensions"] = sorted({len(one["geometry"]["coordinates"]) for one in points})
found["geojson_off_m"] = max(far(one["geometry"]["coordinates"], at) for one, at in zip(points, expected, strict=True))
found["lines"] = [one["geometry"] for one in collection["features"] if one["geometry"]["type"] != "Point"]

with tempfile.TemporaryDirectory() as folder:
    file = pathlib.Path(folder) / "plan.kml"
    file.write_text(given["kml"], encoding="utf-8")
    # The schema of the OGC, which the library has with it.
    found["kml_valid"] = fastkml.validator.validate(file_to_validate=file)
document = next(iter(kml.KML.from_string(given["kml"].encode()).features))
places = list(document.features)
points = [one for one in places if one.geometry.geom_type == "Point"]
found["kml_off_m"] = max(far(one.geometry.coords[0], at) for one, at in zip(points, expected, strict=True))
found["kml_amsl_m"] = [one.geometry.coords[0][2] for one in points]
found["kml_modes"] = sorted({one.kml_geometry.altitude_mode.value for one in places})
found["kml_hops"] = sum(one.geometry.geom_type == "LineString" for one in places)
found["finite"] = all(math.isfinite(number) for one in points for number in one.geometry.coords[0])
json.dump(found, sys.stdout)
