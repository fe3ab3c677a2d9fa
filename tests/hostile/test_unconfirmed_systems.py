"""A whole table of forged heartbeats (B.6-20, extended): reported, and removed when the forger is gone."""

from collections.abc import Callable

import pytest

from tests.hostile.oracle import Oracle
from tests.hostile.test_framing import HEARTBEAT
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.records.event_log import WARNING

Attack = Callable[..., Oracle]
GHOSTS = range(10, 40)
FORGER: Address = ("stranger", 7)


def asks_the_forger(address: Address, message: str) -> bool:
    return address == FORGER


@pytest.mark.long
def test_b6_20_unconfirmed_systems_are_reported_and_forgotten_and_no_others(attack: Attack) -> None:
    """Vehicle 2 falls silent at the same time, and stays: it was more than heartbeats."""
    oracle = attack(2, flying=False, others=())
    for _ in range(20):
        for system in GHOSTS:
            oracle.say("HEARTBEAT", system, address=FORGER, **HEARTBEAT | {"base_mode": 81})
        oracle.run(1.0)
    fleet = oracle.flight.station.picture.fleet
    assert set(fleet.vehicles) == {1, 2, *GHOSTS}
    said = oracle.told(f"{len(GHOSTS)} vehicles are nothing but heartbeats")
    assert len(said) == 1 and said[0].severity == WARNING
    oracle.both(lambda rig: rig.sim.silence(1))
    oracle.run(65.0)
    assert set(fleet.vehicles) == {1, 2}
    oracle.others = (1,)
    oracle.holds(counted="vehicle of heartbeats only forgotten", sends=asks_the_forger)
