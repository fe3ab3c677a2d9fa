"""Two links, and the way up of the one in use is dead while its way down lives: every stop still arrives.

Such a link looks well to the station, which goes on using it. So a stop goes over every path, in every mode.
"""

import json
from collections.abc import Callable
from typing import Any

import msgspec
import pytest

from tests.core.rigs.wires import MakeWired, Wire, Wired
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import flight as f
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.bus import REQUEST
from tui_gcs.core.protocol.common import Phase

pytestmark = pytest.mark.long  # each is a flight

CENTRE = (260.0, 220.0)
MISSION_MODES = ("AUTO", "MISSION")
BACK_WITHIN_S = 60.0


def flying(wired: MakeWired, autopilots: str) -> Wired:
    return wired(1, autopilots=autopilots, wires=[Wire("near"), Wire("far")]).flying().run(5.0)


def ask(flight: Wired, request: m.AnyRequest, principal: str = "console-7") -> s.ServiceReply:
    return m.decode(flight.bus.ask(REQUEST.format(principal=principal), m.encode(request)), s.ServiceReply)


def circling(flight: Wired) -> None:
    """A moving reference: GUIDED on ArduCopter, OFFBOARD on PX4."""
    assert ask(flight, f.CircleFlight((1,), (*CENTRE, float("nan")), 30.0, 5.0)).ok
    flight.until(lambda: flight.speed(1) > 3.0, 30.0)


def on_its_way(flight: Wired) -> None:
    """A place far away: GUIDED on ArduCopter, Hold (AUTO.LOITER) on PX4."""
    x, y, z = flight.place(1)
    assert ask(flight, f.GoTo((1,), ((x + 120.0, y + 20.0, z),))).ok
    flight.until(lambda: flight.speed(1) > 3.0, 30.0)


def in_its_mission(flight: Wired) -> None:
    """A mission on board: AUTO."""
    x, y, z = flight.place(1)
    places = [flight.station.picture.fleet.frame.to_geodetic(x + 60.0 * way, y) for way in (1, 2, 3, 4)]
    rows = tuple(s.PlanRow(16, 3, (0, 0, 0, 0), round(lat * 1e7), round(lon * 1e7), z) for lat, lon in places)
    ask(flight, s.UploadPlan((1,), "mission", rows))  # type: ignore[arg-type]
    flight.until(lambda: flight.station.services.missions.state(1).total > 0, 20.0, "uploaded")
    assert ask(flight, f.OnBoardMission((1,), "start")).ok
    flight.until(lambda: mode(flight) in MISSION_MODES and flight.speed(1) > 3.0, 20.0)


def in_loiter(flight: Wired) -> None:
    """Its pilot took it while it moved: LOITER."""
    circling(flight)
    flight.pilot(1, 5)
    flight.until(lambda: mode(flight) == "LOITER", 5.0)


def mode(flight: Wired) -> str:
    return str(flight.station.publisher.frame().mode[0])


def whole(way: str, data: bytes) -> bool:
    """Nothing is lost."""
    return False


def cut_way_up(flight: Wired) -> Wire:
    """What the station sends over the link in use does not arrive any more, until its `loses` is `whole` again."""
    used = flight.vehicle().path.source.link
    (wire,) = (wire for wire in flight.wires if wire.name == used)
    wire.loses = lambda way, data: way == "down"
    return wire


def journalled(flight: Wired, **like: Any) -> list[dict[str, Any]]:
    lines = [json.loads(line) for line in flight.journal.path.read_text().splitlines()]
    return [line for line in lines if like.items() <= line.items()]


FLIGHTS = [
    ("ardupilot", circling),
    ("ardupilot", on_its_way),
    ("ardupilot", in_its_mission),
    ("ardupilot", in_loiter),
    ("px4", circling),
    ("px4", on_its_way),
    ("px4", in_its_mission),
]


@pytest.mark.parametrize(("autopilots", "begin"), FLIGHTS, ids=[f"{a}-{b.__name__}" for a, b in FLIGHTS])
def test_a_hold_and_a_landing_arrive_and_are_journalled(
    wired: MakeWired, autopilots: str, begin: Callable[[Wired], None]
) -> None:
    """One after the other in one flight; the hold is confirmed, too."""
    flight = flying(wired, autopilots)
    begin(flight)
    dead = cut_way_up(flight)
    reply = ask(flight, m.Hold(vehicles=(1,)))
    assert reply.ok and reply.results[0].ok, reply
    flight.until(lambda: "hold: confirmed" in flight.texts("vehicle 1"), 12.0, "hold confirmed")
    assert flight.speed(1) < 0.5 and flight.phase(1) is Phase.HOLDING
    assert flight.vehicle().path.source.link == dead.name, "the link looks well, and stays in use"
    assert journalled(flight, action="hold", vehicle=1, by="console-7", **{"class": "stop"})
    dead.loses = whole
    begin(flight)
    cut_way_up(flight)
    assert ask(flight, f.Land((1,))).ok
    flight.until(lambda: flight.phase(1) is Phase.GROUND, 90.0, "down")
    assert journalled(flight, action="land", vehicle=1, by="console-7", **{"class": "stop"})


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
@pytest.mark.parametrize("begin", [circling, on_its_way, in_its_mission])
def test_a_return_arrives_and_is_journalled(wired: MakeWired, autopilots: str, begin: Callable[[Wired], None]) -> None:
    """Its mode, its places one after the other, and the landing at the end."""
    flight = flying(wired, autopilots)
    begin(flight)
    cut_way_up(flight)
    assert ask(flight, m.Return(vehicles=(1,))).ok
    flight.until(lambda: flight.phase(1) is Phase.GROUND, BACK_WITHIN_S + 120.0, "down")
    assert journalled(flight, action="return", vehicle=1, by="console-7", **{"class": "stop"})
    assert journalled(flight, action="land", vehicle=1, by="console-7", **{"class": "stop"})


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_the_brake_after_a_veto_arrives_and_is_journalled(wired: MakeWired, autopilots: str) -> None:
    """The guard vetoes a course: the vehicle is stopped by the guard, not by an operator."""
    flight = flying(wired, autopilots)
    circling(flight)
    cut_way_up(flight)
    flight.station.flight.guard.set_round(
        msgspec.structs.replace(flight.station.flight.guard.limits, speed_m_s=1.0), flight.station.flight.guard.area, ()
    )
    flight.until(lambda: flight.speed(1) < 0.5, 12.0, "stopped")
    assert journalled(flight, action="hold", vehicle=1, by="guard", **{"class": "stop"})


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_the_hold_for_a_silent_planner_arrives_and_is_journalled(wired: MakeWired, autopilots: str) -> None:
    flight = flying(wired, autopilots)
    flight.until(lambda: flight.phase(1) is Phase.FLYING, 5.0)
    cut_way_up(flight)
    flight.planning = False
    flight.until(lambda: flight.phase(1) is Phase.HOLDING, 10.0, "held")
    flight.until(lambda: bool(journalled(flight, action="hold", vehicle=1, by="station")), 2.0, "journalled")


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_a_nudge_ends_over_every_path(wired: MakeWired, autopilots: str) -> None:
    """The key was released: the vehicle brakes, also where the set-points before that went over the dead link only."""
    flight = flying(wired, autopilots)
    assert ask(flight, f.Nudge((1,), (0.0, 0.0, 0.0))).ok
    for _ in range(6):
        assert ask(flight, f.Nudge((1,), (3.0, 0.0, 0.0))).ok
        flight.run(0.5)
    assert flight.speed(1) > 1.5
    cut_way_up(flight)
    flight.until(lambda: flight.speed(1) < 0.3, 4.0, "stopped")
    assert mode(flight) in ("GUIDED", "OFFBOARD"), "by its set-points, not by its failsafe"
    assert journalled(flight, vehicle=1, **{"class": "stop"})
