"""An ArduCopter whose own failsafe takes over while the guard has it hold: nobody takes that back.

Seen on a real one: it returned by its "Radio Failsafe", and 0.1 s later the next copy of a veto's hold told it BRAKE.
"""

from collections.abc import Callable

import pytest

from tests.core.rigs.rig import Rig
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase

MakeRig = Callable[..., Rig]
SET_MODE, RTL, BRAKE = 176, 6, 17


def outside(frame: m.FleetFrame, task: m.PlannerTask) -> list[m.Intent]:
    """Vehicle 1 is led out of the area: the guard has it hold as soon as it could not brake any more."""
    x = 900.0 if frame.t_s > 0 else 0.0
    return [
        m.Intent(vehicle=v, kind="goto", position_m=(x if v == 1 else 200.0, 200.0 + 20.0 * v, task.layers_m[v]))
        for v in task.members
    ]


def failsafe(flight: Rig, index: int, text: str) -> None:
    pilot = flight.sim._pilots[index]
    pilot.platform.state.failsafes.add("rc")
    pilot.failsafes.act(text, RTL)


def held_by_the_guard(rig: MakeRig) -> Rig:
    flight = rig(2).flying()
    flight.until(lambda: all(flight.speed(v) < 0.3 for v in flight.ids), 60.0, "at their places")
    flight.wants = outside
    flight.until(lambda: bool(flight.station.flight.flights.by_id[1].vetoed), 30.0, "vetoed")
    return flight


@pytest.mark.long
def test_a_hold_that_nobody_asked_for_does_not_take_it_back(rig: MakeRig) -> None:
    flight = held_by_the_guard(rig)
    assert flight.station.comms.commands.stopping(1)
    began_s = flight.clock.now()
    failsafe(flight, 0, "Radio Failsafe")
    flight.run(6.0)
    modes = [f["param2"] for _, f in flight.sent_to(1, "COMMAND_LONG", began_s) if f["command"] == SET_MODE]
    assert modes == []
    assert int(flight.sim.mode[0]) == RTL
    assert flight.phase(1) is Phase.TAKEN_OUT
    assert "left its mode (now RTL): taken out of the mission; it reported: Radio Failsafe" in flight.texts("vehicle 1")


@pytest.mark.long
def test_an_operator_s_hold_stops_it_all_the_same(rig: MakeRig) -> None:
    flight = held_by_the_guard(rig)
    failsafe(flight, 0, "Radio Failsafe")
    flight.run(2.0)
    assert flight.ask(m.Hold(vehicles=(1,))).ok
    flight.run(6.0)
    assert int(flight.sim.mode[0]) == BRAKE
