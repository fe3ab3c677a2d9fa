"""Why a vehicle acts by itself, in its own words: texts of real autopilots, in the order in which they came."""

import pytest

from tui_gcs.core.mavlink.failsafe_texts import failsafe_words, is_fence_breach, is_of_failsafe

HOLD_FIRST = "Failsafe activated: entering Hold for 5 seconds"


@pytest.mark.parametrize(
    ("said", "why"),
    [
        (["EKF variance", "EKF Failsafe: changed to LAND Mode"], "EKF variance; EKF Failsafe: changed to LAND Mode"),
        (["Battery 1 is low 12.60V", "Battery Failsafe"], "Battery 1 is low 12.60V; Battery Failsafe"),
        (["GCS Failsafe"], "GCS Failsafe"),
        (["Circle fence breached", "Manual recovery started"], "Circle fence breached"),
        (["Compass error", "Circle and Polygon fences breached"], "Circle and Polygon fences breached"),
        ([HOLD_FIRST, "Manual control loss: switching to RTL in 5 seconds"], "Manual control loss"),
        (["Critical battery", HOLD_FIRST], "Critical battery"),
        (["Critical battery", HOLD_FIRST, "Critical battery level: switching to RTL in 5 seconds"],
         "Critical battery level"),
        (["Failsafe activated", "GCS connection loss: switching to RTL"], "GCS connection loss"),
        (["Failsafe activated", "Failsafe activated: Autopilot disengaged, switching to Descend"],
         "Autopilot disengaged, switching to Descend"),
        (["Geofence: approaching or outside geofence", "Failsafe activated"],
         "Geofence: approaching or outside geofence"),
        (["Geofence: exceeding maximum distance to Home", "Failsafe activated: switching to RTL in 5 seconds"],
         "Geofence: exceeding maximum distance to Home"),
        (["Low battery", "Failsafe activated: switching to RTL", "Emergency battery level: switching to Land"],
         "Emergency battery level"),
        (["Failsafe activated: switching to RTL"], "Failsafe activated: switching to RTL"),
        (["Failsafe activated"], "Failsafe activated"),
        (["Preflight: GPS fix too low"], ""),
        (["EKF3 IMU0 switching to compass 1", "Fence breach cleared"], ""),
        ([], ""),
    ],
)  # fmt: skip
def test_the_part_that_says_why(said: list[str], why: str) -> None:
    assert failsafe_words(said) == why


def test_a_notice_of_a_fence_is_kept_as_a_reason() -> None:
    assert is_of_failsafe("Circle fence breached")
    assert not is_of_failsafe("EKF3 IMU1 switching to compass 2")


@pytest.mark.parametrize(
    ("text", "is_one"),
    [
        ("Circle and Polygon fences breached", True),
        ("Geofence: approaching or outside geofence", True),
        ("Geofence: exceeding maximum distance to Home", True),
        ("Fence breach cleared", False),
        ("Geofence violation for waypoint 2", False),
        ("Geofence invalid, doesn't contain Home position", False),
        ("Reposition is outside geofence", False),
    ],
)
def test_a_breach_of_a_fence_is_told_from_a_plan_that_would_breach_it(text: str, is_one: bool) -> None:
    assert is_fence_breach(text) is is_one
