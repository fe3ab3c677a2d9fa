"""A console and its terminal: whatever ends or stops the console, the terminal is left as it was."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from tests.rigs.console_pty import PtyConsole
from tests.rigs.terminal_picture import TerminalPicture
from tui_gcs.core.base.directories import socket_path
from tui_gcs.core.base.run_kind import RunKind

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
        process = subprocess.Popen([sys.executable, "-m", "tests.screens.rigs.paper_fleet", "8"])
        end_s = time.monotonic() + 60.0
        while not socket_path(RunKind.SIM).exists() and time.monotonic() < end_s:
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


@pytest.mark.parametrize("brackets", [(b"\x1b[200~", b"\x1b[201~"), (b"", b"")], ids=["brackets", "none"])
def test_b6_108_a_megabyte_pasted_is_no_key_and_holds_nothing_up(
    console: PtyConsole, brackets: tuple[bytes, bytes]
) -> None:
    begin, end = brackets
    console.press(begin + b"!h q \r y \x1b \x1b[A \x1b[<35;40;12M" * 30_000 + end)
    assert console.wait_for(b"NOT TAKEN", 10.0)
    console.read(1.0)  # quiet, also for a console that is slow to read the rest: what comes now is typed
    console.press(b"7")
    assert console.wait_for(b"7_", 10.0)
    assert not console.is_ended() and b"HOLD ALL:" not in console.output


def test_b6_109_a_storm_of_sizes_ends_in_a_screen_that_answers(console: PtyConsole) -> None:
    for columns, lines in [(1, 1), (10, 3), (80, 24), (0, 0), (79, 24), (120, 40)] * 5 + [(1000, 500)]:
        console.resize(columns, lines)
        console.read(0.01)
    for size, shows in (((40, 10), "!h HOLD ALL  q leave"), ((80, 24), "8 GUIDED")):
        console.read(0.5)
        console.resize(*size)
        picture, end_s = TerminalPicture(*size), time.monotonic() + 60.0
        while not console.is_ended() and shows not in picture.text() and time.monotonic() < end_s:
            picture.feed(console.read(0.2).decode(errors="replace"))
        assert shows in picture.text()
    assert b"Traceback" not in console.output


@pytest.mark.parametrize("term", ["dumb", "unknown", ""])
def test_b6_110_a_terminal_that_can_show_nothing_is_told_what_works_there(term: str) -> None:
    console = PtyConsole(["demo"], 100, 30, environment={"TERM": term})
    assert console.wait_exit(30.0) == 2
    assert b"`tui-gcs status`" in console.output and b"Traceback" not in console.output
    assert ENTERED not in console.output


BARE = {"LC_ALL": "C", "LANG": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"}


@pytest.mark.parametrize(
    "environment",
    [BARE, {"NO_COLOR": "1"}, {"TERM": "linux"}, {"TERM": "vt100"}, BARE | {"NO_COLOR": "1", "TERM": "screen"}],
    ids=["no-locale", "no-colour", "linux", "vt100", "all"],
)
def test_b6_110_poor_terminals_get_a_screen_they_can_show(station: None, environment: dict[str, str]) -> None:
    console = PtyConsole([], 100, 30, environment, module="tests.bench.console_child")
    assert console.wait_for(b"swarm", 60.0) and console.wait_for(b"detach", 60.0)
    console.read(1.0)
    if "LC_ALL" in environment or environment.get("TERM") == "linux":
        assert console.output.isascii()
    if "NO_COLOR" in environment:
        codes = {code for pen in re.findall(rb"\x1b\[([0-9;]*)m", console.output) for code in pen.split(b";")}
        coloured = {b"38", b"48", *(str(n).encode() for n in (*range(30, 38), *range(40, 48), *range(90, 108)))}
        assert not codes & coloured
    if "TERM" in environment:
        assert b"38;2;" not in console.output and b"38;5;" not in console.output, "16 colours"
    console.end()


def test_b6_111_a_terminal_that_is_not_read_is_felt_by_no_vehicle_and_no_other_console(station: None) -> None:
    asleep = PtyConsole(["--storm"], 200, 60, module="tests.bench.console_child")
    assert asleep.wait_for(b"swarm", 60.0)
    before, unread = -1, asleep.unread()
    while unread != before:  # until nothing more fits into the terminal's buffer
        time.sleep(1.0)
        before, unread = unread, asleep.unread()
    other = PtyConsole([], 100, 30, module="tests.bench.console_child")
    picture, times, end_s = TerminalPicture(100, 30), set(), time.monotonic() + 60.0
    while len(times) < 4 and time.monotonic() < end_s:
        picture.feed(other.read(0.3).decode(errors="replace"))
        times |= set(re.findall(r"T\+\d\d:\d\d", picture.text()))
    assert len(times) >= 4, "the flight goes on"
    assert not asleep.is_ended()
    for console in (asleep, other):
        console.end()
