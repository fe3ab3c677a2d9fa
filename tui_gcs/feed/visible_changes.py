"""Keys of what can be seen of a frame or a status: with equal keys it looks the same on every screen."""

import math
from typing import Any, get_type_hints

import numpy as np

from tui_gcs.core.protocol.common import FleetFrame, StationStatus
from tui_gcs.core.protocol.fleet import NotOnScreen, VehicleRow, VisibleAge, VisibleStep, column_name
from tui_gcs.core.protocol.metric_names import all_words, seen_pct
from tui_gcs.core.protocol.replay import ReplayStatus
from tui_gcs.core.protocol.services import VehicleInfo

Key = tuple[object, ...]


def steps(value: float, step: float) -> int | None:
    """`value` in whole steps; None when it is not known."""
    return round(value / step) if math.isfinite(value) else None


def whole_age_s(age_s: float) -> int | None:
    """Age as it is shown: nothing below one second, then whole seconds; None when never heard."""
    if not math.isfinite(age_s):
        return None
    return int(age_s) if age_s >= 1.0 else 0


def outside_tenths(value_m: float) -> int | None:
    """Distance outside an area in tenths of a metre, rounded up: 0 means inside; None when it is not known."""
    # Without `round` the last bit of a float counts as a tenth: 3.0000000000000004 would be 4.
    return math.ceil(round(value_m * 10.0, 3)) if math.isfinite(value_m) else None


def _marks(kind: type) -> dict[str, Any]:
    """Columns of a fleet frame whose declaration in `VehicleRow` carries a mark of this kind, and the mark."""
    hints = get_type_hints(VehicleRow, include_extras=True)
    marks = {column_name(name): hint.__metadata__[0] for name, hint in hints.items() if hasattr(hint, "__metadata__")}
    return {name: mark for name, mark in marks.items() if mark is kind or isinstance(mark, kind)}


_STEPS = {name: mark.step for name, mark in _marks(VisibleStep).items()}
"""The columns with numbers that change all the time, and the smallest change that can be seen."""
_AGES = tuple(_marks(VisibleAge))
_MARKED = {*_STEPS, *_AGES, *_marks(NotOnScreen)}
_WHOLE = (*(name for name in map(column_name, VehicleRow._fields) if name not in _MARKED), "tracks")


def visible_fleet(frame: FleetFrame) -> Key:
    """All columns, rounded to what a map and a roster can show. 250 vehicles take a millisecond."""
    rounded = [np.rint(np.array(getattr(frame, name)) / step) for name, step in _STEPS.items()]
    ages = [np.floor(np.array(getattr(frame, name))) for name in _AGES]
    numbers = [(np.nan_to_num(column, nan=-1e9) + 0.0).tobytes() for column in (*rounded, *ages)]  # -0.0 is 0.0
    return (frame.kind, int(frame.wall_s), *(getattr(frame, name) for name in _WHOLE), *numbers)


def visible_info(info: VehicleInfo) -> Key:
    """Everything that a panel shows of a vehicle's details, rounded."""
    d = info.details
    return (
        *(info.id, info.ready, info.firmware, info.uid, info.problems),
        *(info.mission_items, info.mission_current, info.home),
        *(steps(value, 1.0) for value in (d.roll_deg, d.pitch_deg, d.throttle_pct)),
        *(steps(value, 0.1) for value in (d.airspeed_m_s, d.battery_a, d.hdop, d.position_error_m)),
        *(steps(d.battery_left_s, 60.0), d.estimator, steps(info.rtt_s, 0.001), d.home_m),
    )


def visible_status(status: StationStatus) -> Key:
    """Everything of a status except counters that only grow, rounded."""
    teams = tuple(
        (
            *(team.name, team.zone, team.role, team.planner, team.members, team.worker, team.on_slot, team.slots),
            team.reserve,
            whole_age_s(team.plan_age_s),
            *(steps(team.rate_hz, 1.0), steps(team.worst_idleness_s, 0.1), steps(team.average_idleness_s, 0.1)),
            *(
                seen_pct(team.coverage, 0),
                steps(team.ideal_s, 0.1),
                steps(team.bound_s, 0.1),
                steps(team.ratio, 0.01),
                team.error,
            ),
            tuple(all_words(team.metrics)),
        )
        for team in status.teams
    )
    return (
        *(status.kind, status.scenario, status.revision, status.run, status.round_index, status.rounds),
        *(int(status.mission_time_s), status.heard, status.vehicles, status.armed, status.in_control, teams),
        tuple(status.not_ready.items()),
        tuple((link.name, link.up, link.error) for link in status.links),
        *(steps(status.min_separation_m, 0.1), outside_tenths(status.outside_area_m), tuple(status.vetoes.items())),
        *(status.recording, status.ending, status.alarms, status.preflight, tuple(status.homes.items())),
        *(tuple(status.if_silent.items()), tuple(status.planner_files.items()), status.points),
        _visible_replay(status.replay),
    )


def _visible_replay(replay: ReplayStatus | None) -> Key:
    if replay is None:
        return ()
    length_s = steps(replay.length_s, 1.0)
    return int(replay.at_s), length_s, replay.speed, replay.paused, replay.searching, replay.rewinds, replay.said
