"""Reports of a telemetry radio (RADIO_STATUS 109, RADIO 166), and the back-off while its buffer is full."""

import math
from typing import Any

from tui_gcs.core.protocol.link_report import RadioRow

STEP_GAP_S = 2.0
"""At most one step in this time: its effect must show first."""
CLIMB_S, MAX_CLIMB_S = 5.0, 160.0
"""The buffer is free for this long before a richer set is tried; twice as long after each try that failed."""
RELAPSE_S = 60.0
"""If the buffer fills again this soon after a step up, that step was the cause."""
EMPTY_ENOUGH_PCT, FILLING_PCT, NEARLY_FULL_PCT = 90, 50, 20
"""Free buffer, as in ArduPilot's own back-off (docs/threats.md C.1)."""


def radio_report(fields: dict[str, Any], age_s: float) -> RadioRow:
    """The report in a RADIO_STATUS or RADIO message of that age; the two have the same fields."""
    return RadioRow(
        txbuf_pct=fields["txbuf"],
        rssi=fields["rssi"],
        remote_rssi=fields["remrssi"],
        noise=fields["noise"],
        remote_noise=fields["remnoise"],
        rx_errors=fields["rxerrors"],
        fixed=fields["fixed"],
        age_s=age_s,
    )


class BackOff:
    """How many steps below the set that fits by calculation a link's vehicles are kept, by the radio's buffer."""

    def __init__(self) -> None:
        self.steps = 0
        self._moved_s = self._climbed_s = -math.inf
        self._climb_s = CLIMB_S
        self._free_since_s = math.inf

    def on_report(self, txbuf_pct: int, now: float, most: int, *, requested: bool) -> None:
        """A report came. `most`: steps there are; `requested`: every vehicle was asked for the set of the last step."""
        if txbuf_pct > 100:
            return
        self.steps = min(self.steps, most)
        if txbuf_pct <= EMPTY_ENOUGH_PCT:
            self._free_since_s = math.inf
        elif math.isinf(self._free_since_s):
            self._free_since_s = now
        if now - self._moved_s < STEP_GAP_S:
            return
        if txbuf_pct < NEARLY_FULL_PCT:
            # Below 20 % free it does not wait until every vehicle was asked for the set before.
            self._go_down(2, most, now)
        elif txbuf_pct < FILLING_PCT and requested:
            self._go_down(1, most, now)
        elif self.steps and requested and now - self._free_since_s >= self._climb_s:
            self.steps -= 1
            self._moved_s = self._climbed_s = self._free_since_s = now

    def _go_down(self, steps: int, most: int, now: float) -> None:
        if self.steps >= most:
            return
        if now - self._climbed_s < RELAPSE_S:
            self._climb_s = min(2 * self._climb_s, MAX_CLIMB_S)
        elif math.isfinite(self._climbed_s):
            self._climb_s = CLIMB_S
        self._climbed_s = -math.inf
        self.steps = min(self.steps + steps, most)
        self._moved_s = now
