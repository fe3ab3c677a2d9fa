"""Single parameters: asked for by name, set and compared with what the vehicle then says.

ArduPilot does not answer at all to a name it does not have, PX4 sends PARAM_ERROR. Both echo a value that was set;
ArduPilot's may be another one than was asked (truncated, clamped), and an echo may be of something older.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from tui_gcs.core.services.parameters.param_channel import ParamChannel
from tui_gcs.core.services.parameters.param_values import Number, Parameter, same, shown

READ_TRIES, SET_TRIES = 10, 5
"""docs/threats.md C.4: reads belong to the stop class, sets are tried three to five times."""
GAP_S, SLOW_GAP_S = 0.5, 1.5
AT_ONCE, SLOW_AT_ONCE = 10, 3
"""Names asked for and not answered; QGroundControl has 10, too (docs/autopilots.md C4)."""
MAX_NAMES_ASKED = 500
NOT_KNOWN = "not known whether it was set"
"""So ends why a parameter that was sent is not counted as set."""
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
"""PARAM_ERROR.error, MAVLink's MAV_PARAM_ERROR."""


def error_words(code: int) -> str:
    """A PARAM_ERROR in words."""
    return ERRORS.get(code, f"refused with error {code}")


@dataclass
class PendingRead:
    """How often one name was asked for, and when it is due again."""

    tries: int = 0
    due_s: float = 0.0


@dataclass
class ParamReading:
    """Some parameters of one vehicle, asked for by name."""

    vehicle: int
    values: dict[str, Parameter] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    """Why, by name."""
    open: dict[str, PendingRead] = field(default_factory=dict)
    on_done: "Callable[[ParamReading], None] | None" = None

    @property
    def over(self) -> bool:
        """Whether all are answered or given up."""
        return not self.open

    def tick(self, channel: ParamChannel, now: float, *, slow: bool) -> None:
        """Ask what is due, give up what was asked often enough."""
        at_once, gap_s = (SLOW_AT_ONCE, SLOW_GAP_S) if slow else (AT_ONCE, GAP_S)
        for name, asked in list(self.open.items())[:at_once]:
            if now < asked.due_s:
                continue
            if asked.tries >= READ_TRIES:
                self.miss(name, UNKNOWN)
                continue
            asked.tries += 1
            asked.due_s = now + gap_s
            channel.ask_name(self.vehicle, name)

    def hear(self, param: Parameter) -> None:
        """A value came."""
        if self.open.pop(param.name, None) is not None:
            self.values[param.name] = param

    def miss(self, name: str, why: str) -> None:
        """It will not come."""
        if self.open.pop(name, None) is not None:
            self.missing[name] = why


@dataclass
class ParamSetting:
    """One parameter to be set. Without its type it is read first."""

    vehicle: int
    name: str
    value: Number
    on_done: "Callable[[ParamSetting], None] | None" = None
    known: Parameter | None = None
    over: bool = False
    error: str = ""
    """Why it was not set; "" once it is."""
    held: Parameter | None = None
    """What the vehicle said last."""
    judge: Callable[[Parameter, Number], str] = lambda param, value: ""
    """Why the value must not be sent, or ""; asked when the type is known."""
    sent: bool = False
    _tries: int = 0
    _due_s: float = 0.0
    _checking: bool = False
    """Another value came back: it is read once more, for what came may have been older."""

    def tick(self, channel: ParamChannel, now: float, *, slow: bool) -> None:
        """Ask, set, or ask again."""
        if self.over or now < self._due_s:
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

    def hear(self, param: Parameter, channel: ParamChannel, now: float, *, slow: bool) -> None:
        """A PARAM_VALUE of that name came."""
        if self.over:
            return
        if self.known is None:
            self.known, self._tries, self._due_s = param, 0, now
            why = self.judge(param, self.value)
            if why:
                self.end(why)
        elif self.sent:
            self.held = param
            if same(param.value, self.value, param.type):
                self.end("")
            elif self._checking:
                self.end(self._why_not())
            else:
                self._checking, self._tries, self._due_s = True, 0, now
        self.tick(channel, now, slow=slow)

    @property
    def changed(self) -> bool:
        """Whether the vehicle holds another value now than before."""
        if not self.over or self.error or self.known is None:
            return False
        return not same(self.known.value, self.value, self.known.type)

    def end(self, error: str) -> None:
        """It is over."""
        self.over, self.error = True, error

    def _why_not(self) -> str:
        if self.held is None:
            return f"no answer: {NOT_KNOWN}" if self.sent else UNKNOWN
        return f"vehicle holds {shown(self.held.value)}"
