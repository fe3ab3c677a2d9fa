"""Slots: n places on a tour, equally spaced in time, and their assignment when the number of vehicles changes."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.lazy_scipy import min_cost_columns
from tui_gcs.planner.patrol.tour import Tour
from tui_gcs.planner.patrol.transit import rendezvous_s

Floats = NDArray[np.floating[Any]]

LAP_STEP_S = 0.5
"""Spacing of the tour's points for rendezvous estimates."""
SHIFTS_PER_SPACING = 24
"""How many shifts of all slots together are tried within one slot spacing."""
SAME_SHARE = 1e-9
"""Share of a spacing by which rounding may put a vehicle ahead of its slot."""
ALIGNED_M = 4.0
ALIGNED_M_S = 2.0
"""A vehicle is on its slot already if it is within 4 m of its place and within 2 m/s of its velocity."""


@dataclass(frozen=True)
class SlotPairing:
    """`phase_s[i]` is where on the tour the slot of vehicle i is now, `slot[i]` its number, 0 … n - 1."""

    phase_s: Floats
    slot: NDArray[np.int64]


def assign(xy_m: Floats, velocity_m_s: Floats, tour: Tour, speed_m_s: float) -> SlotPairing:
    """Return slots for n vehicles: the common shift and pairing with the smallest sum of cubed rendezvous times.

    The cube makes the slowest vehicle count most (docs/planning.md C2). The order of the vehicles does not matter.
    """
    n = len(xy_m)
    spacing_s = tour.period_s / n
    steps = max(8, round(tour.period_s / LAP_STEP_S))
    step_s = tour.period_s / steps
    meet_s = rendezvous_s(xy_m, tour.at(step_s * np.arange(steps))[0], step_s, speed_m_s)
    shifts = spacing_s * np.arange(SHIFTS_PER_SPACING) / SHIFTS_PER_SPACING
    # Ties are broken by place, not by the order of vehicles.
    order = np.lexsort((xy_m[:, 1], xy_m[:, 0]))
    best: tuple[float, Floats, NDArray[np.int64]] | None = None
    for shift_s in shifts:
        phases = shift_s + spacing_s * np.arange(n)
        cost = _waiting(meet_s, phases, step_s, xy_m, velocity_m_s, tour)[order] ** 3
        columns = min_cost_columns(cost)
        total = float(cost[np.arange(n), columns].sum())
        if best is None or total < best[0] - 1e-6:
            best = (total, phases, columns)
    if best is None:
        raise ValueError("no vehicles to assign")
    slot = np.empty(n, dtype=np.int64)
    slot[order] = best[2]
    return SlotPairing(best[1][slot], slot)


def _waiting(meet_s: Floats, phases: Floats, step_s: float, xy: Floats, velocity: Floats, tour: Tour) -> Floats:
    """Return (n, n) times until vehicle i is on the slot now at phases[j]; 0 for a vehicle that is on it."""
    column = np.round(phases / step_s).astype(np.int64) % meet_s.shape[1]
    waiting = meet_s[:, column]
    place_m, course_velocity_m_s = tour.at(phases)
    # A vehicle on its slot already needs no time for speeding up and turning in, which the estimate includes.
    near = np.hypot(*(xy[:, None] - place_m[None]).transpose(2, 0, 1)) <= ALIGNED_M
    same_velocity = np.hypot(*(velocity[:, None] - course_velocity_m_s[None]).transpose(2, 0, 1)) <= ALIGNED_M_S
    return np.where(near & same_velocity, 0.0, waiting)


def waiting_s(xy: Floats, velocity: Floats, phases: Floats, tour: Tour, speed_m_s: float) -> Floats:
    """Return (n, k) times until each of n vehicles can be on the slots that are at k phases now."""
    steps = max(8, round(tour.period_s / LAP_STEP_S))
    step_s = tour.period_s / steps
    meet_s = rendezvous_s(xy, tour.at(step_s * np.arange(steps))[0], step_s, speed_m_s)
    return _waiting(meet_s, phases, step_s, xy, velocity, tour)


def delayed(phase_s: Floats, n: int, period_s: float, least_s: float) -> tuple[Floats, NDArray[np.int64]]:
    """Return new phases and slot numbers: k vehicles, 1 <= k <= n, are delayed to n slots without changing order.

    Slots are `period_s / n` apart. No vehicle is moved forward; the one that is delayed least is delayed by `least_s`,
    and the one that is delayed most as little as possible: where a few of many are on the tour yet they stay together,
    and the slots between them are left to others only where there is room.
    """
    phase, spacing_s, count = phase_s % period_s, period_s / n, np.arange(len(phase_s))
    order = np.argsort(-phase, kind="stable")
    gap_s = (np.roll(phase[order], 1) - phase[order]) % period_s
    gap_s[gap_s == 0.0] = period_s if len(order) == 1 else 0.0
    # The first has the largest gap ahead of it: there is most room for the last, which comes to its other end.
    order = np.roll(order, -int(gap_s.argmax()))
    behind_s = (phase[order[0]] - phase[order]) % period_s
    evenly = count * n // len(count)
    best = (math.inf, 0.0, evenly)
    for offset_s in np.unique(behind_s % spacing_s).tolist():
        slots = count + np.maximum.accumulate(np.ceil((behind_s - offset_s) / spacing_s - SAME_SHARE) - count)
        most_s = float((offset_s + slots * spacing_s - behind_s).max())
        if slots[-1] < n and most_s < best[0]:
            best = most_s, offset_s, slots.astype(np.int64)
    _, offset_s, slots = best
    if math.isinf(best[0]):
        offset_s = float((behind_s - evenly * spacing_s).max())
    later_s = offset_s + slots * spacing_s - behind_s
    phases, numbers = np.empty(len(phase_s)), np.empty(len(phase_s), dtype=np.int64)
    phases[order] = phase[order] - later_s - (least_s - later_s.min())
    numbers[order] = -slots % n
    return phases, numbers
