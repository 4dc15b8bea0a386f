"""Listen to a cell with eclipse-zenoh and msgpack alone, as a program in any language would.

hmcs up                                       # in another terminal
python examples/06_listen_without_hmcs.py [ROUTER] [CELL]
"""

import json
import struct
import sys

import msgpack
import zenoh

ROUTER = sys.argv[1] if len(sys.argv) > 1 else "tcp/127.0.0.1:7447"
CELL = sys.argv[2] if len(sys.argv) > 2 else "demo"


def numbers(array: dict) -> tuple[float, ...]:
    """Arrays travel as little-endian bytes with their type and shape."""
    letter = {"<f8": "d", "<f4": "f", "<i4": "i"}[array["dtype"]]
    count = len(array["data"]) // struct.calcsize(letter)
    return struct.unpack(f"<{count}{letter}", array["data"])


config = zenoh.Config.from_json5(
    json.dumps({"mode": "client", "connect": {"endpoints": [ROUTER], "timeout_ms": 5000}})
)
with zenoh.open(config) as session:
    beliefs = session.declare_subscriber(f"hmcs/@v1/{CELL}/model/*/belief/*")
    for sample in beliefs:
        belief = msgpack.unpackb(sample.payload.to_bytes())
        sure = dict(zip(belief["states"], numbers(belief["probabilities"]), strict=True))
        likely = max(sure, key=sure.get)
        print(f"step {belief['step']}: {likely} {sure[likely]:.2f}", flush=True)
