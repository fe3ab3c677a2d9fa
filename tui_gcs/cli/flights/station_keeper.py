"""What an unattended run does when its station is silent: it shows that, and starts the station again if it must.

A supervisor starts a station that died again. Where the supervisor is dead, too, nothing would bring the vehicles of
the run home: they hover until their batteries end.
"""

import sys
import time
from collections.abc import Callable

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.core.base.directories import ConfigError

SHOWN_S = 3.0
"""A station publishes ten times a second, and is back 1 to 2 s after its death."""
START_GAP_S = 20.0
"""A station that was started has this long to be heard, also on a busy computer, before it is started once more."""


class StationKeeper:
    """Watches how long the station of a run has been silent."""

    def __init__(
        self, is_running: Callable[[], bool], start: Callable[[], None], now: Callable[[], float] = time.monotonic
    ) -> None:
        """`is_running`: whether a supervisor or a station lives; `start` starts both."""
        self._is_running = is_running
        self._start = start
        self._now = now
        self._heard_s = now()
        self._next_start_s = -START_GAP_S

    @property
    def silent_s(self) -> float:
        """Seconds since the station was heard."""
        return self._now() - self._heard_s

    def heard(self) -> None:
        """Something came from the station."""
        self._heard_s = self._now()

    def look(self, *, in_flight: bool) -> str:
        """Start the station again if nothing else does; return what to show of its silence, "" while it is heard."""
        if self.silent_s < SHOWN_S:
            return ""
        if in_flight and self._now() >= self._next_start_s and not self._is_running():
            self._next_start_s = self._now() + START_GAP_S
            _tell("the station and its supervisor are dead, and vehicles are in the air: both are started again")
            try:
                self._start()
            except (CommandError, ConfigError) as error:
                _tell(f"the station cannot be started again: {error}")
        return f"STATION SILENT for {self.silent_s:.0f} s"


def _tell(text: str) -> None:
    sys.stderr.write(f"tui-gcs: {text}\n")
