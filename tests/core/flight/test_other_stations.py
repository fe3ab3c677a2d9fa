"""Another station commands our vehicles: whatever they fly, it is noticed, named and journalled. Flights in lock-step.

The other station has a link of its own to the vehicle; ours hears the vehicle's answers to it, as on a shared link.
"""

import math
from collections.abc import Callable

import pytest

from sitl.common.missions import Item
from tests.core.rigs.rig import Rig
from tui_gcs.core.flight.flights import TakenOut
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import REQUEST
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.protocol.flight import GoTo, OnBoardMission

MakeRig = Callable[..., Rig]
AUTO, GUIDED, LAND = 3, 4, 9
PX4_HOLD, PX4_MISSION = (4 << 16 | sub << 24 for sub in (3, 4))
OTHER = 252
NAN = math.nan


class OtherStation:
    """A second ground station, on a link that ours does not hear."""

    def __init__(self, flight: Rig) -> None:
        self.flight, self.encoder = flight, Encoder(OTHER, 190)

    def mode(self, vehicle: int, mode: int) -> None:
        params = {f"param{n}": 0.0 for n in range(3, 8)} | {"param1": 1.0, "param2": float(mode)}
        self.send(vehicle, "COMMAND_LONG", target_component=1, command=176, confirmation=0, **params)

    def target(self, vehicle: int, east_m_s: float) -> None:
        """A velocity in GUIDED, which no vehicle acknowledges."""
        numbers = dict.fromkeys(("lat_int", "lon_int", "alt", "vx", "vz", "afx", "afy", "afz", "yaw", "yaw_rate"), 0)
        moving = numbers | {"vy": east_m_s, "type_mask": 0xDC7, "coordinate_frame": 6, "time_boot_ms": 0}
        self.send(vehicle, "SET_POSITION_TARGET_GLOBAL_INT", target_component=1, **moving)

    def send(self, vehicle: int, name: str, **fields: float) -> None:
        data = self.encoder.encode(name, target_system=vehicle, **fields)
        self.flight.sim.receive(self.flight.sim_index[vehicle], data)

    def leads(self, vehicle: int, seconds: float) -> None:
        """It sends a velocity twenty times a second, which is more than our set-points."""
        for _ in range(round(seconds / 0.05)):
            self.target(vehicle, 6.0)
            self.flight.run(0.05)


def left(flight: Rig) -> str:
    """The text of the alarm "left the mission"; "" without one."""
    return next((a.text for a in flight.station.alarms.alarms() if a.cause == "left" and a.state != "over"), "")


def order(flight: Rig, request: m.Request) -> None:
    """An operator's order to a vehicle; its task is not followed here."""
    flight.bus.ask(REQUEST.format(principal="console-1"), m.encode(request))


def on_its_mission(rig: MakeRig, autopilots: str = "ardupilot", east_m: tuple[float, float] = (400.0, 500.0)) -> Rig:
    """Vehicle 2 flies a mission of its own, by our order, to these two places; ArduPilot's first item is its home."""
    flight = rig(3, autopilots=autopilots).flying().run(10.0)
    pilot = flight.sim._pilots[flight.sim_index[2]]
    items = []
    for x_m in (0.0, *east_m) if autopilots == "ardupilot" else east_m:
        lat, lon = pilot.platform.body.to_geodetic(x_m, 0.0)
        items.append(Item(16, frame=3, x=round(lat * 1e7), y=round(lon * 1e7), z=40.0))
    pilot.platform.plans.put(0, items)
    pilot.platform.plans.feasible = True
    flight.station.services.missions.state(2).total = 3
    order(flight, OnBoardMission((2,), "start"))
    flight.run(4.0)
    assert flight.station.flight.flights.by_id[2].step is TakenOut.ON_BOARD
    assert int(flight.sim.mode[1]) == (AUTO if autopilots == "ardupilot" else PX4_MISSION)
    assert left(flight) == ""
    return flight


@pytest.mark.parametrize(("mode", "name"), [(GUIDED, "GUIDED"), (LAND, "LAND")])
def test_a_vehicle_in_its_mission_that_another_station_takes_is_alarmed(rig: MakeRig, mode: int, name: str) -> None:
    flight = on_its_mission(rig)
    OtherStation(flight).mode(2, mode)
    flight.run(5.0)
    assert left(flight) == f"{name}: commanded by system {OTHER}"
    assert any(f"left its mission (now {name})" in t and str(OTHER) in t for t in flight.texts("vehicle 2"))


def test_return_all_brings_such_a_vehicle_home(rig: MakeRig) -> None:
    flight = on_its_mission(rig)
    OtherStation(flight).mode(2, GUIDED)
    flight.run(5.0)
    reply = flight.ask(m.Return())
    assert {r.vehicle: r.ok for r in reply.results} == {1: True, 2: True, 3: True}
    assert flight.phase(2) is Phase.RETURNING


def test_a_held_vehicle_that_another_station_flies_away_is_alarmed(rig: MakeRig) -> None:
    flight = rig(3).flying().run(30.0)
    assert flight.ask(m.Hold(vehicles=(2,))).ok
    flight.run(8.0)
    OtherStation(flight).leads(2, 4.0)
    assert left(flight).startswith("moves at 6 m/s, was ordered to hold")


def test_a_patrol_s_vehicle_that_another_station_leads_is_alarmed(rig: MakeRig) -> None:
    """GUIDED targets against set-points: no mode changes, and only a veto was told."""
    flight = rig(3).flying().run(40.0)
    OtherStation(flight).leads(2, 12.0)
    assert left(flight)


def test_one_under_manual_control_that_another_station_leads_is_alarmed(rig: MakeRig) -> None:
    flight = rig(3).flying().run(30.0)
    order(flight, GoTo((2,), ((260.0, 230.0, NAN),)))
    flight.run(15.0)
    OtherStation(flight).leads(2, 12.0)
    assert left(flight)


def test_heartbeats_of_another_station_name_it(rig: MakeRig) -> None:
    flight = rig(3).flying().run(5.0)
    beat = {"type": 6, "autopilot": 8, "base_mode": 0, "custom_mode": 0, "system_status": 4, "mavlink_version": 3}
    flight.say("HEARTBEAT", OTHER, index=1, component=190, **beat)
    fleet = flight.station.picture.fleet
    flight.run(0.1)
    assert fleet.other_stations.words(fleet.vehicles[2], flight.clock.now()) == f"other station heard: system {OTHER}"
    flight.run(11.0)
    assert fleet.other_stations.words(fleet.vehicles[2], flight.clock.now()) == ""


def test_a_fleet_that_nobody_disturbs_has_no_such_alarm(rig: MakeRig) -> None:
    flight = rig(3).flying()
    seen = set()
    for _ in range(240):
        flight.run(0.25)
        seen.add(left(flight))
    assert flight.ask(m.Return()).ok
    for _ in range(120):
        flight.run(0.5)
        seen.add(left(flight))
    assert seen == {""}


def test_a_px4_that_has_ended_its_mission_holds_and_is_not_alarmed(rig: MakeRig) -> None:
    """PX4 changes to Hold by itself then; in the middle of a mission that is another station's doing."""
    flight = on_its_mission(rig, "px4", (60.0, 90.0))
    flight.until(lambda: int(flight.sim.mode[1]) == PX4_HOLD, 60.0, "its mission is over")
    flight.run(10.0)
    assert left(flight) == ""
    other = on_its_mission(rig, "px4", (400.0, 500.0))
    pilot = other.sim._pilots[other.sim_index[2]]
    pilot._commander.request_mode(4, 3)
    other.run(6.0)
    assert left(other) == "HOLD"


@pytest.mark.parametrize("named", [(), (2,)], ids=["all", "named"])
def test_a_vehicle_of_no_team_that_this_station_sent_on_its_mission_is_held_too(
    rig: MakeRig, named: tuple[int, ...]
) -> None:
    flight = on_its_mission(rig)
    del flight.station.flight.flights.by_id[2]
    order(flight, OnBoardMission((2,), "continue"))
    flight.run(4.0)
    reply = flight.ask(m.Hold(vehicles=named))
    assert (2, True, "holds, is in no team") in [(r.vehicle, r.ok, r.text) for r in reply.results]
    flight.run(8.0)
    assert flight.speed(2) < 0.5
    assert left(flight) == ""
    assert (2, False) in [(r.vehicle, r.ok) for r in flight.ask(m.Hold(vehicles=(2,))).results]


def test_a_vehicle_of_no_team_on_its_mission_is_alarmed_too(rig: MakeRig) -> None:
    flight = on_its_mission(rig)
    del flight.station.flight.flights.by_id[2]
    order(flight, OnBoardMission((2,), "continue"))
    flight.run(4.0)
    assert left(flight) == ""
    OtherStation(flight).mode(2, GUIDED)
    flight.run(6.0)
    assert left(flight) == f"left its mission (now GUIDED); commanded by system {OTHER}"
    assert any("does not follow this station: left its mission" in text for text in flight.texts("vehicle 2"))


# ---------------------------------------------------------------- within its mission


def heard_too(flight: Rig) -> None:
    """Our station hears the heartbeats of the other one."""
    beat = {"type": 6, "autopilot": 8, "base_mode": 0, "custom_mode": 0, "system_status": 4, "mavlink_version": 3}
    flight.say("HEARTBEAT", OTHER, index=1, component=190, **beat)


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_another_station_that_sets_another_item_is_alarmed(rig: MakeRig, autopilots: str) -> None:
    """No mode changes, and its answer names nobody: nothing was told."""
    flight = on_its_mission(rig, autopilots).run(4.0)
    assert left(flight) == ""
    heard_too(flight)
    OtherStation(flight).send(2, "MISSION_SET_CURRENT", target_component=1, seq=2 if autopilots == "ardupilot" else 1)
    flight.run(2.5)
    assert left(flight) == f"it went from item 1 to item 2 of its mission; other station heard: system {OTHER}"
    assert any("does not follow this station: it went from item 1" in text for text in flight.texts("vehicle 2"))


def test_a_set_item_that_is_heard_on_a_shared_link_names_its_sender(rig: MakeRig) -> None:
    flight = on_its_mission(rig).run(4.0)
    flight.say("MISSION_SET_CURRENT", OTHER, index=1, component=190, target_system=2, target_component=1, seq=2)
    flight.run(1.5)
    assert left(flight) == f"another station sent it MISSION_SET_CURRENT; commanded by system {OTHER}"


@pytest.mark.parametrize(
    ("command", "words"),
    [(178, "it took a speed or height from"), (224, "another item of its mission")],
)
def test_commands_of_another_station_within_the_mission_are_alarmed(rig: MakeRig, command: int, words: str) -> None:
    flight = on_its_mission(rig).run(4.0)
    params = {f"param{n}": 0.0 for n in range(3, 8)} | {"param1": 1.0, "param2": 3.0}
    OtherStation(flight).send(2, "COMMAND_LONG", target_component=1, command=command, confirmation=0, **params)
    flight.run(2.0)
    assert words in left(flight) and left(flight).endswith(f"commanded by system {OTHER}")


def test_a_question_of_another_station_is_no_command(rig: MakeRig) -> None:
    flight = on_its_mission(rig).run(4.0)
    params = {f"param{n}": 0.0 for n in range(2, 8)} | {"param1": 148.0}
    OtherStation(flight).send(2, "COMMAND_LONG", target_component=1, command=512, confirmation=0, **params)
    flight.run(3.0)
    assert left(flight) == ""


def test_another_station_that_uploads_a_mission_into_the_flight_is_alarmed(rig: MakeRig) -> None:
    flight = on_its_mission(rig).run(4.0)
    flight.say("MISSION_ACK", 2, target_system=OTHER, target_component=190, type=0, mission_type=0)
    flight.run(1.0)
    assert left(flight) == f"another station changed its mission; commanded by system {OTHER}"


def test_a_mission_that_is_flown_as_it_is_planned_is_not_alarmed(rig: MakeRig) -> None:
    """Three places 90 m apart, with a jump back that is done twice."""
    flight = rig(1).flying().run(10.0)
    pilot, frame = flight.sim._pilots[0], flight.station.picture.fleet.frame
    items = []
    for x_m, y_m in [(0.0, 0.0), (240.0, 290.0), (330.0, 290.0), (330.0, 200.0)]:
        lat, lon = frame.to_geodetic(x_m, y_m)
        items.append(Item(16, frame=3, x=round(float(lat) * 1e7), y=round(float(lon) * 1e7), z=40.0))
    items += [Item(177, frame=2, p1=1.0, p2=2.0), items[1]]
    pilot.platform.plans.put(0, items)
    pilot.platform.plans.feasible = True
    flight.station.services.missions.download(1, PlanKind.MISSION)
    flight.run(3.0)
    order(flight, OnBoardMission((1,), "start"))
    seen = set()
    for _ in range(300):
        flight.run(0.5)
        seen.add((left(flight), flight.station.services.missions.state(1).current))
    assert {current for _, current in seen} >= {0, 1, 2, 4}
    assert {text for text, _ in seen} == {""}
