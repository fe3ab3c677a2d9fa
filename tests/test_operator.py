"""An operator flies the demo from start to landing with nothing but keys, by nothing but what the screen shows.

Real processes at 1x, on the smallest terminal; about three minutes.
"""

import os
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from tests.console_pty import PtyConsole
from tests.terminal_picture import TerminalPicture

pytestmark = [pytest.mark.process, pytest.mark.long]
COLUMNS, LINES = 80, 24


class Operator:
    """Presses keys and reads the screen."""

    def __init__(self) -> None:
        self.console = PtyConsole(["demo"], COLUMNS, LINES)
        self._picture = TerminalPicture(COLUMNS, LINES)

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


@pytest.fixture
def operator(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Operator]:
    for name in ("RUNTIME", "STATE"):
        monkeypatch.setenv(f"TUI_GCS_{name}_DIR", str(tmp_path_factory.mktemp(name[0])))
    one = Operator()
    yield one
    one.console.end()
    ours = os.environ["TUI_GCS_RUNTIME_DIR"]
    listing = subprocess.run(["ps", "-ww", "-eo", "pid,args"], capture_output=True, text=True, check=True).stdout
    for line in listing.splitlines():  # of a flight that failed: nothing is left when all went well
        if ours in line and any(part in line for part in ("tui_gcs.launcher", "station_process", "sitl.launch")):
            os.kill(int(line.split()[0]), 9)


def test_eight_vehicles_one_mission_keys_only(operator: Operator) -> None:
    operator.sees("8/8", 60.0)
    operator.sees("Space start")
    operator.screen(5.0)  # until they have a position
    operator.press(" ", "Enter = start")
    operator.press("\r", "start 1-8: begun for all 8")
    operator.sees("all 4 on their slots over home", 120.0)

    operator.press("o", "y = switch")
    operator.press("y", "R2/3")

    operator.press(" ", "HOLD ALL: done for all 8", 30.0)
    operator.sees("Enter resume")
    operator.press("\r", "resume: begun for all 8")

    operator.press("7", "select 7_")
    operator.press("\r", "selected 7")
    operator.press("c", "l  land here")
    operator.press("l", "Enter = do it")
    operator.press("\r", "land here 7: begun for all 1")
    operator.sees("armed 7", 120.0)

    operator.press("!", "h HOLD   r return   l land here")
    operator.press("r", "RETURN ALL: begun for all 7")
    operator.sees("armed 0", 200.0)
    operator.sees("all landed and disarmed")
    operator.press("J", "land")  # what happened to whom is in the journal
    operator.console.press(b"q")
    assert operator.console.wait_exit(20.0) == 0
    assert b"Traceback" not in operator.console.output

    stopped = subprocess.run([sys.executable, "-m", "tui_gcs.cli", "stop"], capture_output=True, text=True, timeout=60)
    assert stopped.returncode == 0, stopped.stderr
