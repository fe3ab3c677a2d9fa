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

    begins_s = np.arange(0.0, own_s[-1] - SAMPLE_S * SAMPLES, PLANNED_S).tolist()
    courses = []
    for t0_s in begins_s:
        times_s = t0_s + SAMPLE_S * np.arange(SAMPLES)
        courses.append(Trajectory(0.0, SAMPLE_S, sampled(times_s, xy_m, HEIGHT_M), sampled(times_s, velocity_m_s, 0.0)))
    sent = [LeadCompensatedCourse(course, ArduCopter.lead) for course in courses]
    guard, found = Guard(limits or Limits(), area, closed), []
    # The trajectories are judged in one go, each as that of a vehicle of its own which begins it now. With no other
    # vehicle known that is what the guard says of each alone, and twenty times as fast.
    for now in (0.0, JUDGED_S):
        vehicles = [
            VehicleState(1 + row, *course.at(now), MotionModel.FOLLOWS, course) for row, course in enumerate(courses)
        ]
        verdicts = guard.judge(vehicles, sent, [], now)
        found += [
            f"{t0_s + now:.1f} s at {vehicle.position_m}: {verdict.text}"
            for t0_s, vehicle, verdict in zip(begins_s, vehicles, verdicts, strict=True)
            if not verdict.ok
        ]
    return found
