"""Intents as they travel: numpy arrays and scalars, which planners work with, become tuples and numbers."""

from typing import Any

import msgspec
import numpy as np

from tui_gcs.core.messages import Intent

_FIELDS = Intent.__struct_fields__


def plain_intent(intent: object) -> Intent:
    """`intent` without anything of numpy's. Raises TypeError if it is none."""
    if not isinstance(intent, Intent):
        raise TypeError(f"an intent is an Intent, not {type(intent).__name__}")
    odd = {name: _plain(value) for name in _FIELDS if _is_odd(value := getattr(intent, name))}
    return msgspec.structs.replace(intent, **odd) if odd else intent


def _is_odd(value: Any) -> bool:
    """Whether it, or the first row of it, holds something of numpy's or a list. A mixture is told when it is sent."""
    while isinstance(value, tuple) and value and isinstance(value[0], tuple):
        value = value[0]
    parts = value if isinstance(value, tuple) else (value,)
    return any(isinstance(part, (np.generic, np.ndarray, list)) for part in parts)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    return tuple(_plain(part) for part in value) if isinstance(value, (list, tuple)) else value
