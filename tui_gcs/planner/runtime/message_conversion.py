"""Intents and drawings as they travel: numpy arrays and scalars, which planners work with, become plain ones."""

from typing import Any, get_args, get_type_hints

import msgspec
import numpy as np

from tui_gcs.core.protocol.common import Annotation, Intent

_FIELDS = Intent.__struct_fields__
_TRAVELS = frozenset({str, int, float, bool, type(None)})
_DRAWN = get_args(get_type_hints(Annotation)["kind"])


def plain_intent(intent: object) -> Intent:
    """`intent` without anything of numpy's. Raises TypeError if it is none."""
    if not isinstance(intent, Intent):
        raise TypeError(f"an intent is an Intent, not {type(intent).__name__}")
    values = msgspec.structs.astuple(intent)
    odd = [k for k, value in enumerate(values) if type(value) not in _TRAVELS and _is_odd(value)]
    return msgspec.structs.replace(intent, **{_FIELDS[k]: _plain(values[k]) for k in odd}) if odd else intent


def plain_annotation(drawing: object) -> Annotation:
    """`drawing` without anything of numpy's in any of its points. Raises TypeError or ValueError if it is none."""
    if not isinstance(drawing, Annotation):
        raise TypeError(f"an annotation is an Annotation, not {type(drawing).__name__}")
    if drawing.kind not in _DRAWN:
        raise ValueError(f"an annotation is one of {', '.join(_DRAWN)}, not {drawing.kind!r}")
    points = drawing.points_m
    if isinstance(points, tuple) and not any(map(_is_odd, points)):
        return drawing
    return msgspec.structs.replace(drawing, points_m=_plain(points))


def _is_odd(value: Any) -> bool:
    """Whether it, or the first row of it, holds something of numpy's or a list. A mixture is told when it is sent."""
    while isinstance(value, tuple) and value and isinstance(value[0], tuple):
        value = value[0]
    return not _TRAVELS.issuperset(map(type, value if isinstance(value, tuple) else (value,)))


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    return tuple(_plain(part) for part in value) if isinstance(value, (list, tuple)) else value
