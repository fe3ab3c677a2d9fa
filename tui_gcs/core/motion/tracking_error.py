"""Tracking error: how well a vehicle keeps to its course, measured in flight, and the lead compensation learnt from it.

An autopilot reaches a reference a little later than it is sent, and where the vehicle accelerates, in a curve above
all, a little beside it. So the reference is sent early, shifted along the acceleration; or, where the autopilot takes
accelerations, with a feed-forward. By how much is first its firmware's figure, and soon after its own, measured.
Positions are compared for the same moment: the course at the time when the vehicle's newest position arrived.
"""

import math
from dataclasses import dataclass, field, replace

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.motion.course import STILL, Course, PositionTarget, Trajectory
from tui_gcs.core.motion.lead_compensation import DragModel, LeadCompensation
from tui_gcs.core.protocol.common import Vec3

MIN_SPEED_M_S = 2.0
"""Below this speed a lag means nothing."""
MIN_ACCEL_M_S2 = 0.3
"""A course with less acceleration teaches nothing about accelerations."""
SETTLE_S = 3.0
"""After a new course, or a corner, this long passes before anything is measured."""
LEARN_PER_S = 0.1
"""Share of the remaining error that is taken into the lead in a second: slower than the loop that is measured."""
DISPLAY_SMOOTH_S = 2.0
"""Time constant of what is shown."""
# PX4 lags by 0.23 to 0.30 s behind a position with velocity, by 1.25 s behind positions alone (docs/autopilots.md).
MAX_LEAD_S, MAX_ACCEL_S2 = 1.0, 4.0
LEARN_WITHIN_S, LEARN_WITHIN_M = 1.0, 6.0
"""Larger errors are not lag: it is catching up, or something is wrong."""
# What a vehicle cannot do (against a wind that takes all its lean) would teach a lead that is wrong everywhere else
# (flown: 5 m off for minutes after a gust).
MAX_LEARNT_S, MAX_LEARNT_M = 0.15, 1.0
"""No error teaches more than one of this size."""
# Where frames are lost, so are set-points, and an autopilot flies on straight until the next: in curves that looks
# as if it needed more shift. Learnt, that grew from 1 to 2.4 s² in five minutes; ArduCopters were up to 8 m off
# (flown with a tenth lost; on good links they want 0.85 to 1.15).
MAX_LOSS_PCT = 2.0
"""With more of its frames lost nothing is learnt about accelerations."""
MAX_GAP_S = 1.0
"""After a longer pause between positions measuring begins anew."""
MAX_BACK_S = 1.0
"""How far before its begin a trajectory is extrapolated."""
STILL_M_S = 0.3
STILL_LIMIT_S = 6.0
"""A vehicle that is asked to move and stands still this long does not take its set-points."""
ASKED_M = 5.0
"""A reference this far away, or as fast as `MIN_SPEED_M_S`, asks the vehicle to move."""


# An ArduCopter with a motor at 75 % made 1 m/s of 4, and its planner led it anew from where it was, again and
# again: it was never late.
CRAWLS_SHARE, CRAWLS_S, CRAWL_SMOOTH_S = 0.5, 5.0, 4.0
"""Less than this share of the speed asked for, for this long: the vehicle cannot fly it."""


@dataclass
class TrackingMonitor:
    """How well one vehicle follows its courses."""

    lead: LeadCompensation = field(default_factory=LeadCompensation)
    lag_s: float = math.nan
    """How much later than planned it passes, smoothed; negative: earlier. NaN where its course does not move."""
    cross_m: float = math.nan
    """How far beside its path it is, smoothed."""
    since_s: float = math.nan
    """Since when it has been following moving courses without a pause."""
    compared_s: float = -math.inf
    """Time of the newest position that was compared."""
    compared: Course | None = None
    """The moving course with which that position was compared."""
    off_m: float = math.nan
    """How far that position was from where the course wanted it then."""
    still_since_s: float = math.nan
    drag: DragModel = field(default_factory=DragModel)
    asked_m_s: float = 0.0
    """Speed of its courses, smoothed; 0 where they do not move."""
    made_m_s: float = 0.0
    """Its own speed in the direction of its courses, smoothed."""
    crawls_since_s: float = math.nan

    def pause(self) -> None:
        """It follows nothing that moves: nothing is measured."""
        self.since_s = self.lag_s = self.cross_m = math.nan

    def update(self, course: Course, vehicle: Vehicle) -> None:
        """Compare its newest position with the course; a position that was compared before is ignored."""
        at_s = vehicle.telemetry.position_s
        # Ticks are more frequent than positions: each position counts once.
        if at_s <= self.compared_s:
            return
        gap_s = at_s - self.compared_s
        self.compared_s = at_s
        if isinstance(course, PositionTarget) or gap_s > MAX_GAP_S:
            self.pause()
            self.drag = DragModel()
            self.asked_m_s, self.made_m_s, self.crawls_since_s = 0.0, 0.0, math.nan
            if isinstance(course, PositionTarget):
                return
            gap_s = min(gap_s, MAX_GAP_S)
        point, velocity = reference_when(course, at_s)
        self.compared, self.off_m = course, math.dist(point, vehicle.telemetry.position_m)
        if self.lead.drag_hz is not None:
            self.drag.advance(gap_s, velocity, self.lead.drag_hz)
            self._learn_drag(point, vehicle.telemetry.position_m, gap_s)
        speed = math.hypot(*velocity)
        self._compare_speeds(speed, velocity, vehicle, at_s, gap_s)
        if speed < MIN_SPEED_M_S:
            self.pause()
            return
        if math.isnan(self.since_s):
            self.since_s = at_s
        behind = _minus(point, vehicle.telemetry.position_m)
        along_m = _dot(behind, velocity) / speed
        cross_m = math.sqrt(max(0.0, _dot(behind, behind) - along_m**2))
        late_s = along_m / speed
        share = 1.0 if math.isnan(self.lag_s) else min(1.0, gap_s / DISPLAY_SMOOTH_S)
        self.lag_s = late_s if share == 1.0 else self.lag_s + share * (late_s - self.lag_s)
        self.cross_m = cross_m if share == 1.0 else self.cross_m + share * (cross_m - self.cross_m)
        if at_s - self.since_s > SETTLE_S:
            accel = course.acceleration(at_s) if vehicle.loss_pct <= MAX_LOSS_PCT else STILL
            self._learn(late_s, behind, cross_m, accel, gap_s)

    def _compare_speeds(self, speed: float, velocity: Vec3, vehicle: Vehicle, at_s: float, gap_s: float) -> None:
        made = _dot(vehicle.telemetry.velocity_m_s, velocity) / speed if speed > 0.0 else 0.0
        if not math.isfinite(made):
            return
        share = min(1.0, gap_s / CRAWL_SMOOTH_S)
        self.asked_m_s += share * (speed - self.asked_m_s)
        self.made_m_s += share * (made - self.made_m_s)
        if self.asked_m_s < MIN_SPEED_M_S or self.made_m_s > CRAWLS_SHARE * self.asked_m_s:
            self.crawls_since_s = math.nan
        elif math.isnan(self.crawls_since_s):
            self.crawls_since_s = at_s

    def crawls(self, now: float) -> bool:
        """Whether it has been flying much slower than asked for a long time."""
        return now - self.crawls_since_s > CRAWLS_S  # False while it is NaN

    def _learn_drag(self, wanted_m: Vec3, place_m: Vec3, gap_s: float) -> None:
        """Learn the drag, in corners above all, however slow: there an autopilot's integral leans the wrong way."""
        behind = _minus(wanted_m, place_m)
        settled = self.drag.age_s > SETTLE_S
        if self.lead.drag_hz is not None and settled and math.hypot(*behind) < LEARN_WITHIN_M:
            self.lead = replace(self.lead, drag_hz=self.drag.learn_drag(self.lead.drag_hz, behind, gap_s))

    def _learn(self, late_s: float, behind: Vec3, cross_m: float, accel: Vec3, gap_s: float) -> None:
        if abs(late_s) > LEARN_WITHIN_S or cross_m > LEARN_WITHIN_M:
            return
        late_s = min(max(late_s, -MAX_LEARNT_S), MAX_LEARNT_S)
        time_s = _within(self.lead.time_s + LEARN_PER_S * gap_s * late_s, MAX_LEAD_S)
        if self.lead.drag_hz is not None:
            self.lead = replace(self.lead, time_s=time_s)
            return
        accel_s2 = self.lead.accel_s2
        size = math.hypot(*accel)
        if size > MIN_ACCEL_M_S2:
            left_m = _dot(behind, accel) / size
            left_m = min(max(left_m, -MAX_LEARNT_M), MAX_LEARNT_M)
            accel_s2 = _within(accel_s2 + LEARN_PER_S * gap_s * left_m / size, MAX_ACCEL_S2)
        self.lead = LeadCompensation(time_s, accel_s2)

    def ignores(self, course: Course, vehicle: Vehicle, now: float) -> bool:
        """Whether it has been standing still for long although it was asked to move."""
        point, velocity = course.at(now)
        should_move = math.hypot(*velocity) > MIN_SPEED_M_S or math.dist(point, vehicle.telemetry.position_m) > ASKED_M
        if not should_move or not math.hypot(*vehicle.telemetry.velocity_m_s) < STILL_M_S:
            self.still_since_s = math.nan
        elif math.isnan(self.still_since_s):
            self.still_since_s = now
        return now - self.still_since_s > STILL_LIMIT_S  # False while it is NaN


def reference_when(course: Course, at_s: float) -> tuple[Vec3, Vec3]:
    """Position and velocity that a course wanted at the time when a position came.

    A planner's newest trajectory may begin after that: it is extrapolated straight back, as it continues the one
    before.
    """
    point, velocity = course.at(at_s)
    # Taken as standing until it begins, a vehicle on a bad link was never found to follow for long enough to learn
    # from.
    if not isinstance(course, Trajectory) or not course.t0_s - MAX_BACK_S <= at_s < course.t0_s:
        return point, velocity
    velocity = course.at(course.t0_s)[1]
    back_s = course.t0_s - at_s
    x, y, z = (p - back_s * v for p, v in zip(point, velocity, strict=True))
    return (x, y, z), velocity


def _minus(a: Vec3, b: Vec3) -> Vec3:
    # Written out: for each vehicle at each set-point, sums over generators took a tenth of a station's time.
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _dot(a: Vec3, b: Vec3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _within(value: float, most: float) -> float:
    return min(max(value, 0.0), most)
