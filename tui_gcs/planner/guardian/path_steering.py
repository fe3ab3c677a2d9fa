"""Paths for the next seconds: point masses steer towards moving places, and can always stop inside the region."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.transit import Mobility

Floats = NDArray[np.floating[Any]]

SAMPLES = 13
SAMPLE_S = 0.25
"""Number and spacing of samples: 3 s of path."""
CLOSE_IN_1_S = 1.0
"""Approach speed per metre left."""
BRAKE_SHARE = 0.7
"""Share of the acceleration for approaching a place."""


@dataclass
class SteeringTargets:
    """What n vehicles steer for, as functions of time: (n, SAMPLES, 2) places and their velocities."""

    place_m: Floats
    velocity_m_s: Floats
    through: NDArray[np.bool_]
    """(n,) True: turn to the velocity and keep it, wherever the place is. This is what a closed-form meeting assumes.
    """


def paths(
    xy_m: Floats, velocity_m_s: Floats, targets: SteeringTargets, mobility: Mobility, region: FlyableRegion
) -> tuple[Floats, Floats]:
    """Return places and velocities (n, SAMPLES, 2) from states (n, 2). Every sample allows a stop inside the region."""
    speed, most = mobility.speed_m_s, mobility.accel_m_s2 * SAMPLE_S
    brake = 2.0 * BRAKE_SHARE * mobility.accel_m_s2
    xy, velocity = xy_m.copy(), _slower(velocity_m_s, speed)
    places, speeds = [xy], [velocity]
    for k in range(1, SAMPLES):
        # The error is taken from where the vehicle would be at its present velocity.
        gap = targets.place_m[:, k] - (xy + velocity * SAMPLE_S)
        left = np.hypot(gap[:, 0], gap[:, 1])
        approach = np.minimum(CLOSE_IN_1_S * left, np.sqrt(brake * left))
        approach = np.where(targets.through, 0.0, approach)
        wanted = targets.velocity_m_s[:, k] + gap * (approach / np.maximum(left, 1e-6))[:, None]
        change = _slower(_slower(wanted, speed) - velocity, most)
        new = velocity + change
        xy, velocity = xy + (velocity + new) * (SAMPLE_S / 2.0), new
        places.append(xy)
        speeds.append(velocity)
    return _stoppable(np.stack(places, axis=1), np.stack(speeds, axis=1), mobility.accel_m_s2, region)


def _slower(velocity: Floats, most: float) -> Floats:
    size = np.hypot(velocity[:, 0], velocity[:, 1])
    return np.asarray(velocity * np.minimum(1.0, most / np.maximum(size, 1e-9))[:, None])


def _stoppable(places: Floats, speeds: Floats, accel: float, region: FlyableRegion) -> tuple[Floats, Floats]:
    """Replace path ends by braking before the first sample from which a vehicle could not stop inside.

    A path that begins outside is left as it is: it leads back.
    """
    n = len(places)
    changes = np.gradient(speeds, SAMPLE_S, axis=1)
    # A path begins anew in every step, and its first sample is sent with the acceleration of its second.
    sent = np.stack([changes, np.concatenate([changes[:, 1:], changes[:, -1:]], axis=1)])
    states = places.reshape(-1, 2), speeds.reshape(-1, 2), sent.reshape(2, -1, 2)
    good = region.are_sendable(*states, accel).reshape(n, SAMPLES)
    # To brake outside would keep the vehicle there.
    good[~region.contains(places[:, 0])] = True
    for row in np.flatnonzero(~good.all(axis=1)):
        last = max(0, int(np.argmin(good[row])) - 1)
        here, velocity = places[row, last], speeds[row, last]
        size = float(np.hypot(*velocity))
        after = SAMPLE_S * np.arange(1, SAMPLES - last)
        share = np.maximum(0.0, 1.0 - accel * after / size) if size > 1e-9 else np.zeros_like(after)
        braked = np.minimum(after, size / accel)
        places[row, last + 1 :] = here + velocity * (braked * (1.0 + share) / 2.0)[:, None]
        speeds[row, last + 1 :] = velocity * share[:, None]
    return places, speeds
