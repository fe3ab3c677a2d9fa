"""Copying by OSC 52: every list copies its chosen row and all its rows by the same keys, without control bytes."""

import base64
import math
import re
from collections.abc import Callable
from dataclasses import dataclass

import pytest
from msgspec.structs import replace

from tests.screens.rigs.console import NARROW, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.mission_station import mission_console
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.common import PointOfInterest, Track
from tui_gcs.core.protocol.link_report import LinkReport, PartnerRow, PathRow
from tui_gcs.core.protocol.people import PersonRow
from tui_gcs.core.protocol.services import ParamRow, TaskInfo
from tui_gcs.core.protocol.setup import SetupFieldRow, SetupSectionRow
from tui_gcs.screens.common.row_copies import copy_rows, copy_text
from tui_gcs.widgets.basics.copied_rows import MAX_COPIED_BYTES, record_of, tab_separated
from tui_gcs.widgets.basics.palette import Ink

HOSTILE = "\x1b]52;c;b3duZWQ=\x07\trm -rf ~\n\x9b31m"


def hostile(station: FakeStation) -> None:
    """A flight in which every text is hostile; those of alarms and events were cleaned by the station."""
    station.fly()
    station.alarm = clean(HOSTILE)
    station.event(clean(HOSTILE))
    station.event("second")
    for vehicle in (1, 2):
        station.params[vehicle] = {
            "WPNAV_SPEED": ParamRow("WPNAV_SPEED", 500.0 + vehicle, "real32", 500.0, HOSTILE, "cm/s"),
            "ZIGZ_AUTO": ParamRow("ZIGZ_AUTO", 0, "int8", 0, "", ""),
        }
    station.setup = tuple(
        SetupSectionRow(vehicle, section, "done", HOSTILE, (SetupFieldRow("class", "airframe", "FRAME", 1, HOSTILE),))
        for vehicle in (1, 2)
        for section in ("airframe", "sensors")
    )
    usual = PathRow(1, HOSTILE, "127.0.0.1:1", "used", True, 0.1, 9, 2.5, math.nan, 0, 0, "unsigned", 0.01, 0.01)
    partner = PartnerRow("udpout:10.0.0.9:1", True, True, HOSTILE, "10.0.0.9:1", ("255/190",), 0.2, 9, {HOSTILE: 3})
    station.link_report = LinkReport(station.t_s, (), (usual, replace(usual, vehicle=2)), (partner, partner), passed=0)
    tasks = [TaskInfo(n, n, HOSTILE, "console-77", "running", 30, 120, HOSTILE, 12.0) for n in (1, 2)]
    station.tasks = {task.number: task for task in tasks}
    station.people = (
        PersonRow("console-test", True, 340.0, True, HOSTILE, 300.0),
        PersonRow("cli-9", False, math.nan, False, "hold", 90.0),
    )
    station.tracks = (
        Track(4, (300.0, 150.0, 40.0), (-6.0, 0.0, 0.0), (4.0, 0.0, 4.0), 90.0, 100.0, (2, 3), True),
        Track(5, (500.0, 150.0, 40.0), (-6.0, 0.0, 0.0), (4.0, 0.0, 4.0), 90.0, 100.0, (2, 3), True),
    )
    station.points = tuple(
        PointOfInterest(name, (450.0, 200.0), 2.0, HOSTILE, 90.0, 400.0) for name in ("gate", f"roof{HOSTILE}")
    )


@dataclass(frozen=True)
class Listed:
    """A list: the keys that lead to it, and titles and values that are copied of it."""

    keys: tuple[str, ...]
    titles: str
    values: str = ""
    rows: int = 2


LISTS = {
    "parameters": Listed(("S", "p"), "name units default meaning vehicle_1 vehicle_2", "WPNAV_SPEED cm/s 501"),
    "setup sections": Listed(("S", "s"), "section state found", "airframe done"),
    "setup lines": Listed(("S", "s", "right"), "line parameter attention vehicle_1 vehicle_2", "class FRAME", 1),
    "paths": Listed(("S", "l", "tab"), "vehicle link loss_pct rtt_s heard_age_s", "2.5"),
    "partners": Listed(("S", "l", "tab", "tab"), "endpoint refused", "udpout:10.0.0.9:1"),
    "contacts": Listed(("S", "a"), "kind name distance_m bearing_deg", "track @4"),
    "tasks for planners": Listed(("S", "a", "tab"), "name place_m priority team due_s", "gate"),
    "tasks": Listed(("S", "t"), "number vehicle what who state", "console-77 running"),
    "settings": Listed(("S", "e"), "setting value origin in_file counts meaning", "link default next station"),
    "people": Listed(("S", "t", "tab"), "principal is_in_control last_command", "console-test yes 340"),
    "vehicles": Listed(("v", "n"), "id team mode battery_pct", "1"),
    "journal": Listed(("J",), "time_utc class severity source text"),
    "alarms": Listed(("A",), "alarm level state vehicles what_to_do", rows=1),
}


async def opened(c: Console, listed: Listed) -> None:
    """The list with its rows."""
    await c.press(*listed.keys[:2])
    if (look := getattr(c.app.screen, "look", None)) is not None:
        look()
        await c.settle()
        look()  # with the lines of the section that is chosen now
        await c.settle()
    await c.press(*listed.keys[2:])


def table(c: Console) -> list[list[str]]:
    """The cells of what was copied, the titles first."""
    return [line.split("\t") for line in c.app.clipboard.split("\n")]


@pytest.mark.parametrize("name", LISTS)
async def test_every_list_copies_its_row_and_its_rows(name: str) -> None:
    listed = LISTS[name]
    async with console(NARROW, hostile) as c:
        await c.tick()
        await opened(c, listed)
        await c.press("y")
        one = table(c)
        assert set(listed.titles.split()) <= set(one[0])
        assert set(listed.values.split()) <= {word for cell in one[1] for word in cell.split()}
        said = " ".join(re.sub("[│┃]", " ", c.text()).split())
        assert f"{len(c.app.clipboard.encode())} bytes" in said, "it is said what was copied"
        await c.press("Y")
        all_ = table(c)
        assert len(all_) > listed.rows and one[1] in [
            [row[all_[0].index(title)] for title in one[0]] for row in all_[1:]
        ]
        assert {len(row) for row in all_} == {len(all_[0])}, "hostile text ends no cell and no line"
        assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", c.app.clipboard)


async def test_mission_items_are_copied_and_redo_is_another_key() -> None:
    async with mission_console(NARROW) as c:
        await c.press("y")
        assert "there is no row to copy" in c.said()
        await c.press("plus", "plus", "y")
        assert table(c)[0][:4] == ["vehicle", "plan", "number", "command"] and len(table(c)) == 2
        await c.press("Y")
        assert [row[4] for row in table(c)[1:]] == ["take-off", "waypoint", "waypoint"]
        assert "bytes copied to the terminal's clipboard: 3 rows" in c.said()


async def test_an_answer_to_a_question_that_was_not_asked_hides_no_refusal() -> None:
    async with console(NARROW, hostile, read_only=True) as c:
        await opened(c, LISTS["tasks"])
        await c.press("delete", "y", "y")
        said = c.app.screen.panel.text()
        assert "read-only" in said and said.count("copied to the terminal's clipboard") == 1
        await opened(c, LISTS["paths"])
        await c.press("R", "y", "Y")
        said = c.app.screen.panel.text()
        assert "read-only" in said and said.count("copied to the terminal's clipboard") == 1


async def test_without_rows_nothing_is_copied() -> None:
    async with console(NARROW) as c:
        await c.press("S", "t", "Y")
        assert "there is no row to copy" in c.text() and c.app.clipboard == ""


async def test_every_list_names_the_key_in_its_help() -> None:
    async with console(NARROW, hostile) as c:
        for listed in LISTS.values():
            await c.press(*listed.keys[:2])
            if listed.keys == ("A",):
                assert "y copy" in c.text()
                await c.press("escape")
                continue
            copies = [action for action in c.app.screen.ACTIONS if action.id in ("copy_row", "copy_rows")]
            assert [action.shown for action in copies] == ["y", "Y"]


# ---------------------------------------------------------------- what is sent


class Terminal:
    """Takes what an app copies as Textual sends it."""

    def __init__(self) -> None:
        self.sent = ""

    def copy_to_clipboard(self, text: str) -> None:
        self.sent = f"\x1b]52;c;{base64.b64encode(text.encode()).decode()}\a"


@pytest.mark.parametrize("send", [lambda t: copy_rows(t, [{"text": HOSTILE}]), lambda t: copy_text(t, "it", HOSTILE)])
def test_no_control_byte_gets_into_the_sequence_or_out_of_it(send: Callable[[Terminal], object]) -> None:
    terminal = Terminal()
    send(terminal)
    found = re.fullmatch(r"\x1b\]52;c;([A-Za-z0-9+/=]+)\a", terminal.sent)
    assert found is not None
    pasted = base64.b64decode(found[1]).decode()
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", pasted) and "rm -rf" in pasted


def test_a_large_table_is_cut_after_a_row_and_says_so() -> None:
    rows = [{"number": n, "text": "x" * 500} for n in range(400)]
    text, fitting = tab_separated(rows)
    assert len(text.encode()) <= MAX_COPIED_BYTES < len(text.encode()) + 510
    assert text.splitlines()[-1].split("\t")[0] == str(fitting - 1)
    said, ink = copy_rows(Terminal(), rows)  # type: ignore[arg-type]
    assert f"ONLY the first {fitting} of 400 rows fit" in said and ink is Ink.CAUTION


def test_a_text_that_no_terminal_takes_is_not_sent() -> None:
    terminal = Terminal()
    said, ink = copy_text(terminal, "20 lines", "\n".join(["é" * 2500] * 20))  # type: ignore[arg-type]
    assert said.startswith("NOT copied: 20 lines has 100019 bytes") and ink is Ink.CAUTION and terminal.sent == ""


def test_rows_inside_a_row_stand_beside_its_own_values_and_unknown_numbers_are_empty() -> None:
    @dataclass(frozen=True)
    class Inner:
        name: str
        age_s: float

    @dataclass(frozen=True)
    class Outer:
        name: str
        inner: Inner
        vehicles: tuple[int, ...]
        best: Inner | None = None

    row = record_of(Outer("a", Inner("b", math.nan), (1, 4)))
    assert row == {
        "name": "a",
        "inner_name": "b",
        "age_s": pytest.approx(math.nan, nan_ok=True),
        "vehicles": (1, 4),
        "best": None,
    }
    assert tab_separated([row])[0] == "name\tinner_name\tage_s\tvehicles\tbest\na\tb\t\t1, 4\t"


def test_what_has_no_names_is_refused() -> None:
    with pytest.raises(TypeError, match="tuple has no named values"):
        record_of((1, 2))
