"""Returns and landings that cannot be carried out at once: kept, alarmed, and carried out as soon as they can be."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.flight.test_other_stations import AUTO, GUIDED, OtherStation, left, on_its_mission
from tests.core.rigs.rig import Rig
from tui_gcs.core.flight.flights import TakenOut
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


# ---------------------------------------------------------------- through `kill -9` of the station


def killed(flight: Rig, path: Path) -> Rig:
    """The station has written down what it knows, is killed, and the next one reads that."""
    StateStore(path).remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(path))
    return flight


def kept(flight: Rig, vehicle: int) -> str:
    order = flight.station.flight.flights.by_id[vehicle].kept
    return order.what if order is not None else ""


@pytest.mark.long
def test_a_return_that_waits_for_a_lost_vehicle_outlives_the_station(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(3).flying().run(5.0)
    flight.sim.silence(1)
    flight.run(12.0)
    assert flight.ask(m.Return()).results[1].text == "is lost: returns when it is heard again"
    killed(flight, tmp_path / "memory.json").run(4.0)
    assert kept(flight, 2) == "return" and flight.phase(1) is Phase.HOLDING
    flight.sim.unsilence(1)
    flight.until(lambda: flight.phase(2) is Phase.RETURNING, 20.0, "returns")
    assert any(text.startswith("return that console-1 ordered before: ") for text in flight.texts("vehicle 2"))


@pytest.mark.long
def test_a_return_that_waits_for_a_home_outlives_two_stations(rig: MakeRig, tmp_path: Path) -> None:
    flight = with_a_new_station(rig, tmp_path)
    flight.ask(m.Return())
    assert [kept(flight, v) for v in (1, 2, 3)] == ["return"] * 3
    for number in (1, 2):
        killed(flight, tmp_path / f"memory{number}.json")
        assert [kept(flight, v) for v in (1, 2, 3)] == ["return"] * 3
    flight.until(lambda: not flight.sim.armed.any(), 250.0, "all landed")


@pytest.mark.long
def test_a_hold_that_was_not_confirmed_yet_outlives_the_station(rig: MakeRig, tmp_path: Path) -> None:
    """A vehicle on its mission that is LOST would otherwise fly on when it is heard again."""
    flight = on_its_mission(rig)
    flight.sim.silence(1)
    flight.run(8.0)
    flight.ask(m.Hold())
    killed(flight, tmp_path / "memory.json").run(4.0)
    assert kept(flight, 2) == "hold"
    flight.sim.unsilence(1)
    flight.run(15.0)
    assert int(flight.sim.mode[1]) != AUTO and flight.speed(2) < 0.5
    assert flight.phase(2) is Phase.HOLDING


@pytest.mark.long
def test_a_hold_that_is_confirmed_is_not_sent_again(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(3).flying().run(5.0)
    flight.ask(m.Hold())
    flight.run(12.0)
    killed(flight, tmp_path / "memory.json").run(6.0)
    assert [kept(flight, v) for v in (1, 2, 3)] == [""] * 3
    assert flight.phases() == {Phase.HOLDING}


@pytest.mark.long
@pytest.mark.parametrize("in_team", [True, False])
def test_a_mission_that_this_station_began_is_watched_by_the_next_one(
    rig: MakeRig, tmp_path: Path, in_team: bool
) -> None:
    flight = on_its_mission(rig)
    if not in_team:
        del flight.station.flight.flights.by_id[2]
        flight.station.flight.courses.watch_mission(2)
        flight.run(1.0)
    killed(flight, tmp_path / "memory.json")
    if not in_team:
        del flight.station.flight.flights.by_id[2]  # the scenario names it again
    flight.run(8.0)
    assert left(flight) == "" and int(flight.sim.mode[1]) == AUTO
    if in_team:
        assert flight.station.flight.flights.by_id[2].step is TakenOut.ON_BOARD
    else:
        assert flight.station.flight.flights.sent == {2}
    OtherStation(flight).mode(2, GUIDED)
    flight.run(6.0)
    assert "commanded by system 252" in left(flight)
