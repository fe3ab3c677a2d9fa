"""An operator at a real console: presses keys, and knows nothing but what the screen shows."""

import os
import subprocess
import time
from collections.abc import Sequence

from tests.rigs.console_pty import PtyConsole
from tests.rigs.terminal_picture import TerminalPicture

ENTER, TAB, EMPTY, ESCAPE, SAVE = "\r", "\t", "\x15", "\x1b", "\x13"
RIGHT, UP, DOWN, DELETE = "\x1b[C", "\x1b[A", "\x1b[B", "\x1b[3~"
"""As a terminal sends them; EMPTY is ^U in a field, SAVE ^S."""


class Operator:
    """One console, from its start to its end."""

    def __init__(self, arguments: Sequence[str], columns: int, lines: int) -> None:
        """`tui-gcs ARGUMENTS`."""
        self.console = PtyConsole(list(arguments), columns, lines)
        self._picture = TerminalPicture(columns, lines)

    def screen(self, seconds: float = 0.2) -> str:
        """What is shown after so long."""
        self._picture.feed(self.console.read(seconds).decode(errors="replace"))
        return self._picture.text()

    def sees(self, text: str, seconds: float = 20.0) -> None:
        """`text` is shown within `seconds`, or the test ends with the picture."""
        end = time.monotonic() + seconds
        while text not in self.screen():
            assert time.monotonic() < end, f"{text!r} is not shown within {seconds} s:\n{self.screen()}"

    def press(self, keys: str, shows: str, seconds: float = 20.0) -> None:
        """Press; what must be seen before the next key."""
        self.console.press(keys.encode())
        self.sees(shows, seconds)

    def leaves(self) -> None:
        """Detach."""
        self.console.press(b"q")
        assert self.console.wait_exit(20.0) == 0
        assert b"Traceback" not in self.console.output


def end_programs() -> None:
    """What a flight that failed left running; nothing when all went well. Only of this test's own runtime directory."""
    ours = os.environ["TUI_GCS_RUNTIME_DIR"]
    listing = subprocess.run(["ps", "-ww", "-eo", "pid,args"], capture_output=True, text=True, check=True).stdout
    for line in listing.splitlines():
        if ours in line and any(
            part in line
            for part in ("tui_gcs.client.launcher", "tui_gcs.core.process.station_process", "sitl.launch.simulated")
        ):
            os.kill(int(line.split()[0]), 9)
