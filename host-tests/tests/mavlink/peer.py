"""pymavlink as the other end.

    peer.py read [KEY STAMP]          frames in hex, a line each, from standard input: their fields as JSON, a line each
    peer.py write [KEY STAMP LINK]    messages as JSON, {"name": .., fields}, a line each: their frames in hex, a line each

With KEY, 32 bytes in hex, frames are signed: what is written, from STAMP on; what is read is refused where it is not, and the line is
"refused".
"""

import json
import sys

from pymavlink.dialects.v20 import common

link, reader = common.MAVLink(None, srcSystem=3, srcComponent=1), common.MAVLink(None)
for end in [link, reader] if len(sys.argv) > 2 else []:
    end.signing.secret_key, end.signing.timestamp = bytes.fromhex(sys.argv[2]), int(sys.argv[3])
    end.signing.sign_outgoing = True
    end.signing.link_id = int(sys.argv[4]) if len(sys.argv) > 4 else 0

for line in sys.stdin:
    if sys.argv[1] == "read":
        try:
            (message,) = reader.parse_buffer(bytes.fromhex(line))
        except common.MAVError:
            print("refused")
            continue
        fields = message.to_dict()
        fields["system"], fields["component"] = message.get_srcSystem(), message.get_srcComponent()
        fields["sequence"] = message.get_seq()
        print(json.dumps(fields))
    else:
        fields = json.loads(line)
        name = fields.pop("name")
        message = common.mavlink_map[getattr(common, "MAVLINK_MSG_ID_" + name)](**fields)
        print(message.pack(link).hex())
