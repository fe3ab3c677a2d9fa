"""What the guard says of a way that is followed exactly, sent as a patrol sends it to an ArduCopter.

A new trajectory begins in every step of the planner, and set-points are shifted by the lead compensation.
"""

import numpy as np

from tui_gcs.core.firmware.ardupilot import ArduCopter
from tui_gcs.core.geometry.zones import Zone
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.motion_prediction import MotionModel, VehicleState
from tui_gcs.core.motion.course import Trajectory
from tui_gcs.core.motion.lead_compensation import LeadCompensatedCourse
from tui_gcs.core.scenario.model import Limits, OperatingArea

SAMPLE_S, SAMPLES = 0.25, 13
"""Spacing and number of samples of a small team's trajectories."""
PLANNED_S, JUDGED_S = 0.2, 0.1
"""Time between two trajectories, which begin when they are planned, and between two verdicts here."""
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
    own_s = dt_s * np.arange(len(xy_m))

    def sampled(times_s: np.ndarray, values: np.ndarray, up: float) -> np.ndarray:
        return np.stack([*(np.interp(times_s, own_s, axis) for axis in values.T), np.full(SAMPLES, up)], axis=1)

    guard, found = Guard(limits or Limits(), area, closed), []
    for t0_s in np.arange(0.0, own_s[-1] - SAMPLE_S * SAMPLES, PLANNED_S).tolist():
        times_s = t0_s + SAMPLE_S * np.arange(SAMPLES)
        course = Trajectory(t0_s, SAMPLE_S, sampled(times_s, xy_m, HEIGHT_M), sampled(times_s, velocity_m_s, 0.0))
        sent = LeadCompensatedCourse(course, ArduCopter.lead)
        for now in (t0_s, t0_s + JUDGED_S):
            vehicle = VehicleState(1, *course.at(now), MotionModel.FOLLOWS, course)
            (verdict,) = guard.judge([vehicle], [sent], [vehicle], now)
            found += [] if verdict.ok else [f"{now:.1f} s at {course.at(now)[0]}: {verdict.text}"]
    return found
