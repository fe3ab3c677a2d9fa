"""A console and its terminal: whatever ends or stops the console, the terminal is left as it was."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from tests.console_pty import PtyConsole
from tui_gcs.core.config import socket_path
from tui_gcs.core.kinds import Kind

pytestmark = pytest.mark.process

LEFT = (b"\x1b[?1049l", b"\x1b[?25h", b"\x1b[?2004l", b"\x1b[?7h", b"\x1b[<u")
"""No alternate screen; a cursor; pastes, lines and keys as ever."""
ENTERED = b"\x1b[?1049h"


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Eight paper vehicles in flight."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("RUNTIME", "STATE"):
            patch.setenv(f"TUI_GCS_{name}_DIR", str(tmp_path_factory.mktemp(name[0])))
        process = subprocess.Popen([sys.executable, "-m", "tests.screens.paper_fleet", "8"])
        end_s = time.monotonic() + 20.0
        while not socket_path(Kind.SIM).exists() and time.monotonic() < end_s:
            time.sleep(0.05)
        yield
        process.kill()
        process.wait()


@pytest.fixture
def console(station: None) -> Iterator[PtyConsole]:
    """A console that shows the fleet."""
    terminal = PtyConsole([], 100, 30, module="tests.bench.console_child")
    assert terminal.wait_for(b"swarm", 60.0)
    assert terminal.look_at_modes() != terminal.modes_before
    yield terminal
    terminal.end()


def is_left(terminal: PtyConsole) -> bool:
    """Whether everything is as it was before the console."""
    after = terminal.output.rpartition(ENTERED)[2]
    return all(word in after for word in LEFT) and terminal.look_at_modes() == terminal.modes_before


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP], ids=["SIGTERM", "SIGHUP"])
def test_signals_end_it_and_leave_the_terminal_clean(console: PtyConsole, number: int) -> None:
    assert not is_left(console)
    os.kill(console.pid, number)
    assert console.wait_exit(30.0) == 0
    assert is_left(console)
    assert b"Traceback" not in console.output


def test_a_stopped_console_gives_the_terminal_back_and_paints_all_of_it_when_it_goes_on(console: PtyConsole) -> None:
    os.kill(console.pid, signal.SIGTSTP)
    assert console.wait_stopped(30.0)
    assert is_left(console)
    console.output = b""
    os.kill(console.pid, signal.SIGCONT)
    assert console.wait_for(b"detach", 30.0) and console.wait_for(b"swarm", 30.0), "the first line and the last"
    assert ENTERED in console.output


def test_it_ends_in_time_although_its_terminal_reads_nothing(station: None) -> None:
    console = PtyConsole(["--storm"], 200, 60, module="tests.bench.console_child")
    assert console.wait_for(b"swarm", 60.0)
    before, unread = -1, console.unread()
    while unread != before:  # whole pictures, until nothing more fits into the terminal's buffer
        time.sleep(1.0)
        before, unread = unread, console.unread()
    os.kill(console.pid, signal.SIGTERM)
    began_s = time.monotonic()
    while not console.is_ended():
        time.sleep(0.05)
        assert time.monotonic() - began_s < 10.0
    assert console.wait_exit(30.0) == 0
    assert is_left(console)
