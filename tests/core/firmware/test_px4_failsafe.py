"""A PX4 whose own failsafe takes over: it holds for COM_FAIL_ACT_T, then does what it must. Nobody takes that back.

Seen on the real 1.16.1 beyond its GF_MAX_HOR_DIST: 2.9 s after its Hold began the guard vetoed its course ("moves
otherwise than it does"), the station's hold counted as a pilot's, and OFFBOARD after it led on outside of its fence.
"""

from collections.abc import Callable

import pytest

from tests.core.rigs.rig import Rig
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase

MakeRig = Callable[..., Rig]
HOLD, OFFBOARD, RTL = 0x03040000, 0x060000, 0x05040000
SET_MODE, REPOSITION = 176, 192


def orders(flight: Rig, vehicle: int, since_s: float) -> list[int]:
    """What a vehicle was told to do."""
    heard = [f for name in ("COMMAND_LONG", "COMMAND_INT") for _, f in flight.sent_to(vehicle, name, since_s)]
    return [fields["command"] for fields in heard if fields["command"] in (SET_MODE, REPOSITION)]


def on_patrol(rig: MakeRig) -> Rig:
    flight = rig(2, wants=None, autopilots="px4").flying()
    flight.until(
        lambda: all(f.joined for f in flight.station.flight.flights) and flight.speed(2) > 7.0, 60.0, "on slot, fast"
    )
    return flight


def mode(flight: Rig, vehicle: int) -> int:
    return flight.station.picture.fleet.vehicles[vehicle].telemetry.custom_mode


@pytest.mark.long
@pytest.mark.parametrize("hold_s", [5.0, 2.0])
def test_its_own_failsafe_is_not_taken_back(rig: MakeRig, hold_s: float) -> None:
    flight = on_patrol(rig)
    began_s = flight.clock.now()
    flight.sim._pilots[1].failsafes.engage("fence", RTL, hold_s=hold_s)
    flight.run(12.0)
    assert orders(flight, 2, began_s) == []
    assert mode(flight, 2) == RTL
    assert flight.phase(2) is Phase.TAKEN_OUT
    assert flight.phase(1) is Phase.FLYING


@pytest.mark.long
def test_a_veto_that_goes_on_does_not_take_it_back_either(rig: MakeRig) -> None:
    """From the first moment on: what the guard vetoes is not said, and a hold would end the failsafe."""
    flight = on_patrol(rig)
    began_s = flight.clock.now()
    flight.sim._pilots[1].failsafes.engage("fence", RTL, hold_s=5.0)
    flight.until(lambda: mode(flight, 2) == HOLD, 2.0)
    flight.plan(m.Intent(vehicle=2, kind="goto", position_m=(-500.0, 200.0, 34.0)))
    flight.planning = False
    flight.end_planners()
    flight.run(12.0)
    assert orders(flight, 2, began_s) == []
    assert mode(flight, 2) == RTL


@pytest.mark.long
def test_on_its_way_to_a_place_it_is_not_sent_there_again(rig: MakeRig) -> None:
    flight = on_patrol(rig)
    assert flight.ask(m.Return()).ok
    flight.run(4.0)
    assert flight.phase(2) is Phase.RETURNING and mode(flight, 2) == HOLD
    began_s = flight.clock.now()
    flight.sim._pilots[1].failsafes.engage("critical", RTL, hold_s=12.0)
    flight.run(15.0)
    assert orders(flight, 2, began_s) == []
    assert mode(flight, 2) == RTL
    assert flight.phase(2) is Phase.TAKEN_OUT


@pytest.mark.long
def test_out_of_a_failsafe_the_operator_flies_it_on(rig: MakeRig) -> None:
    """GF_ACTION 2, as shipped: it holds, out of the team; who resumes it by name has it back."""
    flight = on_patrol(rig)
    flight.sim._pilots[1].platform.params.set("COM_OBL_RC_ACT", 5.0)
    flight.sim._pilots[1].failsafes.engage("fence", HOLD)
    flight.run(6.0)
    assert flight.phase(2) is Phase.TAKEN_OUT and mode(flight, 2) == HOLD
    assert flight.ask(m.Hold(vehicles=(2,))).ok
    assert flight.ask(m.Resume(vehicles=(2,))).ok
    flight.until(lambda: flight.phase(2) is Phase.FLYING and mode(flight, 2) == OFFBOARD, 30.0)


@pytest.mark.long
def test_a_stream_that_was_lost_and_comes_back_goes_on(rig: MakeRig) -> None:
    """No set-point reaches it for 2 s: that failsafe ends with the next one, by itself."""
    flight = on_patrol(rig)
    flight.sim._pilots[1].platform.params.set("COM_OBL_RC_ACT", 5.0)
    flight.loses = lambda way, index: way == "down" and index == 1
    flight.run(2.0)
    flight.loses = lambda way, index: False
    flight.run(8.0)
    assert flight.phase(2) is Phase.FLYING
    assert mode(flight, 2) == OFFBOARD
