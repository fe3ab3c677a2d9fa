"""What the station says, remembers and allows at its edges: restarts, last words, words of a planner."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from tests.core.rigs.rig import SETPOINT, Rig, scenario
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import FleetFrame, Intent, Phase, PlannerTask, RunPhase

pytestmark = pytest.mark.long  # nearly each is a flight

MakeRig = Callable[..., Rig]
LOITER, BRAKE = 5, 17
HOUSEKEEPING = {511, 512}
"""Requests for rates and for information."""


# ---------------------------------------------------------------- restarts that go on by themselves


def resuming(rig: MakeRig) -> Rig:
    """Three vehicles fly a scenario that says `resume = true`."""
    whole = scenario(3)
    loss = msgspec.structs.replace(whole.link_loss, resume=True)
    return rig(mission=msgspec.structs.replace(whole, link_loss=loss)).flying().run(8.0)


def restarted(flight: Rig, path: Path) -> Rig:
    StateStore(path).remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(path))
    return flight


def test_after_hold_all_a_vehicle_found_later_does_not_go_on_by_itself(rig: MakeRig, tmp_path: Path) -> None:
    flight = resuming(rig)
    flight.sim.silence(2)
    restarted(flight, tmp_path / "memory.json")
    flight.until(lambda: flight.phase(1) is flight.phase(2) is Phase.FLYING, 40.0)
    assert flight.ask(m.Hold()).ok
    flight.run(10.0)
    flight.sim.unsilence(2)
    flight.run(20.0)
    assert flight.phase(3) is Phase.HOLDING
    assert flight.station.flight.executive.run is RunPhase.HOLD
    assert flight.speed(3) < 0.3
    assert flight.phase(1) is flight.phase(2) is Phase.HOLDING


@pytest.mark.parametrize("mode", [LOITER, BRAKE])
def test_a_vehicle_found_in_another_mode_than_guided_does_not_go_on(rig: MakeRig, tmp_path: Path, mode: int) -> None:
    flight = resuming(rig)
    flight.pilot(2, mode)
    flight.run(2.0)
    killed_s = flight.clock.now()
    restarted(flight, tmp_path / "memory.json").run(9.0)
    assert flight.place(2)[2] > 2.0, "still in the air (in LOITER without a radio it sinks)"
    assert int(flight.sim.mode[1]) == mode
    assert {f["command"] for _, f in flight.sent_to(2, "COMMAND_LONG", killed_s)} <= HOUSEKEEPING
    assert not flight.sent_to(2, SETPOINT, killed_s)
    assert flight.phase(2) in (Phase.HOLDING, Phase.TAKEN_OUT)
    assert flight.phase(1) is flight.phase(3) is Phase.FLYING


@pytest.mark.parametrize("resume", [True, False])
def test_a_vehicle_remembered_in_the_air_that_is_silent_is_named(rig: MakeRig, tmp_path: Path, resume: bool) -> None:
    flight = resuming(rig) if resume else rig(3).flying().run(8.0)
    flight.sim.silence(2)
    restarted(flight, tmp_path / "memory.json").run(10.0)
    assert "vehicle 3" in flight.station.publisher.status().alarm
    flight.sim.unsilence(2)
    flight.run(10.0)
    alarm = flight.station.publisher.status().alarm
    assert "LOST" not in alarm or "(over)" in alarm, "nobody has acknowledged it, so it stays as what it was"


# ---------------------------------------------------------------- a planner's words


SLOTS = ("\x1b]0;owned\x07", "\x1b[31m1/4", "[red]1/4[/]", "\u202e4/1", "1\n/\t4", "x" * 99)


def test_what_a_planner_calls_a_slot_is_cleaned(rig: MakeRig) -> None:
    given, seen = [""], set()

    def naming(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        return [Intent(vehicle=1, kind="goto", position_m=(200.0, 200.0, task.layers_m[1]), slot=given[-1])]

    flight = rig(1, wants=naming).flying()
    for slot in SLOTS:
        given.append(slot)
        flight.run(2.0)
        assert flight.frame is not None
        shown = flight.frame.slot[0]
        assert shown and shown.isprintable() and len(shown) <= 12
        assert "\x1b" not in shown and "\u202e" not in shown
        seen.add(shown)
    assert len(seen) == len(SLOTS), "each was shown"


# ---------------------------------------------------------------- the end


def one_lost(rig: MakeRig, *lost: int) -> Rig:
    """Of three vehicles these were lost in the air; the others landed."""
    flight = rig(3).flying().run(5.0)
    for vehicle in lost:
        flight.sim.silence(flight.sim_index[vehicle])
    flight.run(5.0)
    flight.ask(m.Return())
    others = [flight.sim_index[v] for v in flight.ids if v not in lost]
    flight.until(lambda: not flight.sim.armed[others].any(), 120.0)
    return flight.run(3.0)


def test_the_station_does_not_end_while_a_lost_vehicle_was_armed(rig: MakeRig) -> None:
    flight = one_lost(rig, 2)
    reply = flight.ask(m.Shutdown())
    assert not reply.ok and "2" in reply.text
    assert not flight.station.conditions.ending


def test_the_station_ends_for_who_names_the_lost(rig: MakeRig) -> None:
    flight = one_lost(rig, 2)
    assert flight.ask(m.Shutdown(lost=(2,))).ok
    assert flight.station.conditions.ending


def test_the_lost_must_be_named_exactly(rig: MakeRig) -> None:
    flight = one_lost(rig, 2, 3)
    for named in ((1,), (2,), (1, 2, 3), (2, 3, 4)):
        assert not flight.ask(m.Shutdown(lost=named)).ok
    assert not flight.station.conditions.ending
    assert flight.ask(m.Shutdown(lost=(3, 2))).ok


def test_naming_a_vehicle_that_is_heard_does_not_help(rig: MakeRig) -> None:
    flight = rig(2).flying()
    flight.sim.silence(1)
    flight.run(5.0)
    for named in ((2,), (1, 2), (1,), ()):
        reply = flight.ask(m.Shutdown(lost=named))
        assert not reply.ok and "1" in reply.text
    assert not flight.station.conditions.ending
