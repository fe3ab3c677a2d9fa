"""When the terminal's bell rings for alarms."""

import math
from collections.abc import Sequence

from tui_gcs.core.protocol.alarms import AlarmLevel
from tui_gcs.core.protocol.common import Alarm

LEAST_GAP_S = 2.0
"""Never more often."""
AGAIN_S = 10.0
"""A warning that nobody acknowledges rings again after so long."""


class AlarmBell:
    """Rings once for what is new, again and again for a warning that nobody answers."""

    def __init__(self) -> None:
        """Nothing has rung."""
        self.is_on = True
        """The operator may switch it off for this console."""
        self._rung_for = 0
        self._rung_s = -math.inf

    def rings(self, alarms: Sequence[Alarm], now: float) -> bool:
        """Whether to ring now, `now` being any clock's seconds; ask at every status."""
        loud = [alarm for alarm in alarms if alarm.state == "new" and alarm.level >= AlarmLevel.CAUTION]
        newest = max((alarm.raised for alarm in loud), default=0)
        if newest < self._rung_for and not loud:
            self._rung_for = max((alarm.raised for alarm in alarms), default=0)  # the station may have begun anew
        again = now - self._rung_s >= AGAIN_S and any(alarm.level is AlarmLevel.WARNING for alarm in loud)
        if not loud or now - self._rung_s < LEAST_GAP_S or not (newest > self._rung_for or again):
            return False
        self._rung_for, self._rung_s = newest, now
        return self.is_on
