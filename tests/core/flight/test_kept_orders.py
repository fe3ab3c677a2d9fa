"""Returns and landings that cannot be carried out at once: kept, alarmed, and carried out as soon as they can be."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.rig import Rig
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.protocol.flight import Land

MakeRig = Callable[..., Rig]


def with_a_new_station(rig: MakeRig, tmp_path: Path, autopilots: str = "ardupilot") -> Rig:
    """Three vehicles fly; the station is killed, its memory is gone, and a new one has heard them for half a second."""
    flight = rig(3, autopilots=autopilots).flying().run(10.0)
    flight.restart_station(StateStore(tmp_path / "gone.json"))
    return flight.until_heard()


@pytest.mark.long
@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
@pytest.mark.parametrize("order", [m.Return(), Land(), m.Return((1, 2, 3))], ids=["return", "land", "return by name"])
def test_a_new_station_brings_down_every_vehicle_that_it_hears(
    rig: MakeRig, tmp_path: Path, autopilots: str, order: m.Return | Land
) -> None:
    """At once: it knows neither who they are nor where they took off."""
    flight = with_a_new_station(rig, tmp_path, autopilots)
    reply = flight.ask(order)
    assert {result.vehicle for result in reply.results} == {1, 2, 3}, "every vehicle has a result"
    flight.run(2.0)
    waiting = {v for alarm in flight.station.alarms.alarms() if alarm.cause == "kept" for v in alarm.vehicles}
    kept = {one.vehicle for one in flight.station.flight.flights if one.kept is not None}
    assert waiting >= kept, "what waits is alarmed"
    flight.until(lambda: not flight.sim.armed.any(), 250.0, "all landed")


@pytest.mark.long
def test_return_all_is_kept_for_a_lost_vehicle(rig: MakeRig) -> None:
    flight = rig(3).flying().run(5.0)
    flight.sim.silence(1)
    flight.run(12.0)
    reply = flight.ask(m.Return())
    texts = {result.vehicle: result.text for result in reply.results}
    assert texts[2] == "is lost: returns when it is heard again"
    flight.run(3.0)
    flight.sim.unsilence(1)
    flight.until(lambda: flight.phase(2) is Phase.RETURNING, 20.0, "returns")
    flight.until(lambda: not flight.sim.armed.any(), 250.0, "all landed")


@pytest.mark.long
@pytest.mark.parametrize("newer", [m.Hold(), m.Hold((2,))])
def test_a_newer_order_takes_the_place_of_one_that_is_kept(rig: MakeRig, tmp_path: Path, newer: m.Hold) -> None:
    flight = with_a_new_station(rig, tmp_path)
    flight.ask(m.Return())
    flight.ask(newer)
    flight.run(20.0)
    assert flight.phase(2) is Phase.HOLDING
