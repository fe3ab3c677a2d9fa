"""One instance of a planner that runs on every vehicle: what it is given, what is kept of its output, how it fails.

An instance that fails once is restarted from its last snapshot. After the second time its vehicle holds, and the others
fly on.
"""

import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from tui_gcs.core.protocol.base import Message
from tui_gcs.core.protocol.common import Annotation, Intent, PlannerTask, decode, encode
from tui_gcs.core.protocol.plan_limits import MAX_ANNOTATIONS, MAX_BYTES_EACH, MAX_METRICS, MAX_NOTES
from tui_gcs.planner.api import Context, Event, Fleet, Output, ParamValue, Planner, Radio
from tui_gcs.planner.runtime.cpu_limit import cpu_limit
from tui_gcs.planner.runtime.message_conversion import plain_annotation, plain_intent
from tui_gcs.planner.runtime.message_network import rng_as_text, rng_from_text
from tui_gcs.planner.runtime.planner_errors import error_with_line, is_keyboard_interrupt

T = TypeVar("T")

STEP_LIMIT_S = 0.8
"""CPU time of one step of one instance. Two such steps in a row stay below the 2 s without a plan after which the
station lets the whole team hold."""
PLAN_BYTES, SNAPSHOT_BYTES = 1_000_000, 800_000
"""What all instances of a team may send in one plan beyond `MAX_BYTES_EACH`, and keep: the station's limits, less
reserves."""
MAX_REASON_CHARS = 200


class InstanceState(Message, frozen=True):
    """What an instance needs to go on. Field names are stored in snapshots."""

    data: bytes
    rng: dict[str, Any]
    started: bool
    failures: int
    error: str
    tokens: float
    radio_s: float


@dataclass
class VehicleInstance:
    """The planner of one vehicle."""

    kind: type[Planner]
    task: PlannerTask
    """The team's task with this instance's `vehicle`."""
    params: Mapping[str, ParamValue]
    rng: np.random.Generator
    radio: Radio
    planner: Planner | None = None
    error: str = ""
    """Why it is stopped; "" while it plans."""
    failures: int = 0
    started: bool = False
    snapshot: bytes = b""
    annotations: tuple[Annotation, ...] = ()
    metrics: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @property
    def vehicle(self) -> int:
        """The vehicle that it commands."""
        return self.task.vehicle

    def configure(self) -> BaseException | None:
        """Make the planner; return what it raised."""
        self.planner, self.started = self.kind(), False
        try:
            self.planner.configure(self.task, dict(self.params), self.rng)
        except BaseException as error:
            if is_keyboard_interrupt(error):
                raise
            self.planner, self.error, self.failures = None, self._line(), 2
            return error
        return None

    def step(self, context: Context, events: list[Event]) -> list[Intent]:
        """Return the intents for its own vehicle; a hold if it is stopped, and none for a step that failed."""
        if self.planner is None and not self.error:
            self._restart()
        planner = self.planner
        if planner is None:
            flies = bool((context.fleet.own & context.fleet.active).any())
            reason = f"its planner instance failed: {self.error}"
            return [Intent(self.vehicle, "hold", reason=reason)] if flies else []

        def run() -> list[Intent]:
            self._start(planner, context.t_s, context.fleet)
            for event in events:
                planner.event(event)
            return self._kept(planner.step(context))

        intents = self._guarded(run)
        return [] if intents is None else intents

    def keep_snapshot(self) -> None:
        """Ask the planner for a snapshot; one that fails or is too large is replaced by none, with a note."""
        planner = self.planner
        if planner is None or not self.started:
            return
        data = self._guarded(planner.snapshot)
        most = SNAPSHOT_BYTES // max(len(self.task.members), 1)
        if data is None:
            return
        if not isinstance(data, bytes) or len(data) > most:
            self.notes.append(f"vehicle {self.vehicle}: no snapshot: must be bytes, {most} at most on each vehicle")
            data = b""
        self.snapshot = data

    def state(self) -> InstanceState:
        """Return what `restore` needs."""
        rng = rng_as_text(self.rng.bit_generator.state)
        radio = self.radio
        return InstanceState(self.snapshot, rng, self.started, self.failures, self.error, radio.tokens, radio.t_s)

    def restore(self, state: InstanceState) -> None:
        """Go on where another instance was. Raises what the planner raises for a snapshot that it cannot use."""
        self.failures, self.error, self.snapshot = state.failures, state.error, state.data
        self.radio.tokens, self.radio.t_s = state.tokens, state.radio_s
        if self.error:
            self.planner = None
        elif self.planner is not None and state.started and state.data:
            self.planner.restore(state.data)
            self.started = True
        self.rng.bit_generator.state = rng_from_text(state.rng)

    def _start(self, planner: Planner, t_s: float, fleet: Fleet) -> None:
        if not self.started:
            planner.start(t_s, fleet)
            self.started = True

    def _restart(self) -> None:
        def again() -> None:
            planner = self.kind()
            planner.configure(self.task, dict(self.params), self.rng)
            if self.snapshot:
                planner.restore(self.snapshot)
            self.planner, self.started = planner, bool(self.snapshot)

        self._guarded(again)

    def _guarded(self, call: Callable[[], T]) -> T | None:
        """Return the result of `call`; None if it failed, which is noted."""
        try:
            with cpu_limit(STEP_LIMIT_S):
                return call()
        except BaseException as error:
            if is_keyboard_interrupt(error):
                raise
            self._failed(self._line())
            return None

    def _failed(self, line: str) -> None:
        self.planner = None
        self.failures += 1
        if self.failures > 1:
            self.error = line
            self.metrics = {}
        what = "its vehicle holds" if self.error else "it is restarted"
        self.notes.append(f"vehicle {self.vehicle}: its planner instance failed: {line}; {what}")

    def _line(self) -> str:
        source = getattr(sys.modules.get(self.kind.__module__), "__file__", None) or self.kind.__module__
        return error_with_line(traceback.format_exc(limit=8), Path(source))[:MAX_REASON_CHARS]

    def _kept(self, output: object) -> list[Intent]:
        """Keep a step's output and return its intents, checked so that one instance cannot spoil the team's plan.

        Raises:
            TypeError, ValueError: it is no valid Output.
        """
        if not isinstance(output, Output):
            raise TypeError(f"step returned {type(output).__name__}, not Output")
        members = max(len(self.task.members), 1)
        intents = [plain_intent(intent) for intent in islice(output.intents, 2 * members)]
        own = [decode(encode(intent), Intent) for intent in intents if intent.vehicle == self.vehicle]
        drawn = self.annotations
        if output.annotations is not None:
            most = max(1, MAX_ANNOTATIONS // members)
            drawn = tuple(decode(encode(plain_annotation(one)), Annotation) for one in islice(output.annotations, most))
        size = sum(len(encode(one)) for one in (*own, *drawn))
        if size > (allowed := PLAN_BYTES // members + MAX_BYTES_EACH):
            raise ValueError(f"intents and annotations of {size} bytes: at most {allowed}")
        self.annotations = drawn
        pairs = islice(output.metrics.items(), MAX_METRICS)
        # What one instance does not know (NaN) makes the mean of all unknown, and its gate fails, as with one for all.
        self.metrics = {str(key)[:64]: float(number) for key, number in pairs}
        self.notes += [f"vehicle {self.vehicle}: {note}"[:400] for note in islice(output.notes, MAX_NOTES)]
        return own


def decoded(data: bytes, message_type: Any) -> object:
    """Return a message's payload. Raises `msgspec.MsgspecError` if it is not of that type."""
    return msgspec.msgpack.decode(data, type=message_type)
