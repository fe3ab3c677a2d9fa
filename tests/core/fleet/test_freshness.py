"""Vehicles that are heard, stale or LOST, in the air or not, and whether they may be commanded: from frames written by
hand."""

import math

import pytest

from tests.core.rigs.heard import BEAT, Heard
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.protocol.common import Freshness


def freshness(heard: Heard) -> Freshness:
    return heard.vehicle.freshness(heard.clock.now())


def lost_and_found(heard: Heard) -> list[str]:
    return [text for text in heard.told() if "LOST" in text or "again" in text]


def pass_time(heard: Heard, seconds: float) -> None:
    """The station looks ten times a second."""
    for _ in range(round(10 * seconds)):
        heard.clock.advance(0.1)
        heard.fleet.tick()


# ---------------------------------------------------------------- heard, stale, LOST


def test_without_a_position_for_three_seconds_it_is_stale() -> None:
    heard = Heard()
    heard.is_at()
    for _ in range(29):
        heard.say("HEARTBEAT", **BEAT, after_s=0.1)
    assert freshness(heard) is Freshness.OK
    for _ in range(20):
        heard.say("HEARTBEAT", **BEAT, after_s=0.1)
    assert freshness(heard) is Freshness.STALE
    heard.is_at()
    assert freshness(heard) is Freshness.OK


def test_without_a_frame_for_three_and_a_half_seconds_it_is_lost_and_that_is_told_once() -> None:
    heard = Heard()
    heard.is_at()
    pass_time(heard, 3.4)
    assert freshness(heard) is Freshness.STALE and lost_and_found(heard) == []
    pass_time(heard, 20.0)
    assert freshness(heard) is Freshness.LOST and lost_and_found(heard) == ["LOST: nothing heard for 3.5 s"]
    heard.say("HEARTBEAT", **BEAT)
    pass_time(heard, 1.0)
    assert freshness(heard) is Freshness.STALE
    assert lost_and_found(heard) == ["LOST: nothing heard for 3.5 s", "heard again"]


def test_a_camera_that_goes_on_is_no_sign_of_life_of_its_vehicle() -> None:
    heard, camera = Heard(), Encoder(1, 100)
    heard.is_at()
    for _ in range(50):
        heard.hear(camera.encode("HEARTBEAT", **BEAT | {"type": 30, "autopilot": 8}))
    assert freshness(heard) is Freshness.LOST


def test_over_a_satellite_silence_is_longer() -> None:
    heard = Heard()
    heard.is_at()
    heard.clock.advance(10.0)
    heard.say("HIGH_LATENCY2", type=2, autopilot=3, latitude=520_000_000, longitude=10, timestamp=20_000)
    pass_time(heard, 100.0)
    assert freshness(heard) is Freshness.OK
    pass_time(heard, 21.0)
    assert freshness(heard) is Freshness.LOST


def test_one_satellite_message_among_the_others_makes_no_satellite() -> None:
    heard = Heard()
    heard.is_at()
    heard.say("HIGH_LATENCY2", type=2, autopilot=3)
    pass_time(heard, 3.6)
    assert freshness(heard) is Freshness.LOST


@pytest.mark.parametrize(("keeps", "loss_pct"), [(1, 0.0), (2, 50.0), (4, 75.0)])
def test_the_share_of_frames_that_never_came(keeps: int, loss_pct: float) -> None:
    heard = Heard()
    for number in range(400):
        raw = heard.sender.encode("HEARTBEAT", **BEAT)
        if number % keeps == 0:
            heard.hear(raw)
    assert heard.vehicle.loss_pct == pytest.approx(loss_pct, abs=1.0)


# ---------------------------------------------------------------- on the ground, in the air


def flying(armed: bool, height_m: float, landed_state: int) -> Vehicle:
    vehicle = Heard().vehicle
    vehicle.telemetry.armed, vehicle.telemetry.landed_state = armed, landed_state
    vehicle.telemetry.position_m = (0.0, 0.0, height_m)
    return vehicle


@pytest.mark.parametrize(
    ("height_m", "landed_state", "in_the_air", "landed"),
    [
        (2.1, 0, True, False),  # nothing said: its height tells
        (2.0, 0, False, False),
        (math.nan, 0, False, False),
        (0.0, 2, True, False),  # in the air
        (0.0, 3, True, False),  # taking off
        (0.0, 4, True, False),  # landing
        (0.0, 1, False, True),
        (30.0, 1, True, True),  # on a roof, or its word against its height: both count
    ],
)
def test_in_the_air_is_who_is_armed_and_high_or_says_so(
    height_m: float, landed_state: int, in_the_air: bool, landed: bool
) -> None:
    vehicle = flying(True, height_m, landed_state)
    assert (vehicle.telemetry.airborne, vehicle.telemetry.on_ground) == (in_the_air, landed)
    disarmed = flying(False, height_m, landed_state)
    assert not disarmed.telemetry.airborne and disarmed.telemetry.on_ground


# ---------------------------------------------------------------- what it may be told


def test_two_of_one_id_are_not_commanded_on_the_ground_and_one_that_flies_alone_is() -> None:
    vehicle = flying(True, 0.0, 1)
    assert vehicle.why_not_commanded == ""
    vehicle.identity.blocked = "several vehicles use id 1"
    assert vehicle.why_not_commanded == "several vehicles use id 1"
    vehicle.telemetry.landed_state, vehicle.telemetry.position_m = 2, (0.0, 0.0, 30.0)
    assert vehicle.why_not_commanded == "", "the other one has another address"
    vehicle.identity.blocked_in_flight = True
    assert vehicle.why_not_commanded == "several vehicles use id 1"


@pytest.mark.parametrize("height_m", [0.0, 30.0])
def test_who_proves_nothing_is_not_commanded_wherever_it_is(height_m: float) -> None:
    vehicle = flying(True, height_m, 0)
    vehicle.identity.moved = "asked for its identity"
    assert vehicle.why_not_commanded == "asked for its identity"
    vehicle.identity.untrusted = "signs with an unknown key"
    assert vehicle.why_not_commanded == "signs with an unknown key"


def test_what_is_set_up_or_wants_a_reboot_is_not_started() -> None:
    vehicle = Heard().vehicle
    assert vehicle.why_not_started == ""
    vehicle.reboot_first = "compass calibration"
    assert vehicle.why_not_started == "compass calibration: reboot it before it flies"
    vehicle.set_up |= {"motor test", "gyro calibration"}
    assert vehicle.why_not_started == "gyro calibration, motor test is under way"


def test_after_a_reboot_nothing_is_known_of_before() -> None:
    heard = Heard()
    heard.is_at()
    heard.say("GPS_RAW_INT", fix_type=3, h_acc=500, satellites_visible=12)
    heard.say("BATTERY_STATUS", voltages=[16_000] + [65535] * 9, battery_remaining=80)
    heard.say("HOME_POSITION", latitude=520_000_000, longitude=-6_000_000)
    heard.say("EXTENDED_SYS_STATE", landed_state=2)
    vehicle = heard.vehicle
    vehicle.identity.identified, vehicle.identity.firmware_token, vehicle.reboot_first = (
        True,
        "0123",
        "compass calibration",
    )
    vehicle.forget_boot()
    assert not vehicle.identity.identified and vehicle.identity.firmware_token == "" and vehicle.why_not_started == ""
    assert (
        math.isnan(vehicle.telemetry.battery_pct)
        and math.isnan(vehicle.integrity.position_error_m)
        and vehicle.telemetry.home_m is None
    )
    assert (
        vehicle.telemetry.gps_fix,
        vehicle.telemetry.satellites,
        vehicle.telemetry.landed_state,
        vehicle.telemetry.prearm_ok,
    ) == (0, -1, 0, False)
    assert heard.say("SYS_STATUS", battery_remaining=50).telemetry.battery_pct == 50.0, (
        "BATTERY_STATUS may not come any more"
    )


def test_what_it_said_of_a_failsafe_and_just_before_of_why() -> None:
    vehicle = Heard().vehicle
    vehicle.recent_reasons = [
        (1.0, "Old: failsafe"),
        (5.0, "Compass"),
        (6.0, "EKF variance"),
        (7.0, "EKF Failsafe"),
        (8.0, "LAND"),
    ]
    assert vehicle.failsafe_words(4.0) == "EKF variance; EKF Failsafe"
    assert vehicle.failsafe_words(7.5) == ""
    assert vehicle.reasons_since(6.0) == ["EKF variance", "EKF Failsafe", "LAND"]
