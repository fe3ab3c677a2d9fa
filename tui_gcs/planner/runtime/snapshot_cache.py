"""Packs a planner's snapshot with the host's own state, so that another host continues exactly where this one was."""

import hashlib
import json
from typing import Any

import msgspec
import numpy as np

from tui_gcs.core.protocol.base import Message
from tui_gcs.core.protocol.common import PlannerTask, encode
from tui_gcs.core.protocol.plan_limits import MAX_LEARNT_BYTES
from tui_gcs.planner.api import API_VERSION, Planner
from tui_gcs.planner.runtime.team_changes import ReportedState, TeamChangeDetector

MAX_SNAPSHOT_BYTES = 1_000_000
"""Largest snapshot of a planner: the station holds one per team."""


class PlannerSnapshot(Message, frozen=True):
    """A planner's snapshot and the host's state that belongs to it.

    Its field names are stored with the station's state.
    """

    api: int
    planner: str
    version: str
    task: bytes
    """Digest of the task; a snapshot of another task is not restored."""
    t_s: float
    rng: str
    state: dict[int, ReportedState]
    low: list[int]
    credit: float
    data: bytes
    learnt: bytes = b""


def task_digest(task: PlannerTask) -> bytes:
    """Return a digest that is equal for tasks that ask for the same."""
    return hashlib.sha256(encode(msgspec.structs.replace(task, t_s=0.0, revision=0))).digest()


def pack(
    planner: Planner,
    task: PlannerTask,
    t_s: float,
    rng: np.random.Generator,
    changes: TeamChangeDetector,
    credit: float,
) -> bytes:
    """Return everything that the next host needs; b"" if the planner keeps nothing.

    Raises:
        TypeError: its snapshot, or what it learnt, is no bytes.
        ValueError: they are too large.
    """
    data, learnt = planner.snapshot(), learnt_bytes(planner)
    if not isinstance(data, bytes):
        raise TypeError(f"a snapshot must be bytes, not {type(data).__name__}")
    if (size := len(data) + len(learnt)) > MAX_SNAPSHOT_BYTES:
        raise ValueError(f"a snapshot of {size / 1e6:.1f} MB: at most {MAX_SNAPSHOT_BYTES / 1e6:g} MB are kept")
    if not data and not learnt:
        return b""
    rng_state = json.dumps(rng.bit_generator.state)
    version = str(planner.version)
    of_task = task_digest(task)
    kept = PlannerSnapshot(
        API_VERSION, planner.name, version, of_task, t_s, rng_state, changes.state, changes.low, credit, data, learnt
    )
    return encode(kept)


def learnt_bytes(planner: Planner) -> bytes:
    """Return what a planner hands on to the next task. Raises TypeError if that is no bytes."""
    learnt = planner.learnt()
    if not isinstance(learnt, bytes):
        raise TypeError(f"what a planner learnt must be bytes, not {type(learnt).__name__}")
    return learnt


def pack_learnt(planner: Planner) -> bytes:
    """Return what a planner has learnt, as a snapshot without a task; b"" if it has learnt nothing.

    Raises:
        TypeError: it is no bytes.
        ValueError: it is too large.
    """
    learnt = learnt_bytes(planner)
    if not learnt:
        return b""
    packed = encode(
        PlannerSnapshot(API_VERSION, planner.name, str(planner.version), b"", 0.0, "", {}, [], 0.0, b"", learnt)
    )
    if len(packed) > MAX_LEARNT_BYTES:
        most = f"at most {MAX_LEARNT_BYTES / 1e3:g} kB outlive this task and the station"
        raise ValueError(f"it learnt {len(packed) / 1e3:.1f} kB: {most}")
    return packed


def unpack_for(packed: bytes, planner: Planner) -> PlannerSnapshot | str:
    """Return the snapshot, of whatever task, or the reason why `planner` cannot use it."""
    try:
        kept = msgspec.msgpack.decode(packed, type=PlannerSnapshot)
    except msgspec.MsgspecError:
        return "is not readable"
    if (kept.api, kept.planner, kept.version) != (API_VERSION, planner.name, str(planner.version)):
        return f"is of {kept.planner} {kept.version}"
    return kept


def rng_state(kept: PlannerSnapshot) -> dict[str, Any]:
    """Return the state of the random generator in the form that numpy takes."""
    state: dict[str, Any] = json.loads(kept.rng)
    return state
