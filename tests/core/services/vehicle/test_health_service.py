"""Could it arm, and if not, why: from what both real autopilots were measured to say."""

import math
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.service_rig import PX4, Peer, ServiceRig
from tui_gcs.core.base.text import SafeText
from tui_gcs.core.firmware.health import HealthProblem
from tui_gcs.core.services.vehicle.health_service import Health
from tui_gcs.core.services.vehicle.vehicle_events import ArmingCheck, ArmingReport

ALL, PREARM = 0x1120FFFF, 0x10000000
HOLD, OFFBOARD = 0x3040000, 0x60000
HOLD_BIT = 1 << 4
SYS: dict[str, Any] = {
    "onboard_control_sensors_present": ALL,
    "onboard_control_sensors_enabled": ALL,
    "onboard_control_sensors_health": ALL,
    "load": 0,
    "voltage_battery": 12600,
    "current_battery": 0,
    "battery_remaining": 100,
    "drop_rate_comm": 0,
    "errors_comm": 0,
    "errors_count1": 0,
    "errors_count2": 0,
    "errors_count3": 0,
    "errors_count4": 0,
}
GPS: dict[str, Any] = {
    "time_usec": 0,
    "fix_type": 6,
    "lat": 473_977_000,
    "lon": 85_456_000,
    "alt": 488_000,
    "eph": 121,
    "epv": 200,
    "vel": 0,
    "cog": 0,
    "satellites_visible": 10,
}
EKF: dict[str, Any] = {
    "flags": 831,
    "velocity_variance": 0.05,
    "pos_horiz_variance": 0.05,
    "pos_vert_variance": 0.05,
    "compass_variance": 0.05,
    "terrain_alt_variance": 0.0,
}
ESTIMATOR: dict[str, Any] = {
    "time_usec": 0,
    "flags": 0x33F,
    "vel_ratio": 0.1,
    "pos_horiz_ratio": 0.1,
    "pos_vert_ratio": 0.1,
    "mag_ratio": 0.1,
    "hagl_ratio": 0.0,
    "tas_ratio": 0.0,
    "pos_horiz_accuracy": 1.0,
    "pos_vert_accuracy": 1.0,
}
BATTERY: dict[str, Any] = {
    "id": 0,
    "battery_function": 0,
    "type": 0,
    "temperature": 32767,
    "voltages": [12600] + [65535] * 9,
    "current_battery": 0,
    "current_consumed": 0,
    "energy_consumed": -1,
    "battery_remaining": 90,
    "time_remaining": 0,
    "charge_state": 1,
}
HOME: dict[str, Any] = {
    "latitude": 473_977_000,
    "longitude": 85_456_000,
    "altitude": 488_000,
    "x": 0.0,
    "y": 0.0,
    "z": 0.0,
    "q": [math.nan] * 4,
    "approach_x": 0.0,
    "approach_y": 0.0,
    "approach_z": 0.0,
}
STICKS: dict[str, Any] = {
    "time_boot_ms": 0,
    "chancount": 16,
    **{f"chan{i}_raw": 1500 for i in range(1, 19)},
    "rssi": 255,
}
GUIDED, LOITER, STABILIZE, AUTO = 4, 5, 0, 3


def healthy(tmp_path: Path, peer: Peer, **changed: dict[str, Any]) -> ServiceRig:
    """A vehicle that would arm; `changed` are fields of messages by name, e.g. EKF={"flags": 0}."""
    tmp_path.mkdir(exist_ok=True)
    rig = ServiceRig(tmp_path, peer).heard()
    say = {"SYS_STATUS": SYS, "GPS_RAW_INT": GPS, "BATTERY_STATUS": BATTERY, "HOME_POSITION": HOME}
    say |= {"ESTIMATOR_STATUS": ESTIMATOR} if peer.autopilot == PX4 else {"EKF_STATUS_REPORT": EKF}
    say |= {"RC_CHANNELS": STICKS}
    for name, fields in say.items():
        if changed.get(name) != {}:
            peer.say(name, **(fields | changed.get(name, {})))
    return rig.run(0.2)


def judge(rig: ServiceRig) -> Health:
    return rig.station.services.health.of(rig.vehicle())


def blocking(rig: ServiceRig) -> list[str]:
    return [problem.text for problem in judge(rig).problems if problem.blocks]


@pytest.mark.parametrize(
    "peer", [Peer(1, custom_mode=GUIDED), Peer(1, autopilot=PX4, custom_mode=HOLD)], ids=["ap", "px4"]
)
def test_a_healthy_vehicle_is_ready(tmp_path: Path, peer: Peer) -> None:
    rig = healthy(tmp_path, peer)
    assert judge(rig) == Health(True, ())


def test_nothing_heard_is_not_ready(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    assert not judge(rig).ready
    assert "nothing is heard of its sensors (SYS_STATUS)" in blocking(rig)


def test_old_telemetry_does_not_count(tmp_path: Path) -> None:
    rig = healthy(tmp_path, Peer(1, custom_mode=GUIDED))
    rig.run(61.0)
    assert not judge(rig).ready


@pytest.mark.parametrize(
    ("flags", "text"),
    [
        (1024, "EKF is not started"),
        (0, "EKF is not started"),
        (167, "EKF has no position yet: GPS is not used so far"),
        (0x25, "EKF without horizontal velocity, relative position, absolute position, "),
        (0x833F, "GPS glitch: its position may jump to a wrong place within seconds"),
    ],
)
def test_ardupilots_ekf_flags_as_measured(tmp_path: Path, flags: int, text: str) -> None:
    """A GPS fix does not mean ready: the EKF used it 31 s later."""
    rig = healthy(tmp_path, Peer(1, custom_mode=GUIDED), EKF_STATUS_REPORT={"flags": flags})
    assert any(problem.startswith(text) for problem in blocking(rig))


@pytest.mark.parametrize(("mode", "blocks"), [(GUIDED, False), (STABILIZE, True)])
def test_without_ekf_reports_the_checks_of_guided_say_it(tmp_path: Path, mode: int, blocks: bool) -> None:
    """The poor sets of a radio have none."""
    rig = healthy(tmp_path, Peer(1, custom_mode=mode), EKF_STATUS_REPORT={})
    assert HealthProblem("nothing is heard of its EKF", blocks) in judge(rig).problems
    assert judge(rig).ready is not blocks


@pytest.mark.parametrize("value", [1.01, 58.0, math.nan, math.inf])
def test_a_variance_above_one_blocks(tmp_path: Path, value: float) -> None:
    rig = healthy(tmp_path, Peer(1, custom_mode=GUIDED), EKF_STATUS_REPORT={"pos_horiz_variance": value})
    assert [text for text in blocking(rig) if text.startswith("EKF: position")]


def test_the_prearm_bit_of_stabilize_is_not_the_one_of_guided(tmp_path: Path) -> None:
    rig = healthy(tmp_path, Peer(1, custom_mode=STABILIZE))
    assert judge(rig).ready
    assert judge(rig).problems == (
        HealthProblem("its checks are for STABILIZE; those for GUIDED are known in GUIDED only", blocks=False),
    )


def test_failing_prearm_checks_come_with_their_texts(tmp_path: Path) -> None:
    bad = {"onboard_control_sensors_health": ALL & ~PREARM}
    rig = healthy(tmp_path, Peer(1, custom_mode=GUIDED), SYS_STATUS=bad)
    rig.peers[1].say("STATUSTEXT", severity=2, text=b"PreArm: Need Position Estimate")
    rig.peers[1].say("STATUSTEXT", severity=2, text=b"something else")
    rig.run(0.2)
    assert blocking(rig) == ["pre-arm checks fail in GUIDED", "PreArm: Need Position Estimate"]
    rig.peers[1].say("STATUSTEXT", severity=2, text=b"PreArm: OpenDroneID: SYSTEM not available")
    rig.run(0.2)
    assert "SYSTEM not available; this station sends no operator's Remote ID: another one must" in blocking(rig)[-1]
    rig.run(36.0)
    assert blocking(rig) == ["pre-arm checks fail in GUIDED"], "texts are repeated every 30 s while they are true"


def test_a_reason_of_another_mode_holds_in_guided_unless_it_is_about_that_mode(tmp_path: Path) -> None:
    """Sent by a real ArduCopter in CIRCLE, and in AUTO without a mission."""
    bad = {"onboard_control_sensors_health": ALL & ~PREARM}
    rig = healthy(tmp_path, Peer(1, custom_mode=AUTO), SYS_STATUS=bad)
    rig.peers[1].say("STATUSTEXT", severity=2, text=b"PreArm: Mode requires mission")
    rig.run(0.2)
    assert not blocking(rig)
    rig.peers[1].say("STATUSTEXT", severity=2, text=b"PreArm: Compass calibrated requires reboot")
    rig.run(0.2)
    assert blocking(rig) == ["PreArm: Compass calibrated requires reboot"]


def test_the_safety_switch_is_named(tmp_path: Path) -> None:
    off = {"onboard_control_sensors_enabled": ALL & ~0x8000}
    rig = healthy(tmp_path, Peer(1, custom_mode=GUIDED), SYS_STATUS=off)
    assert blocking(rig) == ["motors are off: safety switch"]


def test_sensors_are_called_by_their_names(tmp_path: Path) -> None:
    bad = {"onboard_control_sensors_health": ALL & ~0x4 & ~0x1}
    rig = healthy(tmp_path, Peer(1, autopilot=PX4, custom_mode=HOLD), SYS_STATUS=bad)
    assert {problem.text for problem in judge(rig).problems} == {"gyro unhealthy", "compass unhealthy"}
    assert blocking(rig) == ["gyro unhealthy"]


@pytest.mark.parametrize(
    ("fields", "text", "blocks"),
    [
        ({"charge_state": 2}, "battery low", True),
        ({"charge_state": 5}, "battery failed", True),
        ({"charge_state": 200}, "", False),
        ({"fault_bitmask": 0b101}, "battery fault: deep discharge, cell failed", True),
        ({"battery_remaining": 20}, "battery at 20 %", False),
        ({"battery_remaining": -1}, "battery: charge unknown", False),
        ({"time_remaining": 100}, "battery for 100 s only", False),
    ],
)
def test_the_battery(tmp_path: Path, fields: dict[str, Any], text: str, blocks: bool) -> None:
    rig = healthy(tmp_path, Peer(1, custom_mode=GUIDED), BATTERY_STATUS=fields)
    assert judge(rig).problems == ((HealthProblem(text, blocks),) if text else ())


@pytest.mark.parametrize(("status", "ready"), [(0, False), (1, False), (2, False), (3, True), (4, True), (5, False)])
def test_the_state_in_the_heartbeat(tmp_path: Path, status: int, ready: bool) -> None:
    rig = healthy(tmp_path, Peer(1, custom_mode=GUIDED))
    rig.vehicle().telemetry.system_status = status
    assert judge(rig).ready is ready


def test_px4_reports_state_0_whenever_its_checks_fail_so_it_is_no_reason(tmp_path: Path) -> None:
    """Measured on 1.16.1: POSCTL without sticks, minutes after its start."""
    rig = healthy(tmp_path, Peer(1, autopilot=PX4, custom_mode=HOLD))
    rig.vehicle().telemetry.system_status = 0
    assert judge(rig).ready


def test_a_low_throttle_stick_is_reported_and_in_loiter_it_blocks(tmp_path: Path) -> None:
    """SITL's default RC has the stick at 1000: LOITER by a station sank at 2.5 m/s, silently."""
    peer = Peer(1, custom_mode=GUIDED)
    rig = healthy(tmp_path, peer, RC_CHANNELS={"chan3_raw": 1000})
    (problem,) = judge(rig).problems
    assert problem.text.startswith("throttle stick is low (1000 µs)") and not problem.blocks
    peer.armed, peer.custom_mode = True, LOITER
    rig.run(1.5)
    assert blocking(rig) == [problem.text]


def test_without_rc_there_is_no_stick(tmp_path: Path) -> None:
    rig = healthy(tmp_path, Peer(1, custom_mode=GUIDED), RC_CHANNELS={"chan3_raw": 0, "chancount": 0})
    assert judge(rig).problems == ()


def test_gps_blocks_only_if_it_is_what_is_missing(tmp_path: Path) -> None:
    rig = healthy(tmp_path, Peer(1, custom_mode=GUIDED), GPS_RAW_INT={"fix_type": 1, "satellites_visible": 3})
    assert judge(rig).problems == (HealthProblem("no GPS fix: 3 satellites", blocks=False),), "the EKF has a position"
    rig = healthy(
        tmp_path / "2",
        Peer(1, custom_mode=GUIDED),
        GPS_RAW_INT={"fix_type": 1, "satellites_visible": 255},
        EKF_STATUS_REPORT={"flags": 167},
    )
    assert "no GPS fix: satellites unknown" in blocking(rig)


# ---------------------------------------------------------------- PX4


def report(rig: ServiceRig, *, can_arm: int) -> None:
    """Its arming checks were reported."""
    events = rig.station.services.vehicle_events
    check = ArmingCheck(SafeText("No valid position estimate"), 3, HOLD_BIT)
    events.report = lambda vehicle: ArmingReport((check,), can_arm, 0.0)  # type: ignore[method-assign]
    events._bit = lambda vehicle, custom_mode: HOLD_BIT  # type: ignore[method-assign]


def test_px4_after_an_offboard_flight_needs_another_mode(tmp_path: Path) -> None:
    bad = {"onboard_control_sensors_health": ALL & ~PREARM}
    rig = healthy(tmp_path, Peer(1, autopilot=PX4, custom_mode=OFFBOARD), SYS_STATUS=bad)
    text = "in OFFBOARD without set-points it does not arm: set HOLD first"
    assert judge(rig) == Health(True, (HealthProblem(text, blocks=False),)), "a start sets HOLD, and looks again"
    report(rig, can_arm=HOLD_BIT)
    assert judge(rig) == Health(True, (HealthProblem(text, blocks=False),)), "it reports that it would arm in HOLD"


def test_px4_without_home_cannot_take_off(tmp_path: Path) -> None:
    rig = healthy(tmp_path, Peer(1, autopilot=PX4, custom_mode=HOLD), HOME_POSITION={})
    assert blocking(rig) == ["home is not known yet: take-off heights are counted from it"]


def test_px4s_own_checks_are_the_reasons(tmp_path: Path) -> None:
    bad = {"onboard_control_sensors_health": ALL & ~PREARM}
    rig = healthy(tmp_path, Peer(1, autopilot=PX4, custom_mode=HOLD), SYS_STATUS=bad)
    assert blocking(rig) == ["it does not arm in HOLD"]
    report(rig, can_arm=0)
    assert blocking(rig) == ["No valid position estimate"]
    report(rig, can_arm=HOLD_BIT)
    assert blocking(rig) == ["it does not arm in HOLD"], "two words of its own contradict each other"


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"flags": 0x33F & ~0x10}, "estimator without absolute position"),
        ({"flags": 0x33F | 0x400}, "GPS glitch: its position may be wrong"),
        ({"mag_ratio": 1.5}, "estimator: compass does not fit (1.5, should be below 1)"),
    ],
)
def test_px4s_estimator(tmp_path: Path, fields: dict[str, Any], text: str) -> None:
    rig = healthy(tmp_path, Peer(1, autopilot=PX4, custom_mode=HOLD), ESTIMATOR_STATUS=fields)
    assert blocking(rig) == [text]


def test_a_lost_vehicle_is_not_ready(tmp_path: Path) -> None:
    rig = healthy(tmp_path, Peer(1, custom_mode=GUIDED))
    rig.peers[1].silent = True
    rig.run(4.0)
    assert blocking(rig) == ["LOST: silent for 4 s"]
