"""Tracks: targets that sensors detected, each followed by a Kalman filter with constant velocity.

A detection belongs to the track it fits best, within a gate; one that fits none begins a track, which is tentative
until it was detected `CONFIRMING_DETECTIONS` times. A track that is not detected any more is deleted, a tentative one
soon: a false alarm does not come twice. (Blackman, Popoli: Design and Analysis of Modern Tracking Systems, 1999:
gating, nearest neighbour, M of N.)
"""

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.fleet.detections import Detection
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.protocol.common import EventClass, Track, Vec3
from tui_gcs.core.records.event_log import NOTICE, WARNING, EventLog

Floats = NDArray[np.float64]

CONFIRMING_DETECTIONS = 3
"""Detections that confirm a track."""
TENTATIVE_TIMEOUT_S, CONFIRMED_TIMEOUT_S = 1.5, 15.0
"""A tentative and a confirmed track are deleted after this long without a detection."""
GATE = 13.8
"""Squared distance in standard deviations that holds 99.9 % of the detections of a target (chi square, 2 axes)."""
SAME_LOOK_S, SAME_LOOK_GATE = 0.05, 4.0
"""Two detections of one vehicle within this time are two targets, unless both are nearer than this gate to one."""
MERGE_DISTANCE = 3.0
"""Two tracks nearer than this (squared, in standard deviations) that no vehicle sees separately are one target."""
ACCEL_SIGMA_M_S2 = 1.0
"""Standard deviation of a target's acceleration."""
UNKNOWN_SPEED_SIGMA_M_S = 8.0
"""Standard deviation of the velocity of a target that was detected once without one."""
SEEN_S = 2.0
"""A vehicle counts as seeing a target for this long after a detection."""
OWN_VEHICLE_M, OWN_VEHICLE_UP_M = 4.0, 6.0
"""A detection as near as this to one of our vehicles is that vehicle."""
# Every track travels in every fleet frame, ten times a second: a forged flood must not fill the bus.
MAX_TRACKS = 64


@dataclass
class _Target:
    """One track's filter: state (east, north, ve, vn), and height separately."""

    id: int
    state: Floats
    covariance: Floats
    up_m: float
    first_seen_s: float
    seen_s: float
    count: int = 1
    seen_by: dict[int, float] = field(default_factory=dict)

    @property
    def confirmed(self) -> bool:
        return self.count >= CONFIRMING_DETECTIONS

    def at(self, t_s: float) -> tuple[Floats, Floats]:
        """Return state and covariance at `t_s`, which is not before the last detection."""
        dt = max(0.0, t_s - self.seen_s)
        move = np.eye(4)
        move[0, 2] = move[1, 3] = dt
        noise = np.zeros((4, 4))
        q = ACCEL_SIGMA_M_S2**2
        for axis in (0, 1):
            noise[axis, axis] = q * dt**4 / 4
            noise[axis, axis + 2] = noise[axis + 2, axis] = q * dt**3 / 2
            noise[axis + 2, axis + 2] = q * dt**2
        return move @ self.state, move @ self.covariance @ move.T + noise

    def misfit(self, detection: Detection) -> float:
        """Return the squared distance of a detection in standard deviations."""
        state, covariance = self.at(detection.t_s)
        gap = np.array(detection.position_m[:2]) - state[:2]
        spread = covariance[:2, :2] + np.eye(2) * detection.sigma_m**2
        return float(gap @ np.linalg.solve(spread, gap))

    def update(self, detection: Detection) -> None:
        """Take a detection that belongs to this target."""
        state, covariance = self.at(detection.t_s)
        state, covariance = _measured(state, covariance, 0, detection.position_m, detection.sigma_m)
        if detection.velocity_m_s is not None:
            state, covariance = _measured(state, covariance, 2, detection.velocity_m_s, detection.sigma_m_s)
        self.state, self.covariance = state, covariance
        self.up_m += (detection.position_m[2] - self.up_m) * 0.3
        self.seen_s = detection.t_s
        self.count += 1
        # A vehicle that detects two targets keeps their tracks separate: see `_seen_apart`.
        self.seen_by[detection.vehicle] = detection.t_s

    def track(self, now: float) -> Track:
        """Return the track as it is published."""
        x, y, vx, vy = (float(value) for value in self.state)
        p = self.covariance
        return Track(
            id=self.id,
            position_m=(x, y, self.up_m),
            velocity_m_s=(vx, vy, 0.0),
            covariance_m2=(float(p[0, 0]), float(p[0, 1]), float(p[1, 1])),
            first_seen_s=self.first_seen_s,
            seen_s=self.seen_s,
            seen_by=tuple(sorted(v for v, t in self.seen_by.items() if now - t < SEEN_S)),
            confirmed=self.confirmed,
        )


class TargetTracker:
    """Follows all targets: `take` detections as they come, `tracks` returns the result."""

    def __init__(self, fleet: VehicleRegistry, events: EventLog) -> None:
        """Detections near vehicles of `fleet` are not taken."""
        self.dropped: Counter[str] = Counter()
        self._fleet = fleet
        self._events = events
        self._targets: list[_Target] = []
        self._next_id = 1

    def take(self, detection: Detection) -> None:
        """Take a detection: of one of our vehicles (dropped), of a known target, or of a new one."""
        if self._is_own(detection):
            self.dropped["detection of our own vehicle"] += 1
            return
        self._forget(detection.t_s)
        fits = [(misfit, t.id, t) for t in self._targets if (misfit := t.misfit(detection)) <= self._gate(t, detection)]
        target = min(fits)[2] if fits else None
        if target is not None:
            target.update(detection)
            if target.count == CONFIRMING_DETECTIONS:
                self._report_found(target, detection)
            self._merge(target)
        elif len(self._targets) >= MAX_TRACKS:
            self.dropped["track table full"] += 1
            text = f"{MAX_TRACKS} targets are followed already: more are not"
            self._events.report(EventClass.SENSOR, "tracks", text, WARNING, every_s=30)
        else:
            self._begin(detection)

    def tracks(self, now: float) -> tuple[Track, ...]:
        """Return the present tracks, ordered by id."""
        self._forget(now)
        return tuple(target.track(now) for target in self._targets)

    def clear(self) -> None:
        """Forget all tracks, because the origin of their coordinates has moved."""
        self._targets = []

    def _begin(self, detection: Detection) -> None:
        velocity = detection.velocity_m_s or (0.0, 0.0, 0.0)
        sigma = UNKNOWN_SPEED_SIGMA_M_S if detection.velocity_m_s is None else detection.sigma_m_s
        spread = np.array([detection.sigma_m, detection.sigma_m, sigma, sigma])
        target = _Target(
            self._next_id,
            np.array([*detection.position_m[:2], *velocity[:2]]),
            np.diag(spread**2),
            detection.position_m[2],
            detection.t_s,
            detection.t_s,
            seen_by={detection.vehicle: detection.t_s},
        )
        self._next_id += 1
        self._targets.append(target)

    def _is_own(self, detection: Detection) -> bool:
        x, y, z = detection.position_m
        reach_m = OWN_VEHICLE_M + detection.sigma_m
        up_m = OWN_VEHICLE_UP_M + 2.0 * detection.sigma_z_m
        return any(
            math.hypot(v.telemetry.position_m[0] - x, v.telemetry.position_m[1] - y) < reach_m
            and abs(v.telemetry.position_m[2] - z) < up_m
            for v in self._fleet.vehicles.values()
            if v.telemetry.has_position()
        )

    @staticmethod
    def _gate(target: _Target, detection: Detection) -> float:
        """Return the gate of a target: tighter if the same vehicle has just detected that target."""
        since_s = detection.t_s - target.seen_by.get(detection.vehicle, -math.inf)
        return SAME_LOOK_GATE if since_s < SAME_LOOK_S else GATE

    def _merge(self, target: _Target) -> None:
        """Merge a second track of the same target into the older one."""
        for other in self._targets:
            if other is target or self._seen_apart(target, other):
                continue
            state, covariance = other.at(target.seen_s)
            gap = target.state - state
            if float(gap @ np.linalg.solve(target.covariance + covariance, gap)) < MERGE_DISTANCE:
                old, new = sorted((target, other), key=lambda t: t.id)
                old.count += new.count
                old.seen_by = {
                    v: max(old.seen_by.get(v, -math.inf), new.seen_by.get(v, -math.inf))
                    for v in old.seen_by | new.seen_by
                }
                if new is target:
                    old.state, old.covariance, old.seen_s = new.state, new.covariance, new.seen_s
                self._targets.remove(new)
                return

    @staticmethod
    def _seen_apart(a: _Target, b: _Target) -> bool:
        """Return whether a vehicle has detected both targets within the last seconds."""
        last_s = max(a.seen_s, b.seen_s)
        return any(last_s - t < SEEN_S and last_s - b.seen_by.get(v, -math.inf) < SEEN_S for v, t in a.seen_by.items())

    def _forget(self, now: float) -> None:
        kept = [
            t for t in self._targets if now - t.seen_s <= (CONFIRMED_TIMEOUT_S if t.confirmed else TENTATIVE_TIMEOUT_S)
        ]
        for target in self._targets:
            if target.confirmed and target not in kept:
                text = f"target {target.id} has not been seen for {CONFIRMED_TIMEOUT_S:.0f} s: forgotten"
                self._events.report(EventClass.SENSOR, "tracks", text, NOTICE)
        self._targets = kept

    def _report_found(self, target: _Target, detection: Detection) -> None:
        x, y = (float(value) for value in target.state[:2])
        speed = math.hypot(*(float(value) for value in target.state[2:]))
        text = f"target {target.id} found by vehicle {detection.vehicle} at ({x:.0f}, {y:.0f}), {speed:.0f} m/s"
        self._events.report(EventClass.SENSOR, "tracks", text, WARNING)


def _measured(state: Floats, covariance: Floats, first: int, measured: Vec3, sigma: float) -> tuple[Floats, Floats]:
    """Return state and covariance after a measured (east, north) of `state[first:first + 2]`: the Kalman update."""
    rows = slice(first, first + 2)
    gain = covariance[:, rows] @ np.linalg.inv(covariance[rows, rows] + np.eye(2) * sigma**2)
    return state + gain @ (np.array(measured[:2]) - state[rows]), covariance - gain @ covariance[rows, :]
