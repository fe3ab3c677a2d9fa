"""What the guard says of a course that is followed exactly, sent with the lead compensation of an ArduCopter."""

import numpy as np

from tui_gcs.core.firmware.ardupilot import ArduCopter
from tui_gcs.core.geometry.zones import Zone
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.motion_prediction import MotionModel, VehicleState
from tui_gcs.core.motion.course import Trajectory
from tui_gcs.core.motion.lead_compensation import LeadCompensatedCourse
from tui_gcs.core.scenario.model import Limits, OperatingArea

SAMPLE_S, JUDGED_S = 0.25, 0.5
"""Spacing of a small team's trajectories; time between two verdicts here."""
HEIGHT_M = 40.0


def refusals(
    xy_m: np.ndarray,
    velocity_m_s: np.ndarray,
    dt_s: float,
    area: OperatingArea,
    closed: tuple[Zone, ...],
    limits: Limits | None = None,
) -> list[str]:
    """Return the guard's vetoes of a way (k, 2) in steps of `dt_s`."""
    times, own = np.arange(0.0, dt_s * (len(xy_m) - 1), SAMPLE_S), dt_s * np.arange(len(xy_m))

    def sampled(values: np.ndarray, up: float) -> np.ndarray:
        return np.stack([*(np.interp(times, own, axis) for axis in values.T), np.full(len(times), up)], axis=1)

    course = Trajectory(0.0, SAMPLE_S, sampled(xy_m, HEIGHT_M), sampled(velocity_m_s, 0.0))
    sent, guard, found = LeadCompensatedCourse(course, ArduCopter.lead), Guard(limits or Limits(), area, closed), []
    for now in np.arange(0.0, course.end_s - 1.0, JUDGED_S).tolist():
        vehicle = VehicleState(1, *course.at(now), MotionModel.FOLLOWS, course)
        (verdict,) = guard.judge([vehicle], [sent], [vehicle], now)
        found += [] if verdict.ok else [f"{now:.1f} s at {course.at(now)[0]}: {verdict.text}"]
    return found
