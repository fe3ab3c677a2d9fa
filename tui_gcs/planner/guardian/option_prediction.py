"""Predicts where each option would take a vehicle, and which intruders it would meet or could still catch on the way.

An option is a circuit round the zone and a direction, after up to two targets have been met.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.guardian.intercept import first_contact_s
from tui_gcs.planner.guardian.unseen_threats import Threats
from tui_gcs.planner.patrol.tour import Tour
from tui_gcs.planner.patrol.transit import Mobility

Floats = NDArray[np.floating[Any]]

PREDICTION_S = 16.0
"""Horizon: an intruder that is just not detected yet would be in the zone by then."""
STEP_S = 0.5
TIMES_S: Floats = np.arange(0.0, PREDICTION_S + STEP_S / 2.0, STEP_S)
COARSE_STEPS = 2
"""Unseen intruders are tested at every second prediction step."""
FINE_S = 0.25
"""Time step for meeting known targets."""
NEAR_M = 20.0
"""Farther than this beside its circuit a vehicle flies straight to it; nearer, the more along it the nearer it is."""
CIRCUIT_POINTS = 64
REACTION_S = 1.5
"""Time for turning that is subtracted when catching an intruder after its detection."""


@dataclass(frozen=True)
class OptionLegs:
    """How m options begin: the legs to up to two meetings, and the circuit after them."""

    xy_m: Floats
    """(m, 2) where the vehicle is."""
    velocity_m_s: Floats
    """(m, 2)"""
    until_s: Floats
    """(m, 2) times of the two meetings. The last is repeated where there are fewer, 0 where there is none."""
    leg_m_s: Floats
    """(m, 2, 2) velocities towards the meetings."""
    circuit: NDArray[np.int64]
    """(m,) number of the circuit it then follows."""
    way: NDArray[np.int64]
    """(m,) 1: as the circuit is timed; -1: the other way round."""


def predicted_courses(legs: OptionLegs, circuits: Sequence[Tour], mobility: Mobility) -> Floats:
    """Return (m, t, 2) places at `TIMES_S`, flown by point masses."""
    # A point mass with limited acceleration, because turning is most of what leaving the ring costs.
    points, along = _marked(circuits, legs)
    xy, velocity = legs.xy_m.copy(), legs.velocity_m_s.copy()
    course = [xy]
    for begin_s in TIMES_S[:-1]:
        wanted = _towards(xy, points, along, mobility.speed_m_s)
        for leg in (1, 0):
            on_leg = begin_s < legs.until_s[:, leg] - STEP_S / 2.0
            wanted = np.where(on_leg[:, None], legs.leg_m_s[:, leg], wanted)
        change = wanted - velocity
        most = mobility.accel_m_s2 * STEP_S / np.maximum(np.hypot(change[:, 0], change[:, 1]), 1e-9)
        new = velocity + change * np.minimum(1.0, most)[:, None]
        xy, velocity = xy + (velocity + new) * (STEP_S / 2.0), new
        course.append(xy)
    return np.stack(course, axis=1)


def _marked(circuits: Sequence[Tour], legs: OptionLegs) -> tuple[Floats, Floats]:
    """Return (m, p, 2) points of each option's circuit, and unit vectors along the direction of flight."""
    marks = [np.linspace(0, len(tour.xy_m), CIRCUIT_POINTS, endpoint=False).astype(np.int64) for tour in circuits]
    points = np.stack([tour.xy_m[mark] for tour, mark in zip(circuits, marks, strict=True)])
    along = np.stack([tour.velocity_m_s[mark] for tour, mark in zip(circuits, marks, strict=True)])
    along = along / np.maximum(np.hypot(along[..., 0], along[..., 1]), 1e-9)[..., None]
    return points[legs.circuit], along[legs.circuit] * legs.way[:, None, None]


def _towards(xy: Floats, points: Floats, along: Floats, speed_m_s: float) -> Floats:
    """Return (m, 2) velocities onto the circuits and along them."""
    rows = np.arange(len(xy))
    gap = points - xy[:, None]
    nearest = np.argmin(gap[..., 0] ** 2 + gap[..., 1] ** 2, axis=1)
    gap, along = gap[rows, nearest], along[rows, nearest]
    aside = gap - (gap * along).sum(axis=1)[:, None] * along
    away = np.hypot(aside[:, 0], aside[:, 1])
    share = np.minimum(1.0, away / NEAR_M)
    inwards = aside * (share / np.maximum(away, 1e-9))[:, None]
    return np.asarray(speed_m_s * (inwards + np.sqrt(1.0 - share**2)[:, None] * along))


def first_pass_s(course_m: Floats, target_m: Floats, target_m_s: Floats, within_m: float) -> Floats:
    """Return (m, k) times at which courses first come within `within_m` of known targets (k, 2); infinite without."""
    fine_s = np.arange(0.0, PREDICTION_S + FINE_S / 2.0, FINE_S)
    index, share = np.divmod(fine_s / STEP_S, 1.0)
    here = np.minimum(index.astype(np.int64), len(TIMES_S) - 2)
    share = np.where(index > here, 1.0, share)[:, None]
    course = (1.0 - share) * course_m[:, here] + share * course_m[:, here + 1]
    place = target_m + target_m_s * fine_s[:, None, None]
    near = ((course[:, :, None] - place[None]) ** 2).sum(axis=-1) <= within_m**2
    return np.where(near.any(axis=1), fine_s[np.argmax(near, axis=1)], np.inf)


def would_catch(course_m: Floats, threats: Threats, mobility: Mobility, sees_m: float, within_m: float) -> NDArray[Any]:
    """Return (m, h) whether a vehicle on the course would see the intruder and could then meet it before the zone."""
    # float32, because these are the largest arrays of a step and centimetres do not matter here.
    course = course_m[:, ::COARSE_STEPS].astype(np.float32)
    times = TIMES_S[::COARSE_STEPS].astype(np.float32)[:, None]
    threat_m, threat_m_s = threats.xy_m.astype(np.float32), threats.velocity_m_s.astype(np.float32)
    left_s = threats.enters_s.astype(np.float32) - times
    east, north = (threat_m[:, axis] + times * threat_m_s[:, axis] - course[..., axis, None] for axis in (0, 1))
    seen = (east * east + north * north <= sees_m**2) & (left_s > 0.0)
    option, time, threat = np.nonzero(seen)
    caught = np.zeros((len(course), len(threats.weight)), dtype=bool)
    gap = np.stack([east[option, time, threat], north[option, time, threat]], axis=1)
    after = first_contact_s(gap, threat_m_s[threat], mobility.speed_m_s, within_m)
    good = np.where(after > 0.0, after + REACTION_S, 0.0) <= left_s[time, threat]
    caught[option[good], threat[good]] = True
    return caught
