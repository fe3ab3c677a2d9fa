"""Reading and setting single parameters by name: what is repeated, and which answers confirm.

ArduPilot does not answer at all to a name that it does not have; PX4 sends PARAM_ERROR. Both send PARAM_VALUE after a
PARAM_SET. ArduPilot's may carry another value than requested (truncated, clamped), and any PARAM_VALUE may be older
than the request. Reference: docs/autopilots.md C4.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from tui_gcs.core.base.float32 import shown
from tui_gcs.core.services.parameters.param_channel import ParamChannel
from tui_gcs.core.services.parameters.param_values import Number, Parameter, same

READ_TRIES, SET_TRIES = 10, 5
"""How often a parameter is requested and set: reads belong to the stop class, sets are tried three to five times
(docs/threats.md C.4)."""
# Time between two copies of a question; the second number is for slow links.
GAP_S, SLOW_GAP_S = 0.5, 1.5
AT_ONCE, SLOW_AT_ONCE = 10, 3
"""How many names may be requested and not answered yet; QGroundControl allows 10, too (docs/autopilots.md C4)."""
MAX_NAMES_ASKED = 500
NOT_KNOWN = "not known whether it was set"
"""How the error of a parameter ends that was sent, and of which it is not known whether it was set."""
UNKNOWN = "no answer: it has no such parameter, or does not hear us"

ERRORS = {
    1: "it has no such parameter",
    2: "the value is outside of what it takes",
    3: "permission denied",
    4: "no such component",
    5: "it cannot be written",
    6: "the type is not supported",
    7: "the type is another one",
    8: "it could not be read",
}
"""Texts for PARAM_ERROR.error (MAV_PARAM_ERROR)."""


def error_words(code: int) -> str:
    """The text for a PARAM_ERROR."""
    return ERRORS.get(code, f"refused with error {code}")


@dataclass
class PendingRead:
    """How often one name was requested, and when it is due again."""

    tries: int = 0
    due_s: float = 0.0


@dataclass
class ParamReading:
    """Parameters of one vehicle that are being read by name."""

    vehicle: int
    values: dict[str, Parameter] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    """Why a name has no value."""
    open: dict[str, PendingRead] = field(default_factory=dict)
    on_done: "Callable[[ParamReading], None] | None" = None

    @property
    def over(self) -> bool:
        """Whether each name was answered or given up."""
        return not self.open

    def tick(self, channel: ParamChannel, now: float, *, slow: bool) -> None:
        """Request what is due, and give up what was requested often enough."""
        at_once, gap_s = (SLOW_AT_ONCE, SLOW_GAP_S) if slow else (AT_ONCE, GAP_S)
        # A few at a time, as QGroundControl does (docs/autopilots.md C4).
        for name, pending in list(self.open.items())[:at_once]:
            if now < pending.due_s:
                continue
            if pending.tries >= READ_TRIES:
                self.miss(name, UNKNOWN)
                continue
            pending.tries += 1
            pending.due_s = now + gap_s
            channel.ask_name(self.vehicle, name)

    def on_value(self, param: Parameter) -> None:
        """Take a value that the vehicle reported."""
        if self.open.pop(param.name, None) is not None:
            self.values[param.name] = param

    def miss(self, name: str, why: str) -> None:
        """Give up one name, for the reason `why`."""
        if self.open.pop(name, None) is not None:
            self.missing[name] = why


@dataclass
class ParamSetting:
    """One parameter that is being set. If its type is not known, it is read first."""

    vehicle: int
    name: str
    value: Number
    on_done: "Callable[[ParamSetting], None] | None" = None
    known: Parameter | None = None
    over: bool = False
    error: str = ""
    """Why it was not set; "" if it was."""
    reported: Parameter | None = None
    """The value that the vehicle reported last."""
    check: Callable[[Parameter, Number], str] = lambda param, value: ""
    """Returns why the value must not be sent, or ""; called when the type is known."""
    unchecked: str = ""
    """Why the range of the value is not known; "" if the value was checked, or need not be."""
    out_of_range: bool = False
    """It was not set, because the vehicle's own description excludes the value."""
    waits: bool = False
    """The vehicle's description of its parameters is being fetched: nothing is sent before."""
    sent: bool = False
    _tries: int = 0
    _due_s: float = 0.0
    _checking: bool = False
    """Another value came back. It is read once more, because the answer may have been older than the request."""

    def tick(self, channel: ParamChannel, now: float, *, slow: bool) -> None:
        """Read, set, or repeat, if it is due."""
        if self.over or self.waits or now < self._due_s:
            return
        reading = self.known is None or self._checking
        if self._tries >= (READ_TRIES if reading else SET_TRIES):
            self.end(self._why_not())
            return
        self._tries += 1
        self._due_s = now + (SLOW_GAP_S if slow else GAP_S)
        if reading or self.known is None:
            channel.ask_name(self.vehicle, self.name)
            return
        why = channel.send_set(self.vehicle, self.known, self.value, again=self.sent)
        self.sent = True
        if why:
            self.end(why)

    def on_value(self, param: Parameter, channel: ParamChannel, now: float, *, slow: bool) -> None:
        """Take a PARAM_VALUE of that name."""
        if self.over or self.waits:
            return
        if self.known is None:
            self.known, self._tries, self._due_s = param, 0, now
            why = self.check(param, self.value)
            if why:
                self.end(why)
        elif self.sent:
            self.reported = param
            if same(param.value, self.value, param.type):
                self.end("")
            elif self._checking:
                self.end(self._why_not())
            else:
                # The value may be an echo of something older: only a second reading decides.
                self._checking, self._tries, self._due_s = True, 0, now
        self.tick(channel, now, slow=slow)

    @property
    def changed(self) -> bool:
        """Whether the vehicle now holds another value than before."""
        if not self.over or self.error or self.known is None:
            return False
        return not same(self.known.value, self.value, self.known.type)

    def end(self, error: str) -> None:
        """End the setting, with an error or without."""
        self.over, self.error = True, error

    def _why_not(self) -> str:
        if self.reported is None:
            return f"no answer: {NOT_KNOWN}" if self.sent else UNKNOWN
        return f"vehicle holds {shown(self.reported.value)}"
