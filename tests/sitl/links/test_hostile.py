"""Whatever a station sends, a simulated vehicle goes on: random payloads, numbers that are none, ends of ranges."""

import random
import struct

import pytest
from fastcrc import crc16

from sitl.launch.fleet import SimFleet
from sitl.links.wire import LAYOUT_BY_NAME, MAGIC_V2
from tests.sitl.conftest import Ground, specs

EXTREMES = [struct.pack("<f", value) for value in (float("nan"), float("inf"), -float("inf"), 3.4e38, -1e30, 0.5, 1e9)]
EXTREMES += [struct.pack("<I", value) for value in (0, 1, 2**31 - 1, 2**31, 2**32 - 1)]


def frame(rng: random.Random, name: str, system: int) -> bytes:
    """A good frame with a payload of random bytes and extreme numbers, for `system`."""
    layout = LAYOUT_BY_NAME[name]
    size = layout.struct.size
    pieces = b"".join(rng.choice([rng.randbytes(4), *EXTREMES]) for _ in range(size // 4 + 1))
    fields = layout.unpack(pieces[:size])
    payload = bytearray(pieces[:size])
    for field, value in (
        ("target_system", system),
        ("target_component", 1),
        ("mission_type", rng.choice((0, 1, 2, 255))),
    ):
        if field in fields and rng.random() < 0.95:
            at = offset_of(layout, field)
            payload[at] = value
    head = struct.pack("<BBBBBBBHB", MAGIC_V2, size, 0, 0, 0, 255, 190, layout.msgid & 0xFFFF, layout.msgid >> 16)
    body = head + bytes(payload)
    return body + crc16.mcrf4xx(body[1:] + layout.crc_extra).to_bytes(2, "little")


def offset_of(layout, field: str) -> int:
    """Where a one-byte field is."""
    marked = layout.struct.pack(*values_with(layout, field))
    return marked.index(b"\x01")


def values_with(layout, field: str) -> list:
    values = []
    for name, zero in zip(layout.names, layout._zeros, strict=True):
        values += list(zero) if name in layout.arrays else [1 if name == field else zero]
    return values


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("seed", [1, 2])
def test_random_messages_do_no_harm(autopilot, seed):
    rng = random.Random(seed)
    ground = Ground(SimFleet(specs(1, autopilot), seed=seed))
    ground.beat(4.0)
    names = sorted(set(ground.fleet._pilots[0].handlers) - {"SETUP_SIGNING"})
    for _ in range(20):
        for name in names:
            ground.fleet.receive(0, frame(rng, name, 1))
        ground.run(0.1)
    ground.fleet.unsilence(0)
    ground.heard.clear()
    ground.beat(3.0)
    assert ground.of("HEARTBEAT")


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_plans_of_extreme_items(autopilot):
    """Uploads whose items are anything: each is refused or kept, and can be read back."""
    rng = random.Random(3)
    ground = Ground(SimFleet(specs(1, autopilot)))
    ground.beat(4.0)
    numbers = [float("nan"), float("inf"), -1e30, 0.0, 3.0, 400.0]
    for _ in range(200):
        kind = rng.choice((0, 1, 2))
        ground.say("MISSION_COUNT", count=2, mission_type=kind)
        for seq in range(2):
            ground.say(
                rng.choice(("MISSION_ITEM_INT", "MISSION_ITEM_INT", "MISSION_ITEM")),
                mission_type=kind,
                seq=seq,
                frame=rng.choice((0, 2, 3, 6, 10, 99)),
                command=rng.choice((16, 17, 18, 19, 21, 22, 31, 93, 177, 178, 201, 5001, 5003, 5100, 65535)),
                x=rng.choice((0, 2**31 - 1, -(2**31), 520_720_000)),
                y=rng.choice((0, 2**31 - 1, -(2**31), -6_280_000)),
                z=rng.choice(numbers),
                **{f"param{k}": rng.choice(numbers) for k in range(1, 5)},
            )
        ground.say("MISSION_ACK", mission_type=kind, type=15)
        for seq in range(3):
            ground.say("MISSION_REQUEST_LIST", mission_type=kind)
            ground.say("MISSION_REQUEST_INT", mission_type=kind, seq=seq)
        ground.say("MISSION_ACK", mission_type=kind, type=0)
        ground.run(0.1)
    ground.heard.clear()
    ground.beat(2.0)
    assert ground.of("HEARTBEAT")
