"""100,000 forged and replayed frames on a station whose vehicles sign: none is believed, and every genuine one is."""

import random
from collections.abc import Callable, Iterator

import pytest

from tests.hostile.oracle import KEY, STRANGER, Oracle
from tests.hostile.test_identity import HOME, accepted, heartbeat, listening
from tui_gcs.core.fleet.vehicle import Signing
from tui_gcs.core.mavlink.signing import MAX_TIMESTAMP, sign, strip_signature, ticks
from tui_gcs.core.mavlink.sources import Address

Attack = Callable[..., Oracle]
FRAMES = 100_000


@pytest.mark.long
def test_none_of_a_hundred_thousand_is_believed(attack: Attack) -> None:
    """Played back as they were, with other signatures, times, senders and contents, unsigned, as version 1; from the
    vehicle's own address and from elsewhere."""
    oracle = attack(keyed=(1, 2))
    heard = listening(oracle.flight)
    oracle.run(30.0)
    recording = [data for data, _ in heard]
    heard.clear()
    oracle.flight.on_way = None
    trust = oracle.flight.station.picture.trust
    intake = oracle.flight.station.picture.fleet.intakes[""]
    before = {place: len(each.verifier.streams()["newest"]) for place, each in trust._keyed_vehicles.items()}
    oracle.flood(forgeries(oracle, recording))
    oracle.run(3.0)
    assert accepted(oracle.flight) == accepted(oracle.twin), "no forged one, each genuine one"
    assert {place: len(each.verifier.streams()["newest"]) for place, each in trust._keyed_vehicles.items()} == before
    assert all(each.verifier.streams()["ahead"] == [] for each in trust._keyed_vehicles.values())
    assert len(intake.sources) <= 4 and set(oracle.flight.station.picture.fleet.vehicles) == {1, 2}
    assert oracle.vehicle.telemetry.position_m == oracle.twin.station.picture.fleet.vehicles[1].telemetry.position_m
    assert all(v.identity.signing is Signing.OURS for v in oracle.flight.station.picture.fleet.vehicles.values())
    refused = oracle.dropped()
    assert sum(refused.values()) - refused["junk bytes"] >= FRAMES * 0.99, dict(refused)
    oracle.holds(counted="signature: bad signature", told="unknown key", sends=lambda _, name: name == "HEARTBEAT")


def forgeries(oracle: Oracle, recording: list[bytes], frames: int = FRAMES) -> Iterator[tuple[bytes, Address]]:
    """A sixth of them are replayed as they were; `python -m tests.bench promises` takes more."""
    chance = random.Random(4)
    other = chance.randbytes(32)
    for number in range(frames):
        raw = chance.choice(recording)
        kind = number % 6
        if kind == 1:  # another time
            time = chance.choice((MAX_TIMESTAMP, ticks(oracle.flight.clock.wall()), chance.randrange(MAX_TIMESTAMP)))
            raw = raw[:-12] + time.to_bytes(6, "little") + raw[-6:]
        elif kind == 2:  # another link id
            raw = raw[:-13] + bytes((raw[-13] ^ chance.randrange(1, 256),)) + raw[-12:]
        elif kind == 3:  # another key
            raw = sign(strip_signature(raw), other, chance.randrange(256), ticks(oracle.flight.clock.wall()) + number)
        elif kind == 4:  # none
            raw = strip_signature(raw)
        elif kind == 5:  # a guess
            fresh = oracle.frame("HEARTBEAT", 1 + number % 2, **heartbeat())
            raw = sign(fresh, KEY, 0, ticks(oracle.flight.clock.wall()) + number)[:-6] + chance.randbytes(6)
        place = ("sim", raw[5] - 1) if number % 3 else STRANGER
        yield raw, place if raw[5] in (1, 2) else HOME
