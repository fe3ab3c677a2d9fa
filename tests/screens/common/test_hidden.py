"""What does not fit on a screen of 80x24 is not lost: it says that there is more, and which key shows it."""

import re

import msgspec
import pytest

from tests.screens.rigs.console import NARROW, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.mission_station import mission_console
from tests.screens.rigs.plan_station import plan_console
from tui_gcs.core.alarms.causes import BY_ID
from tui_gcs.core.protocol.alarms import Alarm, AlarmLevel
from tui_gcs.feed.notices import Notice
from tui_gcs.screens.common.draft_screen import RemarksDialog
from tui_gcs.screens.fly.planners_dialog import PlannersDialog
from tui_gcs.screens.logs.journal_screen import JournalScreen
from tui_gcs.widgets.basics.alarm_line import alarm_runs
from tui_gcs.widgets.forms.form_findings import Remark

LONG = "planner mine failed: ValueError: the middle of the zone is closed, and no circle of 40 m fits beside it"


def flight(station: FakeStation) -> None:
    station.fly()


async def test_the_end_of_a_long_event_is_read_by_the_key_where_it_is_cut() -> None:
    async with console(NARROW, flight) as c:
        c.station.event(LONG, source="planner defend", cls="planner")
        c.station.event("as long as it is", source="planner defend", cls="planner")
        await c.tick()
        whole, cut = c.fly.event_lines.text().splitlines()
        assert cut.endswith(" … J") and len(cut) == 80 and "planner mine failed: Value" in cut
        assert whole.endswith("as long as it is")
        await c.press("J")
        assert isinstance(c.app.screen, JournalScreen)
        assert "no circle of 40 m fits beside it" in re.sub(r"[│\s]+", " ", c.text())


async def test_the_key_is_that_of_the_operators_keymap() -> None:
    async with console(NARROW, flight) as c:
        c.app.keymap = {"app.show_journal": "ctrl+j", "app.show_planners": "f5"}
        c.station.event(LONG, source="planner defend", cls="planner")
        c.station.metrics = {"gap_m": 1.0}
        await c.tick()
        assert c.fly.event_lines.text().splitlines()[0].endswith(" … ^J")
        assert str(c.fly.brief_panel.border_title).endswith("F5: all")


async def test_each_team_has_its_share_of_the_panel_and_m_has_all() -> None:
    async with console((120, 60), flight) as c:
        c.station.metrics = {f"a_number_with_a_long_name_{i}": float(i) for i in range(30)}
        await c.tick()
        counted = [line for line in c.fly.planner_panel.text().splitlines() if "number with" in line]
        assert counted[0].startswith("DEF ") and any(line.startswith("ATT ") for line in counted)
        assert counted[-1].endswith(" … M")
        assert str(c.fly.planner_panel.border_title) == "planner   M: all"
        await c.press("M")
        assert isinstance(c.app.screen, PlannersDialog)
        assert sum("long name 29 29" in line for line in c.app.screen.text().splitlines()) == 2


async def test_a_form_shows_how_many_rows_are_below_and_tab_reaches_them() -> None:
    async with plan_console(NARROW) as c:
        await c.press("t")
        form = c.plan.team_form
        hidden = re.fullmatch(r"(\d+) more below: Tab", str(form.border_subtitle))
        assert hidden is not None and f"{hidden[0]} " in c.text()
        for _ in range(30):
            await c.press("tab")
            if str(form.border_subtitle).endswith("more above: Tab"):
                break
        assert str(form.border_subtitle) == f"{hidden[1]} more above: Tab"
        assert c.app.focused is not None and form.region.contains_region(c.app.focused.region)


async def test_a_form_that_fits_shows_no_number_of_rows() -> None:
    async with plan_console((120, 60)) as c:
        assert not c.plan.zone_form.border_subtitle


async def test_remarks_that_are_cut_are_shown_whole_by_their_key() -> None:
    async with plan_console(NARROW) as c:
        screen, reported = c.plan, [f"{number}: {LONG}" for number in range(4)]
        screen.verdict.show([Remark(text) for text in reported])
        lines = screen.verdict.text().splitlines()
        assert lines[-1].endswith(" … ^R") and "3: " not in c.text()
        await c.press("tab", "ctrl+r")  # a letter would go into the field
        assert isinstance(c.app.screen, RemarksDialog)
        said = re.sub(r"\s+", " ", c.app.screen.text())
        assert all(text in said for text in reported)
        await c.press("ctrl+r")
        assert c.app.screen is screen


async def test_vehicles_and_items_below_the_last_line_are_counted() -> None:
    async with mission_console(NARROW) as c:
        panel = c.missions.plan_list.parent
        assert str(panel.border_title).endswith("LEFT +4:n")
        for _ in range(30):
            await c.press("plus")
        assert re.fullmatch(r"\d+ more above: arrows", str(c.missions.item_table.parent.border_subtitle))
        await c.press("home")
        assert re.fullmatch(r"\d+ more below: arrows", str(c.missions.item_table.parent.border_subtitle))


async def test_vehicles_below_the_roster_are_counted() -> None:
    async with console(NARROW, flight) as c:
        assert str(c.fly.roster.border_subtitle or "") == ""
        c.fly.roster.styles.height = 6
        await c.settle()
        c.fly.show_fleet = lambda: None  # what follows must not make it as high as before
        c.fly.roster.update_lines()
        assert str(c.fly.roster.border_subtitle) == "5 more below: n N"


async def test_actions_that_the_list_has_no_room_for_are_counted() -> None:
    async with console(NARROW, flight) as c:
        await c.press("colon")
        counted = re.search(r"arrows: choose, 1 of (\d+)", c.text())
        assert counted is not None and int(counted[1]) > 24
        await c.press(*"journal")
        assert "arrows: choose " in c.text(), "all that match are seen"


@pytest.mark.parametrize(
    ("action", "told"),
    [
        ("plan its return: [return_all] return", "→ !r return  "),
        ("plan: 8, then [return_selected] return", "→ 8, then r return  "),
        ("its number, then [return_selected] return", "→ its number, t"),
    ],
    ids=["why is left out", "what belongs to the key is not", "there is nothing to leave out"],
)
def test_the_keys_that_answer_an_alarm_are_not_cut_for_why(action: str, told: str) -> None:
    vehicles = tuple(range(1, 9))
    alarm = Alarm("battery-low", AlarmLevel.CAUTION, "BAT", "battery low", action, "new", 1, 0.0, vehicles)
    alarm = msgspec.structs.replace(alarm, text="16 %")
    keys = {"return_all": "!r", "return_selected": "r", "acknowledge": "a"}
    line = "".join(text for text, _ in alarm_runs([alarm], keys, Notice(""), 80, True, "→"))
    assert f"battery low: vehicles 1-8  16 %   {told}" in line and len(line) == 80


@pytest.mark.parametrize(
    ("action", "told"),
    [
        ("[resume] resume, or [return_all] return", "   → Enter resume  "),
        ("its vehicles hold: [resume] resume, or [show_planners] look why", "   → its vehicles hold: Enter resume  "),
        ("it flies on for now, and holds after 2 s: [resume] resume", "   → Enter resume  "),
        ("its number, then say that it is to land; or [return_all] return", "  attack: a planner..   → !r return  "),
        ("its vehicles fly on, and hold after 2 s without it", "   → its vehicles fly on, and"),
    ],
    ids=["the first", "whole", "the keys", "only the second fits, and words", "as much as fits"],
)
def test_what_to_do_comes_before_the_words_of_details(action: str, told: str) -> None:
    alarm = Alarm("late", AlarmLevel.CAUTION, "PLN", "late", action, "new", 1, 0.0, names=("attack", "defend"))
    alarm = msgspec.structs.replace(alarm, text="attack: a planner of that name is late")
    keys = {"return_all": "!r", "resume": "Enter", "acknowledge": "a"}
    line = "".join(text for text, _ in alarm_runs([alarm], keys, Notice(""), 80, True, "→"))
    assert line.startswith(f" ^ CAUT  late: attack, defend{told}") and len(line) == 80


@pytest.mark.parametrize(
    ("cause", "vehicles", "told", "line"),
    [
        ("battery-critical", (1,), "4 %", "battery CRITICAL: vehicle 1  4 %   → its number, r return "),
        ("battery-low", (11,), "20 %", "battery low: vehicle 11  20 %   → its number, r return  "),
        ("left", (4,), "LAND", "left the mission: vehicle 4  LAND   → !h hold all  "),
    ],
)
def test_alarms_of_real_flights_name_the_keys_to_press(
    cause: str, vehicles: tuple[int, ...], told: str, line: str
) -> None:
    """Seen: "battery CRITICAL: vehicle 1  4 %   → its number, then r re..", "…  LAND   → a pilot or failsafe fl.."."""
    known = BY_ID[cause]
    alarm = Alarm(cause, known.level, known.tag, known.title, known.action, "new", 1, 0.0, vehicles)
    alarm = msgspec.structs.replace(alarm, text=told)
    keys = {"return_all": "!r", "hold_all": "!h", "return_selected": "r", "acknowledge": "a"}
    assert line in "".join(text for text, _ in alarm_runs([alarm], keys, Notice(""), 80, True, "→"))


def test_a_beginning_of_what_to_do_is_not_room_for_it() -> None:
    action = "its vehicles hold: [resume] resume, or [show_planners] look why"
    alarm = Alarm("planner", AlarmLevel.CAUTION, "PLN", "planner trouble", action, "new", 1, 0.0, names=("a", "defend"))
    alarm = msgspec.structs.replace(alarm, text="defend: patrol is late")
    line = "".join(text for text, _ in alarm_runs([alarm], {"resume": "Enter"}, Notice(""), 80, True, "→"))
    assert line.startswith(" ^ CAUT  planner trouble: a, defend   → ") and "Enter resume " in line
