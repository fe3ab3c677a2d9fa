"""What a planner's host keeps of it, so that another one goes on exactly where this one was."""

import hashlib
import json
from typing import Any

import msgspec
import numpy as np

from tui_gcs.core.protocol.base import Message
from tui_gcs.core.protocol.common import PlannerTask, encode
from tui_gcs.core.protocol.plan_limits import MAX_LEARNT_BYTES
from tui_gcs.planner.api import API_VERSION, Planner
from tui_gcs.planner.runtime.team_changes import Changes, State

MAX_BYTES = 1_000_000
"""Of a planner's own snapshot: the station holds one per team."""


class Kept(Message, frozen=True):
    """A snapshot, and what belongs to it on the host's side."""

    api: int
    planner: str
    version: str
    task: bytes
    """Digest of what the task asks for: another zone is another plan."""
    t_s: float
    rng: str
    state: dict[int, State]
    low: list[int]
    credit: float
    data: bytes
    learnt: bytes = b""


def digest(task: PlannerTask) -> bytes:
    """Equal for tasks that ask for the same."""
    return hashlib.sha256(encode(msgspec.structs.replace(task, t_s=0.0, revision=0))).digest()


def pack(
    planner: Planner, task: PlannerTask, t_s: float, rng: np.random.Generator, changes: Changes, credit: float
) -> bytes:
    """Everything that the next host needs; b"" if the planner keeps nothing.

    Raises:
        TypeError: its snapshot, or what it learnt, is no bytes.
        ValueError: they are too large.
    """
    data, learnt = planner.snapshot(), learnt_by(planner)
    if not isinstance(data, bytes):
        raise TypeError(f"a snapshot must be bytes, not {type(data).__name__}")
    if (size := len(data) + len(learnt)) > MAX_BYTES:
        raise ValueError(f"a snapshot of {size / 1e6:.1f} MB: at most {MAX_BYTES / 1e6:g} MB are kept")
    if not data and not learnt:
        return b""
    rng_state = json.dumps(rng.bit_generator.state)
    version = str(planner.version)
    of_task = digest(task)
    kept = Kept(
        API_VERSION, planner.name, version, of_task, t_s, rng_state, changes.state, changes.low, credit, data, learnt
    )
    return encode(kept)


def learnt_by(planner: Planner) -> bytes:
    """What it would hand on. Raises TypeError if that is no bytes."""
    learnt = planner.learnt()
    if not isinstance(learnt, bytes):
        raise TypeError(f"what a planner learnt must be bytes, not {type(learnt).__name__}")
    return learnt


def pack_learnt(planner: Planner) -> bytes:
    """What it learnt alone, as a snapshot of no task; b"" if that is nothing.

    Raises:
        TypeError: it is no bytes.
        ValueError: it is too large.
    """
    learnt = learnt_by(planner)
    if not learnt:
        return b""
    packed = encode(Kept(API_VERSION, planner.name, str(planner.version), b"", 0.0, "", {}, [], 0.0, b"", learnt))
    if len(packed) > MAX_LEARNT_BYTES:
        most = f"at most {MAX_LEARNT_BYTES / 1e3:g} kB outlive this task and the station"
        raise ValueError(f"it learnt {len(packed) / 1e3:.1f} kB: {most}")
    return packed


def of_kind(packed: bytes, planner: Planner) -> Kept | str:
    """What was kept, of whatever task, or why it is not of use for this planner."""
    try:
        kept = msgspec.msgpack.decode(packed, type=Kept)
    except msgspec.MsgspecError:
        return "is not readable"
    if (kept.api, kept.planner, kept.version) != (API_VERSION, planner.name, str(planner.version)):
        return f"is of {kept.planner} {kept.version}"
    return kept


def rng_state(kept: Kept) -> dict[str, Any]:
    """The state of the random numbers, as numpy takes it."""
    state: dict[str, Any] = json.loads(kept.rng)
    return state
