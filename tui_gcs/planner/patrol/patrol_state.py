"""The state of a patrol and its exact encoding: a restarted worker's plans are the same bit for bit."""

from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.api import KeepOut
from tui_gcs.planner.patrol.formation import Formation
from tui_gcs.planner.patrol.speed_adaptation import SpeedAdaptation
from tui_gcs.planner.patrol.tour_search import TourSearch
from tui_gcs.planner.patrol.tour_site import TourDesign, TourSite
from tui_gcs.planner.patrol.tour_smoothing import TourDraft

MAX_SNAPSHOT_BYTES = 900_000
"""Hosts refuse larger snapshots; with many vehicles on long ways to their slots there is none."""


@dataclass
class PatrolState:
    """What a step leaves for the next one. Field names are stored in snapshots."""

    search: TourSearch
    design: TourDesign
    """The tour that is flown."""
    formation: Formation
    drawn_s: float = -np.inf
    quiet_s: float = -np.inf
    """No other tour is adopted before this time."""
    tempo: SpeedAdaptation = field(default_factory=SpeedAdaptation)
    keep_out: tuple[KeepOut, ...] = ()
    """Where lost vehicles may be: the tour is led round it."""


class _Array(msgspec.Struct, frozen=True, array_like=True):
    shape: tuple[int, ...]
    data: bytes
    """64-bit floats in C order."""


class _Design(msgspec.Struct, frozen=True, array_like=True):
    draft: TourDraft
    n: int


def encode(state: PatrolState) -> bytes:
    """Return the state as msgpack; b"" if that is too long."""
    return encode_exactly(state)


def decode(data: bytes, site: TourSite) -> PatrolState:
    """Return the state that `encode` gave. Its tours are computed again from their drafts.

    Raises:
        ValueError: the bytes are no state of a patrol.
    """

    def unpacked(kind: Any, value: Any) -> Any:
        if kind is TourDesign:
            kept = msgspec.convert(value, _Design, dec_hook=unpacked)
            return site.judged(kept.draft, kept.n)
        return array_of(kind, value)

    return msgspec.msgpack.decode(data, type=PatrolState, dec_hook=unpacked)


def encode_exactly(state: object) -> bytes:
    """Return a planner's state with numpy arrays as msgpack, every bit of the numbers kept; b"" if that is too long."""
    data = msgspec.msgpack.encode(state, enc_hook=_packed)
    return data if len(data) <= MAX_SNAPSHOT_BYTES else b""


def array_of(_kind: Any, value: Any) -> NDArray[np.float64]:
    """Return an array that `encode_exactly` packed: the `dec_hook` of msgspec."""
    packed = msgspec.convert(value, _Array)
    return np.frombuffer(packed.data, dtype=np.float64).reshape(packed.shape).copy()


def _packed(value: Any) -> Any:
    if isinstance(value, TourDesign):
        return _Design(value.draft, value.n)
    if isinstance(value, np.ndarray):
        return _Array(value.shape, np.ascontiguousarray(value, dtype=np.float64).tobytes())
    if isinstance(value, np.generic):
        return value.item()
    raise NotImplementedError(f"{type(value).__name__} is no part of a patrol's state")
