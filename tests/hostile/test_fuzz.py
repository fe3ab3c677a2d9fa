"""10 MB of generated frames through a whole station that flies: decoding, fleet, frames, status. Nothing raises.

The same bytes in every run; `FUZZ_SEED=n pytest tests/hostile/test_fuzz.py` takes others.
"""

import gc
import math
import os
import random
import struct
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import pytest
from fastcrc.crc16 import mcrf4xx

from tests.core.rigs.rig import scenario, toml
from tests.hostile.oracle import KEY, MAX_STEP_S, Watched, rss_mb
from tests.hostile.test_framing import ROOT, raw_frame
from tui_gcs.core.forward.forwarder import Endpoint
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.frames import SIGNED, cut_datagram
from tui_gcs.core.mavlink.signing import sign
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol import common as m
from tui_gcs.core.records.tlog_reader import read_tlog

SEED = int(os.environ.get("FUZZ_SEED", "1"))
GENERATED_BYTES, MUTATED_BYTES = 6_000_000, 4_000_000
SMALL_SHARE = 0.02
"""The share of those bytes that is tried with each change of the code."""
PER_TICK = 1500
ACTED_ON = (0, 1, 2, 4, 24, 33, 74, 77, 109, 111, 147, 148, 166, 193, 235, 242, 245, 253, 256, 44, 51, 47, 22)
"""Messages that somebody in the station listens to, or might."""
EDGES = [
    b"\0",
    b"\xff",
    b"\x7f",
    b"\x80",
    b"\x01",
    struct.pack("<f", float("nan")),
    struct.pack("<f", float("inf")),
    struct.pack("<f", float("-inf")),
    struct.pack("<f", 3.4e38),
    struct.pack("<i", 2**31 - 1),
    struct.pack("<i", -(2**31)),
    struct.pack("<d", float("nan")),
    b"\x1b]0;",
    b"\xc2\x9b",
]


def places(system: int, chance: random.Random) -> Address:
    """Vehicles' frames come from where they are, or not."""
    if system in (1, 2) and chance.random() < 0.7:
        return ("sim", system - 1)
    return ("stranger", chance.randrange(4))


def generated(chance: random.Random) -> Iterator[tuple[bytes, Address]]:
    """Right checksums; any message, sender, length and content."""
    dialect.is_known(0)
    known = sorted(dialect._definitions)
    made = 0
    while made < GENERATED_BYTES:
        dice = chance.random()
        msgid = chance.choice(ACTED_ON) if dice < 0.5 else chance.choice(known)
        if dice > 0.98:
            msgid = chance.randrange(1 << 24)
        layout = dialect.layout(msgid)
        size = layout.size if layout is not None else chance.randrange(256)
        if chance.random() < 0.2:
            size = chance.randrange(256)
        payload = bytearray(chance.randbytes(size))
        for _ in range(chance.randrange(6)):
            edge = chance.choice(EDGES) * chance.choice((1, 1, 2, 8))
            at = chance.randrange(0, size + 1, 4 if chance.random() < 0.7 else 1)
            payload[at : at + len(edge)] = edge
        payload = payload[:255]
        system = chance.choice((1, 1, 2, 2, 3, 4, 5, 254, 0, chance.randrange(256)))
        component = chance.choice((1, 1, 1, 1, 100, 0, 190, chance.randrange(256)))
        seq = chance.randrange(256)
        version = 1 if msgid < 256 and chance.random() < 0.05 else 2
        raw = raw_frame(msgid, bytes(payload), system=system, component=component, seq=seq, version=version)
        if version == 2 and layout is not None and chance.random() < 0.1:
            key = chance.choice((KEY, bytes(32), chance.randbytes(32)))
            raw = sign(raw, key, chance.randrange(256), chance.choice((0, chance.randrange(2**48), 2**48 - 1)))
        made += len(raw)
        yield raw, places(system, chance)


def mutated(chance: random.Random) -> Iterator[tuple[bytes, Address]]:
    """Recorded frames with bytes changed, dropped or doubled; half of them with the checksum made right again."""
    recorded = [
        frame.raw for name in ("arducopter-8", "px4-8") for _, frame in read_tlog(ROOT / f"tests/data/{name}.tlog")
    ]
    made = 0
    while made < MUTATED_BYTES:
        raw = bytearray(chance.choice(recorded))
        right = raw[0] == 0xFD and chance.random() < 0.6
        first = 3 if right else 0
        end = 10 + raw[1] if right else len(raw)
        for _ in range(chance.randrange(1, 5)):
            at = chance.randrange(first, end)
            raw[at] = chance.choice((0, 255, 127, 128, raw[at] ^ 1 << chance.randrange(8), chance.randrange(256)))
        if right:
            extra = dialect.crc_extra(int.from_bytes(raw[7:10], "little")) or b""
            raw[end : end + 2] = mcrf4xx(bytes(raw[1:end]) + extra).to_bytes(2, "little")
        elif chance.random() < 0.3:
            raw = raw[: chance.randrange(len(raw))] + raw[chance.randrange(len(raw)) :]
        data = bytes(raw) * chance.choice((1, 1, 1, 2))
        made += len(data)
        yield data, places(data[5] if len(data) > 5 else 9, chance)


def a_partner() -> tuple[Endpoint, ...]:
    """Another station, so that forwarding sees everything, too."""
    link = MemoryLink(spec=LinkSpec("out", scheme="memory", place=""))
    link.partners = [("other station", 1)]
    return (Endpoint(link, commands=False),)


@pytest.mark.parametrize("share", [SMALL_SHARE, pytest.param(1.0, marks=pytest.mark.long)])
@pytest.mark.parametrize("stream", [False, True], ids=["datagrams", "stream"])
@pytest.mark.parametrize("source", [generated, mutated])
def test_ten_megabytes_of_frames(
    tmp_path: Path, source: Callable[[random.Random], Iterator[tuple[bytes, Address]]], stream: bool, share: float
) -> None:
    """As datagrams and, a third of it, as streams cut anywhere."""
    rig = Watched(scenario(2), toml(), tmp_path, stream=stream, keyed=(2,), partners=a_partner).flying()
    rig.slowest_s = 0.0
    gc.collect()
    chance = random.Random(SEED)
    before_mb, sent, fed = rss_mb(), 0, 0
    limit = share * (GENERATED_BYTES if source is generated else MUTATED_BYTES) / (3 if stream else 1)
    frames = source(chance)
    while fed < limit:
        for _ in range(PER_TICK // 2 if stream else PER_TICK):
            data, address = next(frames, (b"", ("end", 1)))
            fed += len(data) or math.ceil(limit)
            if not data:
                continue
            cut = chance.randrange(len(data) + 1) if stream else len(data)
            for piece in (data[:cut], data[cut:]):
                if piece:
                    rig.link.inject(piece, address)
                    sent += 1
        rig.step()
        rig.step()
    rig.run(1.0)
    fleet = rig.station.picture.fleet
    for vehicle in fleet.vehicles.values():
        for path in vehicle.paths:
            for msgid in path.slots:
                fleet.newest(vehicle, msgid)
    for intake in fleet.intakes.values():
        for each in intake.sources.values():
            for slot in each.slots.values():
                if slot.raw:
                    slot.fields()
    status = rig.status()
    assert status.links[0].frames > 10_000 * share
    assert rig.frame is not None and rig.clock.now() - rig.frame.t_s < 0.2, "fleet frames go on"
    assert m.decode(m.encode(rig.frame), m.FleetFrame).ids == rig.frame.ids
    assert {1, 2} <= set(fleet.vehicles) and set(rig.station.flight.flights.by_id) == {1, 2}
    assert rig.slowest_s < MAX_STEP_S
    assert rss_mb() - before_mb < 100
    rig.close()


def test_what_is_generated_is_well_made() -> None:
    """Most of it must get past the checksum, or it tests nothing but that."""
    frames = [raw for raw, _ in islice(generated(random.Random(SEED)), 2000)]
    good = sum(len(cut_datagram(raw).frames) == 1 for raw in frames)
    assert good > 1900
    assert any(raw[0] == 0xFD and raw[2] & SIGNED for raw in frames)
