"""Every order of guided flight, on every autopilot that is flown: what leaves, and what must show before it is done."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.core.motion.test_target_place import home_position
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Fields, Peer, ServiceRig
from tui_gcs.core.firmware.base import Firmware
from tui_gcs.core.firmware.px4_offboard import LEAD_IN_S
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import PASS
from tui_gcs.core.motion.course import STILL
from tui_gcs.core.motion.orbit import Orbit
from tui_gcs.core.uplink.actions import Outcome, VehicleAction

SET_MODE, ARM, TAKE_OFF, REPOSITION, MISSION_START = 176, 400, 22, 192, 300
FRAME_GLOBAL_INT = 5
SETPOINT = "SET_POSITION_TARGET_GLOBAL_INT"
COPTER = {"GUIDED": 4, "AUTO": 3, "RTL": 6, "LAND": 9, "BRAKE": 17}
QUAD = {"HOLD": 0x03040000, "MISSION": 0x04040000, "RTL": 0x05040000, "LAND": 0x06040000, "OFFBOARD": 0x060000}
BOTH = pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])


def obeys(peer: Peer, fields: Fields) -> None:
    """A vehicle that does what it is told, and shows it."""
    command = fields["command"]
    if command == SET_MODE and peer.autopilot == PX4:
        peer.ack(SET_MODE)
        peer.custom_mode = int(fields["param2"]) << 16 | int(fields["param3"]) << 24
    elif command == SET_MODE:
        peer.custom_mode = int(fields["param2"])
    elif command == ARM:
        peer.armed = fields["param1"] == 1
    elif command == TAKE_OFF:
        peer.after(1.0, lambda: setattr(peer, "alt_rel_mm", 3_000))
    peer.ack(command)


def flown(tmp_path: Path, autopilot: int, *, up: bool = True) -> ServiceRig:
    """One vehicle, 20 m up or on the ground, in the mode in which it takes our orders."""
    mode = QUAD["HOLD"] if autopilot == PX4 else COPTER["GUIDED"]
    answers = {"COMMAND_LONG": obeys, "COMMAND_INT": obeys}
    peer = Peer(1, autopilot, custom_mode=mode, armed=up, alt_rel_mm=20_000 * up, answers=answers)
    rig = ServiceRig(tmp_path, peer).heard()
    peer.say("HOME_POSITION", **home_position())
    return rig.run(1.5)


def firmware(rig: ServiceRig) -> Firmware:
    return rig.station.comms.firmware.of(rig.vehicle())


def carried_out(rig: ServiceRig, action: VehicleAction, limit_s: float = 12.0) -> Outcome:
    """Submit it, and let time pass until it is over."""
    ended: list[Outcome] = []
    action.on_done = lambda _, outcome, why: ended.append(outcome)
    rig.station.comms.commands.submit(action)
    rig.until(lambda: bool(ended), limit_s, action.name)
    return ended[0]


def nobody(action: VehicleAction, outcome: Outcome, why: str) -> None:
    """Whoever is told how it ended."""


def orders(rig: ServiceRig, command: int) -> list[Fields]:
    return [f for _, name, f in rig.peers[1].heard if name.startswith("COMMAND_") and f.get("command") == command]


@BOTH
def test_armed_up_and_disarmed(tmp_path: Path, autopilot: int) -> None:
    rig = flown(tmp_path, autopilot, up=False)
    flies, one = firmware(rig), rig.vehicle()
    assert carried_out(rig, flies.arm(one, nobody)) is Outcome.CONFIRMED and one.telemetry.armed
    assert carried_out(rig, flies.take_off(one, 12.0, nobody)) is Outcome.CONFIRMED
    assert orders(rig, TAKE_OFF)[0]["param7"] == pytest.approx(12.0 + (488.0 if autopilot == PX4 else 0.0), abs=0.1)
    rig.peers[1].alt_rel_mm = 0
    rig.run(1.0)
    assert carried_out(rig, flies.disarm(one)) is Outcome.CONFIRMED and not one.telemetry.armed


Make = Callable[[Firmware, Vehicle], VehicleAction]
MODES: list[tuple[str, Make, str, str]] = [
    ("land", lambda f, v: f.land(v), "LAND", "LAND"),
    ("mission start", lambda f, v: f.mission_start(v), "AUTO", "MISSION"),
    ("mission continue", lambda f, v: f.mission_continue(v), "AUTO", "MISSION"),
]


@BOTH
@pytest.mark.parametrize(("name", "make", "copter", "quad"), MODES, ids=lambda value: str(value)[:16])
def test_orders_that_are_modes(tmp_path: Path, autopilot: int, name: str, make: Make, copter: str, quad: str) -> None:
    rig = flown(tmp_path, autopilot)
    wanted = QUAD[quad] if autopilot == PX4 else COPTER[copter]
    if wanted == rig.peers[1].custom_mode:
        rig.peers[1].custom_mode = QUAD["MISSION"]
        rig.run(1.5)
    assert carried_out(rig, make(firmware(rig), rig.vehicle())) is Outcome.CONFIRMED
    assert rig.vehicle().telemetry.custom_mode == wanted


def test_a_px4_on_the_ground_is_told_to_start_its_mission_and_not_to_change_its_mode(tmp_path: Path) -> None:
    rig = flown(tmp_path, PX4, up=False)
    rig.station.comms.commands.submit(firmware(rig).mission_start(rig.vehicle()))
    rig.run(0.2)
    assert len(orders(rig, MISSION_START)) == 1 and orders(rig, SET_MODE) == []


@BOTH
def test_hold_is_confirmed_by_what_it_does(tmp_path: Path, autopilot: int) -> None:
    rig = flown(tmp_path, autopilot)
    peer = rig.peers[1]
    peer.north_cm_s = 300
    rig.run(1.0)
    action = firmware(rig).hold(rig.vehicle(), lambda: (0.0, 0.0, 20.0))
    ended: list[Outcome] = []
    action.on_done = lambda _, outcome, why: ended.append(outcome)
    rig.station.comms.commands.submit(action)
    rig.run(3.0)
    assert ended == [], "it moves"
    peer.north_cm_s = 0
    rig.until(lambda: ended == [Outcome.CONFIRMED], 4.0)


def said(rig: ServiceRig, each: Callable[[float], None], seconds: float) -> list[dict[str, Any]]:
    """The set-points that left while `each` was called as steering does."""
    begin_s, flies = rig.clock.now(), firmware(rig)
    while rig.clock.now() - begin_s < seconds:
        each(rig.clock.now())
        rig.run(flies.setpoint_gap_s)
    return rig.peers[1].got(SETPOINT)


@BOTH
def test_a_velocity_is_one_and_no_place(tmp_path: Path, autopilot: int) -> None:
    rig = flown(tmp_path, autopilot)
    points = said(rig, lambda now: firmware(rig).fly(rig.vehicle(), (1.0, 2.0, 0.5), PASS), LEAD_IN_S + 2.0)
    assert {(f["vx"], f["vy"], f["vz"], f["type_mask"] & 0x7) for f in points} == {(2.0, 1.0, -0.5, 7)}
    assert rig.vehicle().telemetry.custom_mode == (QUAD["OFFBOARD"] if autopilot == PX4 else COPTER["GUIDED"])


@BOTH
def test_an_orbit_is_a_moving_reference(tmp_path: Path, autopilot: int) -> None:
    rig = flown(tmp_path, autopilot)
    one, flies = rig.vehicle(), firmware(rig)
    x, y, z = one.telemetry.position_m
    orbit = Orbit.about(rig.clock.now(), one.telemetry.position_m, (x, y, z), 20.0, 5.0, 2.5)

    def follow(now: float) -> None:
        flies.follow(one, *orbit.at(now), PASS, STILL)

    points = said(rig, follow, 40.0)
    later = points[len(points) // 2 :]
    frame = rig.station.picture.fleet.frame
    places = [frame.to_enu(f["lat_int"] / 1e7, f["lon_int"] / 1e7) for f in later]
    assert {round(math.dist((x, y), place), 1) for place in places} == {20.0}
    assert {round(math.hypot(f["vx"], f["vy"]), 2) for f in later} == {5.0}
    heights_m = {f["alt"] - (488.0 if f["coordinate_frame"] == FRAME_GLOBAL_INT else 0.0) for f in later}
    assert heights_m == {z}, "whichever height the frame means"
