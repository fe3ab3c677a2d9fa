"""Bad links in a lock-step run: vehicles are heard, and losses are counted."""

from pathlib import Path

import msgspec
import pytest

from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.rehearsal.lock_step import FaultyLinks, LockStep

SHIPPED = Path(__file__).parents[2] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"


def short() -> Scenario:
    """Two vehicles, and a planner that begins without a second of design."""
    whole = load(SHIPPED)
    team = msgspec.structs.replace(whole.teams[0], vehicles=(1, 2), planner="waypoints", parameters={})
    return msgspec.structs.replace(whole, teams=(team,), places=whole.places[:2])


def test_vehicles_are_heard_over_bad_links_and_losses_are_counted(tmp_path: Path) -> None:
    links = FaultyLinks("loss=0.1,delay=100ms,jitter=20%,dup=0.05,reorder=0.05", seed=1)
    flight = LockStep(short(), "", tmp_path, bad_links=links)
    for _ in range(100):
        flight.step()
    flight.close()
    assert set(flight.station.picture.fleet.vehicles) == {1, 2}
    down, up = links.text().splitlines()
    assert down.startswith("vehicles to station: ") and "lost 0 " not in down
    assert up.startswith("station to vehicles: ") and "lost 0 " not in up


def test_datagrams_of_each_vehicle_go_through_a_link_of_its_own() -> None:
    links = FaultyLinks("down.delay=200ms", seed=1)
    assert links.up(0.0, [(1, b"to one")]) == [(1, b"to one")]
    assert links.down(0.0, [(0, b"of zero"), (1, b"of one")]) == []
    assert links.down(0.1, []) == []
    assert links.down(0.2, []) == [(1, b"of one"), (0, b"of zero")]


def test_a_mistake_is_told() -> None:
    with pytest.raises(ValueError, match="loss=2: must be"):
        FaultyLinks("loss=2", seed=1)
