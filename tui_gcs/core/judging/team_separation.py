"""Where two teams come near each other, by the forecasts of their planners, for the plan screen and the planner check.

At the same time: both teams begin together from where their vehicles are. At different times: only pairs whose layers
have nothing to spare, because when a vehicle of another team comes by is not known, and the guard then holds them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.missions.scenario_findings import HEIGHT_HELD_M, ScenarioFinding
from tui_gcs.core.motion.separation import MIN_LIMIT_M
from tui_gcs.core.protocol.planning import FlownWays
from tui_gcs.core.scenario.model import Limits

Floats = NDArray[np.floating[Any]]
FAR_APART = 3.0
"""From this multiple of the allowed separation on, two teams get no line of their own in a list."""


@dataclass(frozen=True)
class Meeting:
    """The nearest approach of two vehicles of two teams."""

    vehicles: tuple[int, int]
    place_m: tuple[float, float]
    """The point halfway between them, in ENU metres."""
    beside_m: float
    above_m: float
    separation: float
    """In multiples of the allowed separation, as within a team."""
    after_s: float
    """Seconds from the beginning; NaN where they come by at different times."""


@dataclass(frozen=True)
class TeamSeparationFinding:
    """One finding about two teams."""

    teams: tuple[str, str]
    finding: ScenarioFinding
    separation: float


def findings(ways: Mapping[str, FlownWays], limits: Limits) -> list[TeamSeparationFinding]:
    """Findings about every two teams, the gravest first, then those that come nearest."""
    pairs = combinations([team for team in ways if ways[team].is_sound], 2)
    found = [each for one, other in pairs for each in _pair_findings(one, other, ways[one], ways[other], limits)]
    return sorted(found, key=lambda each: (-each.finding.level, each.separation))


def summary(found: list[TeamSeparationFinding]) -> list[ScenarioFinding]:
    """The findings as a list to be read: teams far apart share one line with the least of their separations."""
    near = [each.finding for each in found if each.finding.level > FindingLevel.NOTE or each.separation < FAR_APART]
    far = [each for each in found if each.finding.level <= FindingLevel.NOTE and each.separation >= FAR_APART]
    if len(far) < 2:
        return [each.finding for each in found]
    text = f"{len(far)} {'other ' if near else ''}pairs of teams: separation {far[0].separation:.1f} x or more"
    return [*near, ScenarioFinding(FindingLevel.NOTE, text, "")]


def _pair_findings(
    one_name: str, other_name: str, one: FlownWays, other: FlownWays, limits: Limits
) -> list[TeamSeparationFinding]:
    who, teams, found = f"{one_name} and {other_name}", (one_name, other_name), []
    if (at_once := nearest_at_once(one, other, limits)) is not None:
        text = f"separation {at_once.separation:.2f} x {_where(at_once)}"
        if at_once.separation < 1.0:
            text = f"too near, {text}"
        detail = f"{at_once.beside_m:.1f} m beside and {at_once.above_m:.1f} m above each other"
        detail += ": the guard would stop them" if at_once.separation < 1.0 else ""
        level = FindingLevel.CAUTION if at_once.separation < 1.0 else FindingLevel.NOTE
        finding = ScenarioFinding(level, f"{who}: {text}", detail)
        found.append(TeamSeparationFinding(teams, finding, at_once.separation))
    if (crossing := tightest_crossing(one, other, limits)) is not None:
        text = f"{who}: ways cross {_where(crossing)}, {crossing.above_m:.1f} m above each other"
        why = f"heights are off by up to {HEIGHT_HELD_M:g} m: the guard will hold who comes while the other is there"
        found.append(
            TeamSeparationFinding(teams, ScenarioFinding(FindingLevel.CAUTION, text, why), crossing.separation)
        )
    return found


def _where(meeting: Meeting) -> str:
    (x, y), (one, other) = meeting.place_m, meeting.vehicles
    when = "" if math.isnan(meeting.after_s) else f"after {meeting.after_s:.0f} s "
    return f"{when}at [{x:.0f} {y:.0f}] ({one} and {other})"


def nearest_at_once(one: FlownWays, other: FlownWays, limits: Limits) -> Meeting | None:
    """The nearest approach of all moments that both have a forecast for, straight between steps."""
    a, b = _places(one), _places(other)
    if not len(a) or not len(b):
        return None
    steps = min(a.shape[1], b.shape[1])
    apart = b[None, :, :steps] - a[:, None, :steps]  # (of one, of the other, moment, 3)
    start, way = apart[:, :, :-1], np.diff(apart, axis=2)
    # The nearest point of two straight ways within a step, by the usual quadratic; a step without relative motion has
    # none.
    speed2 = (way[..., :2] ** 2).sum(axis=-1)
    share = np.clip(-(start[..., :2] * way[..., :2]).sum(axis=-1) / np.maximum(speed2, 1e-12), 0.0, 1.0)
    nearest = start + way * share[..., None]
    beside, above = np.hypot(nearest[..., 0], nearest[..., 1]), np.abs(nearest[..., 2])
    times = np.maximum(
        beside / max(limits.separation_horizontal_m, MIN_LIMIT_M),
        above / max(limits.separation_vertical_m, MIN_LIMIT_M),
    )
    if not times.size or not np.isfinite(times).any():
        return None
    # The same height again and again is the least: then the moment when they are nearest beside each other.
    i, j, k = np.unravel_index(int(np.lexsort((beside.ravel(), np.round(times.ravel(), 3)))[0]), times.shape)
    middle = a[i, k, :2] + (a[i, k + 1, :2] - a[i, k, :2]) * share[i, j, k] + nearest[i, j, k, :2] / 2.0
    return Meeting(
        (one.ids[i], other.ids[j]),
        (float(middle[0]), float(middle[1])),
        float(beside[i, j, k]),
        float(above[i, j, k]),
        float(times[i, j, k]),
        float((k + share[i, j, k]) * one.step_s),
    )


def _places(ways: FlownWays) -> Floats:
    """The places as an array (vehicles, moments, 3), in metres."""
    return np.array(ways.places_m, dtype=float).reshape(len(ways.ids), -1, 3)


def tightest_crossing(one: FlownWays, other: FlownWays, limits: Limits) -> Meeting | None:
    """The tightest crossing of ways at different times, of layers that have nothing to spare; None without one."""
    # Both vehicles may be off their layer, each in the worse direction.
    spare_m = limits.separation_vertical_m + 2.0 * HEIGHT_HELD_M
    found = [
        meeting
        for i, (low_a, high_a) in enumerate(_heights(one))
        for j, (low_b, high_b) in enumerate(_heights(other))
        if (gap_m := max(low_b - high_a, low_a - high_b, 0.0)) < spare_m
        and (meeting := _crossing(one, i, other, j, gap_m, limits)) is not None
    ]
    return min(found, key=lambda meeting: (meeting.above_m, meeting.beside_m), default=None)


def _heights(ways: FlownWays) -> list[tuple[float, float]]:
    return [(min(z for _, _, z in places), max(z for _, _, z in places)) for places in ways.places_m if places]


def _crossing(one: FlownWays, i: int, other: FlownWays, j: int, gap_m: float, limits: Limits) -> Meeting | None:
    a, b = _drawn(one, i), _drawn(other, j)
    beside_m = float(shapely.distance(a, b))
    if beside_m >= limits.separation_horizontal_m:
        return None
    ends = shapely.get_coordinates(shapely.shortest_line(a, b))
    x, y = ends.mean(axis=0).tolist()
    times = max(beside_m, MIN_LIMIT_M) / max(limits.separation_horizontal_m, MIN_LIMIT_M)
    above = gap_m / max(limits.separation_vertical_m, MIN_LIMIT_M)
    return Meeting((one.ids[i], other.ids[j]), (x, y), beside_m, gap_m, max(times, above), math.nan)


def _drawn(ways: FlownWays, i: int) -> shapely.MultiLineString:
    """A vehicle's whole way on the ground plan, and the tours that any vehicle of its team may fly."""
    lines = [[(x, y) for x, y, _ in ways.places_m[i]], *(list(loop) for loop in ways.loops_m)]
    return shapely.MultiLineString([line if len(line) > 1 else line * 2 for line in lines if line])
