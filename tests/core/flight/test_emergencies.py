"""A vehicle that falls is noticed, alarmed, taken out of its team, and kept clear of. Whole flights in lock-step."""

import math
from collections.abc import Callable
from itertools import chain

import pytest

from sitl.common.missions import CIRCLE_IN, Item
from tests.core.rigs.rig import Rig
from tui_gcs.core.flight.emergency_monitor import RECOVERED_S
from tui_gcs.core.flight.flights import TakenOut
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.alarms import AlarmLevel
from tui_gcs.core.protocol.common import FleetFrame, Intent, Phase, PlannerTask
from tui_gcs.core.protocol.flight import Land
from tui_gcs.core.protocol.services import VehicleInfo
from tui_gcs.core.requests.views import vehicle_info
from tui_gcs.core.uplink.actions import MavCommand

MakeRig = Callable[..., Rig]
# A vehicle on its back.
UPSIDE_DOWN = dict.fromkeys(("pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed"), 0.0) | {
    "time_boot_ms": 1,
    "roll": math.pi,
}
FALL_S = 2.5
"""By then it must be alarmed: a real ArduCopter was on the ground after 4 s."""


def alarms(flight: Rig) -> dict[str, str]:
    """Causes of alarms that hold, with their details."""
    return {alarm.cause: alarm.text for alarm in flight.station.alarms.alarms() if alarm.state != "over"}


def failing(flight: Rig, vehicle: int = 2) -> Rig:
    """A motor of one flying vehicle fails."""
    flight.sim.fail_motor(flight.sim_index[vehicle])
    return flight


def lean(flight: Rig, angle_deg: float, vehicle: int = 2) -> Rig:
    """A vehicle reports that it lies over, and goes on flying as before."""
    flight.sim._vehicles.tumble_rad[flight.sim_index[vehicle]] = math.radians(angle_deg)
    return flight


def slots(flight: Rig) -> set[str]:
    """Slots of vehicles that fly for their planner."""
    return {f.slot for f in flight.station.flight.flights if f.phase is Phase.FLYING and f.slot}


def info(flight: Rig, vehicle: int = 2) -> VehicleInfo:
    """What `vehicle list` prints of it."""
    return vehicle_info(flight.station.parts, flight.station.picture.fleet.vehicles[vehicle])


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_a_fall_is_alarmed_before_it_ends_and_its_vehicle_leaves_the_team(rig: MakeRig, autopilots: str) -> None:
    flight = failing(rig(3, autopilots=autopilots).flying().run(10.0))
    flight.until(lambda: "falling" in alarms(flight), FALL_S, "alarmed")
    assert flight.place(2)[2] > 5.0, "still in the air"
    assert flight.phase(2) is Phase.TAKEN_OUT and flight.station.flight.flights.by_id[2].step is TakenOut.EMERGENCY
    assert any(text.startswith("EMERGENCY: ") for text in flight.texts("vehicle 2"))
    flight.until(lambda: flight.place(2)[2] < 0.1, 4.0, "on the ground")
    flight.run(2.5)
    assert alarms(flight)["impact"].startswith("hit the ground at 1"), "10 m/s and more"
    assert not {"left", "vetoed", "beside", "stays"} & set(alarms(flight)), "what follows from it is not shown"
    assert flight.phase(1) is flight.phase(3) is Phase.FLYING


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_one_that_lies_over_without_falling_is_alarmed_by_its_attitude(rig: MakeRig, autopilots: str) -> None:
    flight = rig(3, autopilots=autopilots).flying().run(10.0)
    lean(flight, 69.0).until(lambda: "attitude" in alarms(flight), 1.5, "alarmed")
    assert alarms(flight)["attitude"] in ("69 degrees off level", "70 degrees off level")
    assert flight.phase(2) is Phase.TAKEN_OUT and flight.station.flight.flights.by_id[2].step is TakenOut.EMERGENCY
    assert "falling" not in alarms(flight), "it keeps its height"
    lean(flight, 0.0).run(RECOVERED_S + 1.0)
    assert not flight.station.flight.emergencies.found, "it has recovered"


def test_a_steep_turn_is_no_emergency(rig: MakeRig) -> None:
    flight = lean(rig(3).flying().run(10.0), 55.0).run(3.0)
    assert not flight.station.flight.emergencies.found and flight.phase(2) is Phase.FLYING


def test_one_wrong_attitude_is_no_emergency(rig: MakeRig) -> None:
    """One among good ones, and two that say nothing of the time between them."""
    flight = rig(3).flying().run(10.0)
    flight.say("ATTITUDE", 2, **UPSIDE_DOWN)
    flight.run(1.0)
    assert not flight.station.flight.emergencies.found
    flight.loses = lambda way, index: way == "up" and index == flight.sim_index[2]
    for _ in range(2):
        flight.say("ATTITUDE", 2, **UPSIDE_DOWN)
        flight.run(1.4)
    assert not flight.station.flight.emergencies.found


def test_a_vehicle_in_no_team_and_one_on_its_mission_are_alarmed_too(rig: MakeRig) -> None:
    flight = rig(3).flying().run(10.0)
    vehicle = flight.station.picture.fleet.vehicles[2]
    flight.station.flight.manual_control.release(vehicle, TakenOut.ON_BOARD)
    failing(flight)
    flight.until(lambda: "falling" in alarms(flight), FALL_S, "alarmed")
    del flight.station.flight.flights.by_id[3]
    failing(flight, 3).until(lambda: 3 in flight.station.flight.emergencies.found, FALL_S, "found")


def test_one_that_stands_on_the_ground_armed_and_was_not_landed(rig: MakeRig) -> None:
    """As if it had sunk slowly: nothing fell, nothing was hit."""
    flight = rig(3).flying().run(10.0)
    assert flight.ask(m.Hold()).ok
    flight.run(6.0)
    i = flight.sim_index[2]
    flight.sim._vehicles.flying[i] = False
    flight.sim._vehicles.position_m[i, 2] = 0.0
    flight.run(4.0)
    assert alarms(flight)["grounded"] == "no landing was ordered"


def test_one_that_lands_by_its_own_failsafe_has_time_to_disarm(rig: MakeRig, monkeypatch: pytest.MonkeyPatch) -> None:
    """The hold for a PX4 was not confirmed yet when its own RTL landed it: "no landing was ordered", for 2 s."""
    flight = rig(3).flying().run(10.0)
    assert flight.ask(m.Hold()).ok
    flight.run(6.0)
    monkeypatch.setattr("tui_gcs.core.flight.emergency_monitor.comes_down_by", lambda _: "return")
    i = flight.sim_index[2]
    flight.sim._vehicles.flying[i] = False
    flight.sim._vehicles.position_m[i, 2] = 0.0
    flight.run(8.0)
    assert "grounded" not in alarms(flight)
    flight.run(5.0)
    assert alarms(flight)["grounded"] == "it came down in GUIDED"


def test_a_landing_and_a_return_are_no_emergency(rig: MakeRig) -> None:
    flight = rig(3).flying().run(5.0)
    assert flight.ask(Land(vehicles=(1,))).ok
    assert flight.ask(m.Return(vehicles=(2,))).ok
    seen: set[int] = set()
    flight.until(
        lambda: seen.update(flight.station.flight.emergencies.found) or not flight.sim.armed[:2].any(), 150.0, "down"
    )
    assert not seen


def test_it_is_not_called_ready(rig: MakeRig) -> None:
    flight = failing(rig(3).flying().run(10.0)).run(8.0)
    two = info(flight)
    assert not two.ready
    assert two.problems[0].text.startswith("EMERGENCY: hit the ground at 1")
    flight.sim._pilots[flight.sim_index[2]].arming.disarm()
    flight.run(3.0)
    two = info(flight)
    assert not two.ready
    assert any("reboot it before it flies" in problem.text for problem in two.problems)


def test_others_keep_clear_below_it(rig: MakeRig) -> None:
    """Vehicle 1 is to fly to a place below vehicle 3, which begins to fall."""
    goal = {1: (140.0, 200.0), 2: (330.0, 260.0), 3: (200.0, 200.0)}

    def places(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        return [Intent(vehicle=v, kind="goto", position_m=(*goal[v], task.layers_m[v])) for v in task.members]

    flight = rig(3, wants=places).flying().run(40.0)
    goal[1] = (260.0, 200.0)
    flight.until(lambda: flight.place(1)[0] > 170.0, 15.0, "on its way below it")
    failing(flight, 3)
    nearest = math.inf
    for _ in range(160):
        flight.run(0.05)
        if flight.place(3)[2] > 0.5:
            nearest = min(nearest, math.dist(flight.place(1), flight.place(3)))
    assert nearest > 8.0
    assert any("guard veto, holding: too close to vehicle 3" in text for text in flight.texts("vehicle 1"))


def test_its_planner_gets_a_fleet_without_it(rig: MakeRig) -> None:
    flight = rig(3).flying().run(10.0)
    lean(flight, 69.0).until(lambda: flight.phase(2) is Phase.TAKEN_OUT, 1.5)
    flight.run(0.3)
    assert flight.frame is not None
    assert flight.frame.phase == (Phase.FLYING, Phase.TAKEN_OUT, Phase.FLYING)
    begin_s = flight.clock.now()
    flight.run(2.0)
    assert not flight.sent_to(2, since_s=begin_s), "its planner goes on with intents for it, and they are not sent"
    assert flight.sent_to(1, since_s=begin_s)


@pytest.mark.long
def test_the_others_of_its_team_share_its_work(rig: MakeRig) -> None:
    """With the real patrol planner: of three slots two are left, evenly spaced, within seconds."""
    flight = rig(3, wants=None).flying()
    flight.until(lambda: slots(flight) == {"1/3", "2/3", "3/3"}, 10.0)
    lean(flight.run(5.0), 69.0)
    flight.until(lambda: slots(flight) == {"1/2", "2/2"}, 3.0, "re-spaced")
    assert flight.station.active.team_controllers["defend"].status().slots == 2
    lean(flight, 0.0).run(RECOVERED_S + 2.0)
    assert slots(flight) == {"1/2", "2/2"}, "it does not come back by itself"


def test_others_keep_clear_of_one_that_hovers_in_an_emergency(rig: MakeRig) -> None:
    """It stays where it is, and the way of vehicle 1, at the same height, leads through that place."""
    goal = {1: (140.0, 200.0), 2: (330.0, 260.0), 3: (200.0, 200.0)}
    height_m = {1: 20.0, 2: 26.0, 3: 32.0}

    def places(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        return [Intent(vehicle=v, kind="goto", position_m=(*goal[v], height_m[v])) for v in task.members]

    flight = rig(3, wants=places).flying().run(40.0)
    lean(flight, 69.0, vehicle=3).run(2.0)
    assert flight.phase(3) is Phase.TAKEN_OUT
    height_m[1], goal[1] = flight.place(3)[2], (260.0, 200.0)
    nearest = math.inf
    for _ in range(500):
        flight.run(0.1)
        nearest = min(nearest, math.dist(flight.place(1), flight.place(3)))
    assert nearest > flight.station.active.scenario.limits.separation_horizontal_m - 1.0, nearest


def test_a_veto_does_not_claim_that_a_moving_vehicle_holds(rig: MakeRig) -> None:
    """Set-points are refused, and it moves on all the same, as a falling one or one led by another station does."""
    flight = rig(3).flying().run(40.0)
    one = flight.station.flight.flights.by_id[2]
    one.vetoed = "too close to vehicle 1"
    finder = flight.station._alarm_finder
    found = {f.cause: f.action for f in chain.from_iterable(finder.findings(0.2)) if f.subject == 2}
    assert found["vetoed"] == "", "it stands: it holds, as the advice of the cause says"
    i = flight.sim_index[2]
    flight.sim._vehicles.velocity_m_s[i, 0] = 6.0
    flight.run(0.3)
    one.vetoed = "too close to vehicle 1"
    found = {f.cause: f.action for f in chain.from_iterable(finder.findings(0.2)) if f.subject == 2}
    assert "does NOT hold" in found["vetoed"]


@pytest.mark.parametrize(("action", "text"), [(0, "it is outside of its own fence"), (1, "RTL: Circle fence breached")])
def test_a_fence_breach_on_board_is_a_warning(rig: MakeRig, action: int, text: str) -> None:
    """It was a caution, "left the mission", or nothing where the fence only reports (FENCE_ACTION 0)."""
    flight = rig(3).flying().run(10.0)
    params = flight.sim._pilots[flight.sim_index[2]].platform.params
    for name, value in {"FENCE_TYPE": 2, "FENCE_RADIUS": 30, "FENCE_ACTION": action, "FENCE_ENABLE": 1}.items():
        params.set(name, float(value))
    flight.run(6.0)
    raised = {alarm.cause: alarm for alarm in flight.station.alarms.alarms()}
    assert raised["fence"].level is AlarmLevel.WARNING and raised["fence"].vehicles == (2,)
    assert alarms(flight)["fence"] == text


@pytest.mark.parametrize(("action", "cause"), [(1, "fence"), (3, "failsafe")])
def test_a_fence_breach_on_board_of_a_px4_is_a_warning_too(rig: MakeRig, action: int, cause: str) -> None:
    """With GF_ACTION 1 it only reports the breach, once, and that was a caution. With 3 it returns."""
    flight = rig(3, autopilots="px4").flying().run(10.0)
    pilot, here = flight.sim._pilots[flight.sim_index[2]], flight.station.picture.fleet.vehicles[2].telemetry
    pilot.platform.params.set("GF_ACTION", float(action))
    lat, lon = round(1e7 * here.lat_deg) - 10_000, round(1e7 * here.lon_deg)
    pilot.platform.plans.in_force = [[Item(CIRCLE_IN, p1=30.0, x=lat, y=lon)]]
    pilot.fence.changed()
    flight.run(4.0)
    raised = {alarm.cause: alarm for alarm in flight.station.alarms.alarms()}
    assert raised.keys() & {"fence", "failsafe", "report", "left"} == {cause}
    assert raised[cause].level is AlarmLevel.WARNING and raised[cause].vehicles == (2,)
    assert alarms(flight)[cause].endswith("Geofence: approaching or outside geofence")


def test_one_that_another_station_disarms_in_the_air_is_no_landed_one(rig: MakeRig) -> None:
    """Tried with a script that stops motors by force: `vehicle list` called the wreck "ready"."""
    flight = rig(3).flying().run(40.0)
    by_force = MavCommand(400, (0.0, 21196.0)).fields(0) | {"target_system": 2, "target_component": 1}
    other = Encoder(202, 190)
    flight.sim.receive(flight.sim_index[2], other.encode("COMMAND_LONG", **by_force))
    flight.until(lambda: bool([text for text in flight.texts("vehicle 2") if "DISARMED" in text]), 3.0, "noticed")
    (text,) = [text for text in flight.texts("vehicle 2") if "DISARMED" in text]
    assert text.startswith("DISARMED IN THE AIR, ") and text.endswith(" m high: it falls")
    two = info(flight)
    assert not two.ready and any(problem.text.startswith("fell from ") for problem in two.problems)
