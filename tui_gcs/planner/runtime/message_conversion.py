"""Conversions between bus messages and what planners work with.

Fleet frames become structs of arrays, ordered by id, read only. Intents and annotations that planners filled with numpy
arrays and scalars become plain tuples and numbers, which msgpack can carry.
"""

from collections.abc import Iterable, Sequence
from typing import Any, get_args, get_type_hints

import msgspec
import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.protocol.common import Annotation, AnyFrame, Freshness, Intent, Phase, PlannerTask, Track
from tui_gcs.planner.api import Fleet, Points, Tracks

_FIELDS = Intent.__struct_fields__
_PLAIN_TYPES = frozenset({str, int, float, bool, type(None)})
_ANNOTATION_KINDS = get_args(get_type_hints(Annotation)["kind"])


def team_view(frame: AnyFrame, task: PlannerTask) -> Fleet:
    """Return the task's members in `frame`, ordered by id. A vehicle without a position is not active."""
    place = {vehicle: i for i, vehicle in enumerate(frame.ids)}
    ids = sorted(m for m in task.members if m in place)
    rows = [place[vehicle] for vehicle in ids]
    position = np.array([frame.position_m[i] for i in rows], dtype=float).reshape(-1, 3)
    flying = [frame.phase[i] == Phase.FLYING and frame.freshness[i] != Freshness.LOST for i in rows]
    fleet = Fleet(
        id=np.array(ids, dtype=np.int64),
        active=np.array(flying, dtype=bool) & np.isfinite(position).all(axis=1),
        position_m=position,
        velocity_m_s=np.array([frame.velocity_m_s[i] for i in rows], dtype=float).reshape(-1, 3),
        heading_deg=np.array([frame.heading_deg[i] for i in rows], dtype=float),
        age_s=np.array([frame.age_s[i] for i in rows], dtype=float),
        layer_m=np.array([task.layers_m.get(vehicle, np.nan) for vehicle in ids], dtype=float),
        battery_pct=np.array([frame.battery_pct[i] for i in rows], dtype=float),
        held=np.array([frame.phase[i] in (Phase.HOLDING, Phase.BY_HAND) for i in rows], dtype=bool),
        own=np.ones(len(ids), dtype=bool),
        battery_left_s=_optional(frame.battery_left_s, rows),
        home_s=_optional(frame.home_s, rows),
        **class_columns(ids, task),
    )
    read_only(vars(fleet).values())
    return fleet


def _optional(column: tuple[float, ...], rows: list[int]) -> NDArray[np.float64]:
    """Return the rows of a column that frames may lack; NaN then."""
    return np.array([column[i] for i in rows] if column else [np.nan] * len(rows), dtype=float)


def class_columns(ids: Sequence[int], task: PlannerTask) -> dict[str, NDArray[np.float64]]:
    """Return the columns of a `Fleet` that follow from the classes of its vehicles."""
    kinds = [task.class_of(vehicle) for vehicle in ids]
    return {
        "speed_m_s": np.array([kind.speed_m_s for kind in kinds], dtype=float),
        "accel_m_s2": np.array([kind.accel_m_s2 for kind in kinds], dtype=float),
        "footprint_radius_m": np.array([kind.footprint_radius_m for kind in kinds], dtype=float),
    }


def tracks_view(frame: AnyFrame) -> Tracks:
    """Return the frame's tracks as struct of arrays, extrapolated to the frame's time."""
    return _tracks_at(frame.tracks, frame.t_s) if frame.tracks else NO_TRACKS


def points_view(frame: AnyFrame, team: str) -> Points:
    """Return the open points of interest of a team, with the time that is left for each."""
    mine = [point for point in frame.points if point.team in ("", team)]
    if not mine:
        return NO_POINTS
    view = Points(
        tuple(point.name for point in mine),
        np.array([point.place_m for point in mine], dtype=float).reshape(-1, 2),
        np.array([point.priority for point in mine], dtype=float),
        np.array([point.due_s - frame.t_s for point in mine], dtype=float),
    )
    read_only(vars(view).values())
    return view


def _tracks_at(tracks: tuple[Track, ...], t_s: float) -> Tracks:
    age_s = np.array([t_s - track.seen_s for track in tracks], dtype=float)
    velocity = np.array([track.velocity_m_s for track in tracks], dtype=float).reshape(-1, 3)
    position = np.array([track.position_m for track in tracks], dtype=float).reshape(-1, 3)
    # The larger eigenvalue of a symmetric 2 x 2 covariance (xx, xy, yy) is mean + hypot(half, xy).
    cov = np.array([track.covariance_m2 for track in tracks], dtype=float).reshape(-1, 3)
    mean, half = (cov[:, 0] + cov[:, 2]) / 2, (cov[:, 0] - cov[:, 2]) / 2
    view = Tracks(
        id=np.array([track.id for track in tracks], dtype=np.int64),
        position_m=position + velocity * age_s[:, None],
        velocity_m_s=velocity,
        sigma_m=np.sqrt(np.maximum(mean + np.hypot(half, cov[:, 1]), 0.0)),
        age_s=age_s,
        confirmed=np.array([track.confirmed for track in tracks], dtype=bool),
        seen_by=tuple(track.seen_by for track in tracks),
    )
    read_only(vars(view).values())
    return view


def read_only(columns: Iterable[NDArray[Any] | tuple[Any, ...]]) -> None:
    """Make the arrays read-only, so that a planner that writes into them fails at that line."""
    for column in columns:
        if isinstance(column, np.ndarray):
            column.flags.writeable = False


NO_POINTS = Points()
NO_TRACKS = _tracks_at((), 0.0)


def plain_intent(intent: object) -> Intent:
    """Return `intent` without numpy types. Raises TypeError if it is no Intent."""
    if not isinstance(intent, Intent):
        raise TypeError(f"an intent is an Intent, not {type(intent).__name__}")
    values = msgspec.structs.astuple(intent)
    converted = [k for k, value in enumerate(values) if type(value) not in _PLAIN_TYPES and _needs_conversion(value)]
    return (
        msgspec.structs.replace(intent, **{_FIELDS[k]: _plain(values[k]) for k in converted}) if converted else intent
    )


def plain_annotation(drawing: object) -> Annotation:
    """Return `drawing` without numpy types in its points. Raises TypeError or ValueError if it is not valid."""
    if not isinstance(drawing, Annotation):
        raise TypeError(f"an annotation is an Annotation, not {type(drawing).__name__}")
    if drawing.kind not in _ANNOTATION_KINDS:
        raise ValueError(f"an annotation is one of {', '.join(_ANNOTATION_KINDS)}, not {drawing.kind!r}")
    points = drawing.points_m
    if isinstance(points, tuple) and not any(map(_needs_conversion, points)):
        return drawing
    return msgspec.structs.replace(drawing, points_m=_plain(points))


def _needs_conversion(value: Any) -> bool:
    """Return whether the value, or its first row, holds numpy types or lists. Mixed rows are detected when sent."""
    while isinstance(value, tuple) and value and isinstance(value[0], tuple):
        value = value[0]
    return not _PLAIN_TYPES.issuperset(map(type, value if isinstance(value, tuple) else (value,)))


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    return tuple(_plain(part) for part in value) if isinstance(value, (list, tuple)) else value
