"""Lead compensation: what is sent so that a vehicle is on its course, in spite of its lag, its curves and air drag.

An autopilot that controls position, velocity and an integral takes drag into its integral. On a straight line that is
enough; in a turn the integral still leans the old way, and the vehicle is metres outside and behind. So the drag is
learnt from how far the vehicle falls behind, and its acceleration is sent along as a feed-forward.
"""

import math
from dataclasses import dataclass

from tui_gcs.core.motion.course import STILL, MovingCourse
from tui_gcs.core.protocol.common import Vec3

# Measured on the real PX4 1.16.1 (its own simulator: 1.0 m/s² per m/s) on a patrol tour at 7.6 m/s: 5.1 m off with
# position and velocity alone, 2.5 m with shifted places, 1.0 m when the acceleration of the course and of the drag
# is sent along.
POSITION_P_HZ, VELOCITY_P_HZ, VELOCITY_I_HZ2, VELOCITY_D = 0.95, 1.8, 0.4, 0.2
"""PX4's defaults: MPC_XY_P, MPC_XY_VEL_P_ACC, _I_ACC, _D_ACC."""
ACCEL_GAIN = 1.0 + VELOCITY_D
"""PX4's own damping works against every change of speed."""
STEP_S = 0.05
LEARN_PER_S = 0.15
"""Share of the missing drag that is learnt in a second."""
NOISE_FLOOR_M2 = 1.0
"""Where the model falls behind by less than about the root of this, the measurement is noise."""
MAX_HZ = 1.5
"""Largest drag that is learnt."""

MAX_SHIFT_M = 4.0
"""Largest shift of a reference along its acceleration."""


@dataclass(frozen=True)
class LeadCompensation:
    """How far ahead of the plan a moving reference is sent, so that the vehicle is on the plan."""

    time_s: float = 0.0
    """The vehicle's lag."""
    accel_s2: float = 0.0
    """It is left behind by this much times its course's acceleration: outside in curves, late when it speeds up."""
    drag_hz: float | None = None
    """The air brakes it by this much times its speed, and that acceleration is sent along with the course's. None: its
    autopilot takes positions and velocities only."""


@dataclass(frozen=True)
class LeadCompensatedCourse:
    """A course as it is sent: ahead of time, inside in curves, farther on where it speeds up."""

    course: MovingCourse
    lead: LeadCompensation

    def at(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Position and velocity to be sent at `t_s`."""
        point, velocity = self.course.at(t_s + self.lead.time_s)
        if not self.lead.accel_s2:
            return point, velocity
        accel = self.course.acceleration(t_s + self.lead.time_s)
        shift = self.lead.accel_s2
        size_m = shift * math.hypot(*accel)
        if size_m > MAX_SHIFT_M:
            shift *= MAX_SHIFT_M / size_m
        (x, y, z), (ax, ay, az) = point, accel
        return (x + shift * ax, y + shift * ay, z + shift * az), velocity

    def feed_forward(self, t_s: float) -> Vec3:
        """Acceleration to be sent at `t_s`: the course's and that against drag; none where no drag is known."""
        if self.lead.drag_hz is None:
            return STILL
        velocity = self.course.at(t_s + self.lead.time_s)[1]
        accel = self.course.acceleration(t_s + self.lead.time_s)
        east, north = (ACCEL_GAIN * accel[axis] + self.lead.drag_hz * velocity[axis] for axis in (0, 1))
        return (east, north, 0.0)


class DragModel:
    """Position error (metres east, north) of an autopilot with PX4's gains for each 1 m/s² per m/s of drag not sent."""

    def __init__(self) -> None:
        self.age_s = 0.0
        self._away_m = [0.0, 0.0]
        self._away_m_s = [0.0, 0.0]
        self._integral_m_s2 = [0.0, 0.0]

    def advance(self, gap_s: float, velocity_m_s: Vec3, drag_hz: float) -> None:
        """Move the model on: the course moved with `velocity_m_s` for `gap_s`."""
        self.age_s += gap_s
        steps = max(1, round(gap_s / STEP_S))
        step_s = gap_s / steps
        for axis in (0, 1):
            away, speed, integral = self._away_m[axis], self._away_m_s[axis], self._integral_m_s2[axis]
            for _ in range(steps):
                error = -POSITION_P_HZ * away - speed
                lean = velocity_m_s[axis] + VELOCITY_P_HZ * error + integral - drag_hz * speed
                integral += VELOCITY_I_HZ2 * error * step_s
                speed += lean / ACCEL_GAIN * step_s
                away += speed * step_s
            self._away_m[axis], self._away_m_s[axis], self._integral_m_s2[axis] = away, speed, integral

    def learn_drag(self, drag_hz: float, behind_m: Vec3, gap_s: float) -> float:
        """A better estimate of the drag, from being `behind_m` (east, north, …) along where this model falls behind."""
        x, y = self._away_m
        missing_hz = (behind_m[0] * x + behind_m[1] * y) / (NOISE_FLOOR_M2 + x * x + y * y)
        return min(max(drag_hz + LEARN_PER_S * gap_s * missing_hz, 0.0), MAX_HZ)
