"""Edits of the scenario: what may not change under a flying fleet, and texts that are made to hurt."""

import math
import time
from collections.abc import Callable

import pytest

from sitl.launch.fleet import VehicleSpec
from tests.core.rigs.rig import Rig, toml
from tui_gcs.core.geometry.idleness_grid import IdlenessGrid
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import Circle
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase, Reply, RunPhase
from tui_gcs.core.scenario.load import ScenarioError, parse

MakeRig = Callable[..., Rig]

SECOND_ROUND = '[[round]]\nname = "round 2"'
CROWD = """
[[round.zone]]
name = "crowd"
role = "no-fly"
shape = "circle"
centre_m = {centre}
radius_m = 25.0
"""
"""A zone at the end of the first round."""


def two_vehicles(team: str = "vehicles = [1, 2]") -> str:
    """The shipped scenario, cut down to the team `defend` and its first two places."""
    text = toml().replace("vehicles = [1, 2, 3, 4]", team)
    attack, places = text.index('[[team]]\nname = "attack"'), text.index("# Take-off places")
    text = text[:attack] + text[places:]
    text = text[: text.index("[[place]]\nvehicle = 3")]
    return text if "vehicles = [" in team else text.replace("\nvehicle = 1\n", "\n").replace("\nvehicle = 2\n", "\n")


def with_crowd(centre: str) -> str:
    return two_vehicles().replace(SECOND_ROUND, CROWD.format(centre=centre) + "\n" + SECOND_ROUND)


def apply(flight: Rig, text: str) -> Reply:
    return flight.ask(m.ApplyScenario(base_revision=flight.station.active.revision, toml=text))


# ---------------------------------------------------------------- teams by count


def counted(rig: MakeRig, monkeypatch: pytest.MonkeyPatch) -> Rig:
    """A team of `count = 2` flies with vehicles 2 and 3; vehicle 1 was switched on later."""
    mission = parse(two_vehicles("count = 2"))
    frame = LocalFrame(mission.origin)
    places = {2: (45.0, 170.0), 3: (45.0, 190.0), 1: (45.0, 230.0)}
    degrees = {v: frame.to_geodetic(*place) for v, place in places.items()}
    specs = [VehicleSpec(v, float(lat), float(lon), 110.0) for v, (lat, lon) in degrees.items()]
    monkeypatch.setattr("tui_gcs.rehearsal.lock_step.simulated_vehicles", lambda scenario: specs)
    flight = rig(mission=mission)
    flight.sim.silence(2)
    flight.ready()
    assert flight.ask(m.Start(vehicles=(2, 3))).ok
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.RUNNING, 90.0)
    flight.sim.unsilence(2)
    flight.run(10.0)
    assert 1 in flight.station.picture.fleet.vehicles
    return flight


def flown(flight: Rig) -> dict[int, tuple[str, float, Phase]]:
    return {
        f.vehicle: (f.team, f.layer_m, f.phase) for f in flight.station.flight.flights if f.phase is not Phase.GROUND
    }


@pytest.mark.long
def test_an_edit_leaves_who_flies_where_as_it_is(rig: MakeRig, monkeypatch: pytest.MonkeyPatch) -> None:
    flight = counted(rig, monkeypatch)
    before = flown(flight)
    assert set(before) == {2, 3}
    assert apply(flight, two_vehicles("count = 2").replace("duration_s = 300.0", "duration_s = 301.0")).ok
    assert flight.station.flight.flights.members("defend") == (2, 3)
    assert flown(flight) == before
    flight.run(10.0)
    assert flown(flight) == before


@pytest.mark.long
def test_after_an_edit_everybody_still_returns(rig: MakeRig, monkeypatch: pytest.MonkeyPatch) -> None:
    flight = counted(rig, monkeypatch)
    assert apply(flight, two_vehicles("count = 2").replace("duration_s = 300.0", "duration_s = 301.0")).ok
    flight.run(5.0)
    assert flight.ask(m.Return()).ok
    flight.until(lambda: not flight.sim.armed.any(), 150.0)
    assert math.dist(flight.place(2)[:2], (45.0, 170.0)) <= 1.5
    assert math.dist(flight.place(3)[:2], (45.0, 190.0)) <= 1.5


# ---------------------------------------------------------------- what may not change in flight


def test_a_no_fly_zone_over_homes_in_use_is_refused_in_flight(rig: MakeRig) -> None:
    flight = rig(mission=parse(two_vehicles())).flying().run(20.0)
    reply = apply(flight, with_crowd("[45.0, 190.0]"))
    assert not reply.ok and (reply.text or reply.results)
    assert flight.station.active.round.no_fly == ()
    assert flight.phases() == {Phase.FLYING}


def test_a_no_fly_zone_elsewhere_is_taken_in_flight(rig: MakeRig) -> None:
    flight = rig(mission=parse(two_vehicles())).flying().run(20.0)
    assert apply(flight, with_crowd("[300.0, 350.0]")).ok
    assert [zone.name for zone in flight.station.active.round.no_fly] == ["crowd"]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("separation_horizontal_m = 10.0", "separation_horizontal_m = 1.0"),
        ("speed_m_s = 8.0", "speed_m_s = 20.0"),
    ],
)
def test_limits_do_not_change_in_flight(rig: MakeRig, old: str, new: str) -> None:
    flight = rig(mission=parse(two_vehicles())).flying()
    before = flight.station.flight.guard.limits
    assert old in two_vehicles()
    reply = apply(flight, two_vehicles().replace(old, new))
    assert not reply.ok and "limits" in reply.text
    assert flight.station.active.scenario.limits == flight.station.flight.guard.limits == before


def test_on_the_ground_limits_may_change(rig: MakeRig) -> None:
    flight = rig(mission=parse(two_vehicles())).ready()
    assert apply(flight, two_vehicles().replace("speed_m_s = 8.0", "speed_m_s = 6.0")).ok
    assert flight.station.flight.guard.limits.speed_m_s == 6.0


# ---------------------------------------------------------------- texts and zones made to hurt


def test_a_line_of_thousands_of_dotted_keys_is_refused_at_once() -> None:
    """The parser of the standard library needs seconds for it; the station must not stand still so long."""
    begin_s = time.process_time()
    with pytest.raises(ScenarioError):
        parse("a" + ".a" * 20_000 + " = 1")
    assert time.process_time() - begin_s < 0.5


def test_a_zone_of_20_km_does_not_fill_the_memory() -> None:
    text = toml()
    for old, new in (
        ("width_m = 600.0\nheight_m = 400.0", "width_m = 45000.0\nheight_m = 45000.0"),
        ("radius_m = 80.0", "radius_m = 20000.0"),
    ):
        assert old in text
        text = text.replace(old, new)
    text = text.replace("centre_m = [150.0, 200.0]", "centre_m = [300.0, 200.0]")
    try:
        parse(text)
    except ScenarioError as error:
        assert "home" in str(error) or "zone" in str(error)
    else:
        assert IdlenessGrid(Circle(centre_m=(300.0, 200.0), radius_m=20_000.0), 15.0).cells <= 300_000
