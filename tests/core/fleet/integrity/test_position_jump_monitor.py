"""Positions that jump: found, reported while they are doubtful, and not used for leading a vehicle."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.rig import Rig
from tests.core.rigs.vehicles import a_vehicle
from tui_gcs.core.fleet.integrity.position_jump_monitor import PositionJumpMonitor
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flights import HoldStep
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase, Vec3

MakeRig = Callable[..., Rig]


class Flown:
    """A vehicle that tells where it is."""

    def __init__(self) -> None:
        self.vehicle: Vehicle = a_vehicle(1)
        self.vehicle.telemetry.armed, self.vehicle.telemetry.landed_state = True, 2
        self.watch = PositionJumpMonitor()

    def tells(self, boot_ms: int, place_m: Vec3, velocity_m_s: Vec3 = (0.0, 0.0, 0.0)) -> list[int]:
        """How far it jumped by that, in metres."""
        east, north, up = (round(100 * v) for v in velocity_m_s)
        self.vehicle.telemetry.fix = (boot_ms, 520_000_000, 0, 0, 0, north, east, -up, 0)
        self.vehicle.telemetry.position_m = place_m
        return [round(far_m) for _, far_m in self.watch.look([self.vehicle])]


def test_flight_is_no_jump_however_fast_and_with_gaps() -> None:
    flown, x = Flown(), 0.0
    for boot_ms in (1000, 1200, 1400, 3400):
        x = 0.02 * (boot_ms - 1000)
        assert flown.tells(boot_ms, (x, 0.0, 30.0), (20.0, 0.0, 0.0)) == []
    assert flown.tells(5400, (x + 20.0, 0.0, 30.0)) == [], "it braked from 20 m/s within two seconds"
    assert flown.watch.off_m(1) == 0.0


@pytest.mark.parametrize("jump_m", [(0.0, 67.0, 0.0), (0.0, 0.0, 20.0)])
def test_a_jump_counts_until_it_jumps_back(jump_m: Vec3) -> None:
    flown, (_, y, z) = Flown(), jump_m
    flown.tells(1000, (10.0, 0.0, 30.0))
    assert flown.tells(1200, (10.0, y, 30.0 + z)) == [round(y + z)]
    assert flown.tells(1400, (12.0, y, 30.0 + z), (10.0, 0.0, 0.0)) == []
    assert flown.watch.off_m(1) == pytest.approx(y + z)
    assert flown.tells(1600, (14.0, 0.0, 30.0), (10.0, 0.0, 0.0)) == [round(y + z)], "it is where it was again"
    assert flown.watch.off_m(1) == 0.0


def test_down_or_rebooted_it_begins_anew() -> None:
    flown = Flown()
    flown.tells(1000, (10.0, 0.0, 30.0))
    assert flown.tells(1200, (90.0, 0.0, 30.0)) == [80]
    assert flown.tells(100, (20.0, 0.0, 30.0)) == [] and flown.watch.off_m(1) == 0.0
    assert flown.tells(300, (90.0, 0.0, 30.0)) == [70]
    flown.vehicle.telemetry.armed = False
    assert flown.tells(500, (0.0, 0.0, 0.0)) == [] and flown.watch.off_m(1) == 0.0


def test_after_a_long_gap_nothing_can_be_said() -> None:
    flown = Flown()
    flown.tells(1000, (10.0, 0.0, 30.0))
    assert flown.tells(4000, (90.0, 0.0, 30.0)) == []


def test_a_new_station_knows_who_jumped_unless_it_has_landed_or_booted_since() -> None:
    flown = Flown()
    flown.tells(1000, (10.0, 0.0, 30.0))
    flown.tells(1200, (10.0, 67.0, 30.0))
    held = json.loads(json.dumps(flown.watch.memory()))

    def next_station(boot_ms: int, *, armed: bool = True) -> float:
        flown.watch, flown.vehicle.telemetry.armed = PositionJumpMonitor(), armed
        flown.watch.recall(held)
        assert json.loads(json.dumps(flown.watch.memory())) == held, "also when it ends before it heard anybody"
        assert flown.tells(boot_ms, (180.0, 67.0, 30.0)) == [], "it flew on meanwhile: that is no jump"
        return flown.watch.off_m(1)

    assert next_station(60_000) == pytest.approx(67.0)
    assert flown.tells(60_200, (180.0, 0.0, 30.0)) == [67] and flown.watch.off_m(1) == 0.0, "and back again"
    assert next_station(900) == 0.0, "it booted"
    assert next_station(60_000, armed=False) == 0.0, "it landed"
    flown.vehicle.telemetry.armed = True
    assert flown.tells(60_200, (10.0, 0.0, 30.0)) == [] and flown.watch.off_m(1) == 0.0


def test_that_it_jumped_is_told_by_the_station_after_this_one_too(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(2).flying().run(10.0)
    believes(flight, 0, (0.0, 67.0, 0.0))
    flight.run(4.0)
    StateStore(tmp_path / "memory.json").remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(tmp_path / "memory.json"))
    flight.run(40.0)
    vehicles, text = alarms(flight)["position"]
    assert vehicles == (1,) and text.startswith("it jumped by ")


def believes(flight: Rig, index: int, off_m: Vec3) -> None:
    """What a glitch of its GPS makes it believe."""
    flight.sim._vehicles.weather.noisy = True
    flight.sim._vehicles.weather.gps_error_m[index] = off_m


def alarms(flight: Rig) -> dict[str, tuple[tuple[int, ...], str]]:
    return {
        alarm.cause: (alarm.vehicles, alarm.text) for alarm in flight.station.alarms.alarms() if alarm.state != "over"
    }


@pytest.mark.long
@pytest.mark.parametrize("off_m", [(0.0, 67.0, 0.0), (0.0, 30.0, 0.0), (0.0, 0.0, 20.0)])
def test_who_jumps_is_not_led_on_and_is_told_of(rig: MakeRig, off_m: Vec3) -> None:
    """As flown: its planner led a real ArduCopter on, 67 m beside what the map showed, and no alarm was left."""
    flight = rig(2).flying().run(10.0)
    believes(flight, 0, off_m)
    flight.run(4.0)
    assert [flight.phase(1), flight.phase(2)] == [Phase.HOLDING, Phase.FLYING]
    assert flight.station.flight.flights.by_id[1].stays == "its position jumped"
    far = round(sum(off_m))
    cause, words = ("height", f"it jumped up by {far} m: it may be so much lower than it reports")
    if not off_m[2]:
        cause, words = "position", f"it jumped by {far} m"
    assert alarms(flight)[cause] == ((1,), words)
    assert any(f"its position jumped by {far} m" in text for text in flight.texts("vehicle 1"))
    (result,) = flight.ask(m.Resume()).results
    assert result.text == "its position jumped: resume it by name", "not with all the others"
    believes(flight, 0, (0.0, 0.0, 0.0))
    flight.run(8.0)
    assert cause not in alarms(flight)
    assert flight.phase(1) is Phase.HOLDING, "until an operator gives it back"


def test_who_returns_by_an_operator_s_order_goes_on(rig: MakeRig) -> None:
    flight = rig(2).flying().run(10.0)
    assert flight.ask(m.Return(vehicles=(1,))).ok
    flight.run(1.0)
    believes(flight, 0, (0.0, 30.0, 0.0))
    flight.run(3.0)
    assert flight.phase(1) is Phase.RETURNING
    assert alarms(flight)["position"][0] == (1,)


def test_who_holds_already_is_told_to_hold_where_it_is_now(rig: MakeRig) -> None:
    """It holds at a place: after a jump it would fly back to that, as far beside what is true."""
    flight = rig(2).flying().run(10.0)
    assert flight.ask(m.Hold(vehicles=(1,))).ok
    flight.run(10.0)
    _, before_m, _ = flight.station.picture.fleet.vehicles[1].telemetry.position_m
    believes(flight, 0, (0.0, 30.0, 0.0))
    flight.run(10.0)
    assert flight.phase(1) is Phase.HOLDING
    assert flight.station.picture.fleet.vehicles[1].telemetry.position_m[1] > before_m + 28.0, (
        "where it says that it is, it stays"
    )
    believes(flight, 0, (0.0, 0.0, 0.0))
    flight.run(5.0)
    back_m = flight.station.picture.fleet.vehicles[1].telemetry.position_m[1]
    assert any(text.startswith("its position jumped back by ") for text in flight.texts("vehicle 1"))
    flight.run(8.0)
    assert abs(flight.station.picture.fleet.vehicles[1].telemetry.position_m[1] - back_m) < 1.0, (
        "and after it jumped back, too"
    )


def test_who_was_found_in_the_air_is_sent_nothing_for_a_jump(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(2).flying().run(10.0)
    memory = StateStore(tmp_path / "memory.json")
    memory.remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(tmp_path / "memory.json"))
    flight.run(10.0)
    assert flight.station.flight.flights.by_id[1].step is HoldStep.FOUND
    believes(flight, 0, (0.0, 30.0, 0.0))
    since_s = flight.clock.now()
    flight.run(3.0)
    assert flight.sent_to(1, since_s=since_s) == []
    assert flight.station.flight.flights.by_id[1].stays == "its position jumped"
