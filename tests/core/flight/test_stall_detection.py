"""The station stands still (a stopped process, an overloaded computer) while vehicles fly on: what it does after that.

Seen with a real PX4: stopped for 19 s, the station read old telemetry first, found its planner silent and had a vehicle
hold that was returning by its failsafe, which ended the return.
"""

from collections.abc import Callable

import pytest

from tests.core.rigs.rig import Rig
from tui_gcs.core.flight.stall_detection import HEARS_FIRST_S, StallDetector
from tui_gcs.core.protocol.common import Phase
from tui_gcs.rehearsal.lock_step import TICK_S

MakeRig = Callable[..., Rig]
PX4_RTL, ARDUPILOT_RTL = 0x05040000, 6
SET_MODE, REPOSITION = 176, 192
KEPT_S = 4.0
"""What the operating system keeps of what comes meanwhile; the rest is dropped."""


def orders(flight: Rig, vehicle: int, since_s: float) -> list[int]:
    heard = [f for name in ("COMMAND_LONG", "COMMAND_INT") for _, f in flight.sent_to(vehicle, name, since_s)]
    return [fields["command"] for fields in heard if fields["command"] in (SET_MODE, REPOSITION)]


def stands_still(flight: Rig, seconds: float, failsafe: Callable[[], None] = lambda: None) -> None:
    """Vehicles fly on; `failsafe` comes when the station has been silent for half of the time."""
    began_s, acts = flight.clock.now(), [failsafe]
    while (past_s := flight.clock.now() - began_s) < seconds:
        if acts and past_s > seconds / 2:
            acts.pop()()
        flight.clock.advance(TICK_S)
        flight.sim.step(TICK_S)
        for index, data in flight.sim.drain():
            if past_s < KEPT_S:
                flight.link.inject(data, ("sim", index))


@pytest.mark.long
@pytest.mark.parametrize("autopilots", ["px4", "ardupilot"])
def test_nobody_who_returns_by_its_failsafe_is_held(rig: MakeRig, autopilots: str) -> None:
    flight = rig(2, autopilots=autopilots).flying().run(5.0)
    pilot = flight.sim._pilots[1]

    def failsafe() -> None:
        if autopilots == "px4":
            pilot.failsafes.engage("gcs", PX4_RTL, hold_s=0.0)
        else:
            pilot.platform.state.failsafes.add("gcs")
            pilot.failsafes.act("GCS Failsafe", ARDUPILOT_RTL)

    flight.planning = False
    flight.end_planners()
    began_s = flight.clock.now()
    stands_still(flight, 19.0, failsafe)
    flight.run(12.0)
    assert orders(flight, 2, began_s) == []
    assert flight.phase(2) is Phase.TAKEN_OUT


def test_who_waited_holds_until_an_operator_resumes_and_is_told_why(rig: MakeRig) -> None:
    flight = rig(2).flying().run(5.0)
    stands_still(flight, 8.0)
    flight.run(HEARS_FIRST_S - 2 * TICK_S)
    assert flight.phases() == {Phase.FLYING}
    flight.run(1.0)
    assert flight.phases() == {Phase.HOLDING}
    reported = [text for text in flight.texts("station") if "computer overloaded" in text]
    assert reported == ["2 vehicles hold: computer overloaded? 8.1 s stall"]
    assert flight.alerts() == [], "its planner is not to blame"


def test_a_short_pause_changes_nothing(rig: MakeRig) -> None:
    flight = rig(2).flying().run(5.0)
    stands_still(flight, 1.5)
    flight.run(5.0)
    assert flight.phases() == {Phase.FLYING}


def test_a_pause_is_over_once_the_vehicles_were_heard() -> None:
    pauses = StallDetector()
    assert [pauses.is_over(t) for t in (100.0, 100.1, 103.0, 103.1, 104.4)] == [False] * 5
    assert pauses.catches_up
    assert [pauses.is_over(t) for t in (104.6, 104.7)] == [True, False]
    assert not pauses.catches_up
    assert pauses.lasted_s == pytest.approx(2.9)
