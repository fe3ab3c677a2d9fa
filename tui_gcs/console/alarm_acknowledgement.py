"""Alarms on this console: when the bell rings, and which alarm the acknowledge key answers."""

import math
from collections.abc import Callable, Sequence

from tui_gcs.console.parts import ConsoleParts
from tui_gcs.core.protocol.alarms import AlarmLevel, to_answer
from tui_gcs.core.protocol.common import Acknowledge, Alarm, Request
from tui_gcs.feed.notices import Severity
from tui_gcs.screens.common.text_dialog import REACTION_S

MIN_GAP_S = 2.0
"""The bell never rings more often (docs/terminal.md D6)."""
REPEAT_S = 10.0
"""A warning that is not acknowledged rings again after this long."""


class AlarmBell:
    """Rings once for what is new, and again and again for a warning that is not acknowledged."""

    def __init__(self) -> None:
        self.is_on = True
        """The operator may switch it off for this console."""
        self._rung_for = 0
        self._rung_s = -math.inf

    def rings(self, alarms: Sequence[Alarm], now: float) -> bool:
        """Whether to ring now, in any clock's seconds; call it at every status."""
        loud = [alarm for alarm in alarms if alarm.state == "new" and alarm.level >= AlarmLevel.CAUTION]
        newest = max((alarm.raised for alarm in loud), default=0)
        if newest < self._rung_for and not loud:
            self._rung_for = max((alarm.raised for alarm in alarms), default=0)  # the station may have begun anew
        again = now - self._rung_s >= REPEAT_S and any(alarm.level is AlarmLevel.WARNING for alarm in loud)
        if not loud or now - self._rung_s < MIN_GAP_S or not (newest > self._rung_for or again):
            return False
        self._rung_for, self._rung_s = newest, now
        return self.is_on


class AlarmAcknowledgement:
    """Acknowledges the alarm of the second line, unless it has just replaced the one that the key was meant for."""

    def __init__(self, parts: ConsoleParts, ask: Callable[[Request, str], None]) -> None:
        """Send by `ask`, which takes a request and its title."""
        self._parts = parts
        self._ask = ask
        self._cause = ""
        self._since_s = -math.inf

    def update(self) -> None:
        """Follow which alarm the second line shows; call it at every status."""
        first = to_answer(self._parts.feed.alarms)
        # An alarm that replaces another under the operator's finger must not be acknowledged unseen.
        if first is not None and first.cause != self._cause:
            self._since_s = self._parts.clock.now() if self._cause else -math.inf
        self._cause = first.cause if first is not None else ""

    def acknowledge(self) -> None:
        """Acknowledge the alarm that the second line shows."""
        first = to_answer(self._parts.feed.alarms)
        if first is None:
            self._parts.notice("nothing to acknowledge")
        elif self._parts.clock.now() - self._since_s < REACTION_S:
            self._parts.notice("another alarm is shown now: look at it, then a again", Severity.CAUTION)
        else:
            self._ask(Acknowledge(raised={first.cause: first.raised}), "acknowledge")
