"""pymavlink as the other end.

    peer.py read    frames in hex, a line each, from standard input: their fields as JSON, a line each
    peer.py write   messages as JSON, {"name": .., fields}, a line each: their frames in hex, a line each
"""

import json
import sys

from pymavlink.dialects.v20 import common

link = common.MAVLink(None, srcSystem=3, srcComponent=1)

for line in sys.stdin:
    if sys.argv[1] == "read":
        reader = common.MAVLink(None)
        (message,) = reader.parse_buffer(bytes.fromhex(line))
        fields = message.to_dict()
        fields["system"], fields["component"] = message.get_srcSystem(), message.get_srcComponent()
        fields["sequence"] = message.get_seq()
        print(json.dumps(fields))
    else:
        fields = json.loads(line)
        name = fields.pop("name")
        message = common.mavlink_map[getattr(common, "MAVLINK_MSG_ID_" + name)](**fields)
        print(message.pack(link).hex())
