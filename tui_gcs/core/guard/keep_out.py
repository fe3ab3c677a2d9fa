"""Keep-out volumes: where lost vehicles may be by the guard's own prediction, for planners that fly round them.

Without them a planner leads its vehicles again and again through the column in which a lost one may sink or climb, and
the guard holds each of them there until that is over.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from tui_gcs.core.guard.lost_link_paths import lost_link_paths
from tui_gcs.core.guard.motion_prediction import MAX_AGE_S, VehicleState, lost_link_reach, turning_error_m
from tui_gcs.core.guard.separation_check import SPARE_M, SPARE_UP_M
from tui_gcs.core.protocol.common import KeepOut, Vec3
from tui_gcs.core.scenario.model import Limits


def keep_out(known: Sequence[VehicleState], limits: Limits) -> tuple[KeepOut, ...]:
    """The volumes of all lost vehicles among `known`.

    Each is as large from the first as it will become, and there until it is over: whoever flies round it plans once.
    """
    return tuple(volume for state in known if state.is_lost for volume in _of_one(state, limits))


def _of_one(state: VehicleState, limits: Limits) -> Iterator[KeepOut]:
    leaves_s = state.lost_link_behaviour.leaves_s if state.lost_link_behaviour is not None else 0.0
    settled = replace(state, age_s=max(state.age_s, leaves_s, MAX_AGE_S))
    here = replace(settled, error_m=settled.error_m + turning_error_m(settled, limits))
    for part in (here, *lost_link_paths([settled], limits, math.inf)):
        x, y, z = lost_link_reach(replace(part, age_s=math.inf), limits, np.zeros(1))[0].tolist()
        yield _volume(part, (x, y, z), limits)


def _volume(part: VehicleState, end_m: Vec3, limits: Limits) -> KeepOut:
    radius_m = limits.separation_horizontal_m + SPARE_M + part.error_m
    high_m = limits.separation_vertical_m + SPARE_UP_M
    heights_m = part.position_m[2], end_m[2]
    low_m, top_m = min(heights_m) - high_m, max(heights_m) + high_m
    return KeepOut(part.id, part.position_m[:2], end_m[:2], radius_m, low_m, top_m)
