"""What is said to an ArduCopter, and the traps of docs/autopilots.md, against a scripted one."""

from pathlib import Path

import pytest

from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.firmware.ardupilot import ArduCopter
from tui_gcs.core.guard.permission import PASS
from tui_gcs.core.uplink.actions import RetryClass

LOITER, GUIDED, BRAKE, ALT_HOLD = 5, 4, 17, 2
SET_MODE, SPEED = 176, 178
SETPOINT = "SET_POSITION_TARGET_GLOBAL_INT"


@pytest.fixture
def rig(tmp_path: Path) -> ServiceRig:
    """A station and one ArduCopter in the air, in GUIDED, that obeys nothing."""
    peer = Peer(custom_mode=GUIDED, armed=True)
    flown = ServiceRig(tmp_path, peer).heard()
    peer.say("EXTENDED_SYS_STATE", vtol_state=0, landed_state=2)
    return flown.run(1.5)


def firmware(rig: ServiceRig) -> ArduCopter:
    found = rig.station.comms.firmware.of(rig.vehicle())
    assert isinstance(found, ArduCopter)
    return found


def modes(rig: ServiceRig) -> list[float]:
    return [f["param2"] for f in rig.peers[1].got("COMMAND_LONG") if f["command"] == SET_MODE]


@pytest.mark.parametrize("mode", [-1, 256, 262])
def test_a_mode_that_would_be_cut_to_another_one_is_never_sent(rig: ServiceRig, mode: int) -> None:
    """262 is taken as 6: RTL."""
    with pytest.raises(ValueError, match="no mode"):
        firmware(rig).mode(rig.vehicle(), mode, "mode", RetryClass.SET)


@pytest.mark.parametrize("mode", [LOITER, ALT_HOLD, BRAKE, 3, 6, 9])
def test_hold_out_of_any_other_mode_is_brake_and_never_a_mode_that_reads_a_stick(rig: ServiceRig, mode: int) -> None:
    rig.peers[1].custom_mode = mode
    rig.until(lambda: rig.vehicle().telemetry.custom_mode == mode, 2.0)
    rig.station.comms.commands.submit(firmware(rig).hold(rig.vehicle(), lambda: (0.0, 0.0, 20.0)))
    rig.run(2.0)
    assert set(modes(rig)) == {BRAKE}
    assert rig.peers[1].got(SETPOINT) == []


def test_hold_in_guided_is_one_place_above_home(rig: ServiceRig) -> None:
    rig.station.comms.commands.submit(firmware(rig).hold(rig.vehicle(), lambda: (5.0, 6.0, 20.0)))
    rig.run(1.0)
    said = rig.peers[1].got(SETPOINT)
    assert modes(rig) == [] and {(f["coordinate_frame"], f["type_mask"], f["alt"]) for f in said} == {(6, 0xDF8, 20.0)}


def test_our_speed_is_set_after_the_place_and_only_when_it_begins(rig: ServiceRig) -> None:
    for anew in (True, False, False):
        firmware(rig).go_to(rig.vehicle(), (50.0, 0.0, 20.0), 6.0, PASS, anew=anew)
        rig.run(0.1)
    names = [n for _, n, f in rig.peers[1].heard if n == SETPOINT or f.get("command") == SPEED]
    assert names == [SETPOINT, "COMMAND_LONG", SETPOINT, SETPOINT]


@pytest.mark.parametrize(("status", "why"), [(0, "still booting"), (1, "still booting"), (3, ""), (5, "")])
def test_before_it_is_ready_orders_are_acknowledged_and_lost_so_none_is_given(
    rig: ServiceRig, status: int, why: str
) -> None:
    rig.vehicle().telemetry.system_status = status
    assert firmware(rig).start_problem(rig.vehicle()) == why


def test_no_terrain_frame_is_ever_used(rig: ServiceRig) -> None:
    """Without terrain data it would sink into the ground."""
    one, ardu = rig.vehicle(), firmware(rig)
    ardu.follow(one, (1.0, 2.0, 20.0), (3.0, 0.0, 0.0), PASS)
    ardu.fly(one, (3.0, 0.0, 0.0), PASS)
    ardu.go_to(one, (1.0, 2.0, 20.0), 5.0, PASS, anew=True)
    rig.run(0.1)
    said = rig.peers[1].got(SETPOINT)
    assert [f["type_mask"] for f in said] == [0xDC0, 0xDC7, 0xDF8]
    assert {f["coordinate_frame"] for f in said} == {6}
    assert (said[0]["vx"], said[0]["vy"], said[0]["vz"]) == (0.0, 3.0, 0.0), "north, east, down"


def test_out_of_guided_it_is_not_steerable(rig: ServiceRig) -> None:
    one, ardu = rig.vehicle(), firmware(rig)
    assert ardu.is_steerable(one) and ardu.is_holding(one) and ardu.engage(one) is None
    one.telemetry.custom_mode = LOITER
    assert not ardu.is_steerable(one) and not ardu.is_holding(one)
    order = ardu.engage(one)
    assert order is not None and order.name == "mode GUIDED"
