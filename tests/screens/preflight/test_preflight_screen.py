"""Checks before a start on the console: the list, and what a LIVE start asks for."""

import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import RunKind, Start
from tui_gcs.core.protocol.preflight import (
    CHECKLIST,
    AcknowledgeCheck,
    Check,
    CheckState,
    ReadChecks,
    SignOff,
    TickItem,
)
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.fly.start_dialog import StartDialog
from tui_gcs.screens.preflight.preflight_screen import PreflightScreen

ALL = tuple(range(1, 9))
NOTHING = "this station is not heard: NOTHING (FS_GCS_ENABLE 0)"
GOOD = tuple(
    Check(name, CheckState.OK, "") for name in ("heard", "links", "ids", "gps", "battery", "arming", "place", "planner")
)
CHECKS = (
    Check("station-loss", CheckState.FAIL, NOTHING, "set the parameter; or acknowledge the finding", (1, 2, 3, 4)),
    Check("rehearsal", CheckState.FAIL, "this plan was not rehearsed, or was changed since", "`tui-gcs rehearse`"),
    Check("sign-off", CheckState.FAIL, "not signed", "sign this list, or the start, with your name"),
    Check("fence", CheckState.UNKNOWN, "not read yet", "it is read when the list is opened", (5, 6, 7, 8)),
    Check("battery", CheckState.WARN, "battery at 23 %", "charge or change it", (7,)),
    Check("battery-loss", CheckState.ACKNOWLEDGED, "battery low: NOTHING", "acknowledged by Ada", ALL),
    *GOOD,
)
SIGN = (CHECKS[2], *GOOD)


def with_checks(*checks: Check) -> object:
    def prepare(station: FakeStation) -> None:
        station.preflight = checks

    return prepare


def starts(c: Console) -> list[Start]:
    return [request for request in c.station.commands() if isinstance(request, Start)]


async def typed(c: Console, text: str) -> None:
    await c.press(*("minus" if character == "-" else character for character in text), "enter")


# ---------------------------------------------------------------- the list


@pytest.mark.parametrize("size", [NARROW, WIDE])
async def test_pictures(size: tuple[int, int]) -> None:
    async with console(size, with_checks(*CHECKS), kind=RunKind.LIVE) as c:
        await c.press("p", "P")
        assert isinstance(c.app.screen, PreflightScreen)
        assert same_as_snapshot(f"preflight-list-{size[0]}x{size[1]}", c.text())
        await c.press("escape", "f", "space")
        assert same_as_snapshot(f"preflight-start-{size[0]}x{size[1]}", c.text())


async def test_opening_the_list_has_the_station_read_what_it_does_not_know() -> None:
    async with console(NARROW, with_checks(*CHECKS), kind=RunKind.LIVE) as c:
        await c.press("P")
        assert [r.anew for r in c.station.commands() if isinstance(r, ReadChecks)] == [False]
        await c.press("R")
        assert [r.anew for r in c.station.commands() if isinstance(r, ReadChecks)] == [False, True]


async def test_a_failsafe_is_acknowledged_by_name_and_the_name_is_asked_once() -> None:
    async with console(NARROW, with_checks(*CHECKS), kind=RunKind.LIVE) as c:
        await c.press("P", "y")
        assert "your name" in c.text()
        await typed(c, "Ada")
        wanted = AcknowledgeCheck("station-loss", NOTHING, "Ada", (1, 2, 3, 4))
        assert c.station.commands()[-1] == wanted
        await c.press("y")
        assert c.station.commands()[-2:] == [wanted, wanted]
        await c.press("down")
        assert "y acknowledge" not in c.text(), "a plan that was not rehearsed cannot be taken as it is"


async def test_the_mark_stays_on_its_check_when_others_come() -> None:
    async with console(NARROW, with_checks(*CHECKS), kind=RunKind.LIVE) as c:
        await c.press("P", "down")
        c.station.preflight = (Check("ids", CheckState.FAIL, "several vehicles use id 3", "", (3,), True), *CHECKS)
        await c.tick()
        marked = c.app.screen.marked()
        assert marked is not None and marked.name == "rehearsal"


async def test_what_slid_under_the_mark_is_not_acknowledged_by_a_key_for_what_was_there() -> None:
    """The marked check is put right as the operator presses `y`; a moment later he has seen which is marked now."""
    other = Check("stick-loss", CheckState.FAIL, "sticks lost: NOTHING", "set the parameter", (2,))
    async with console(NARROW, with_checks(CHECKS[0], other), kind=RunKind.LIVE) as c:
        c.app.operator.name = "Ada"
        await c.press("P")
        c.station.preflight = (other,)
        await c.tick()
        await c.press("y")
        assert "this line had just changed: look at it, then y again" in c.text()
        assert not [r for r in c.station.commands() if isinstance(r, AcknowledgeCheck)]
        await c.tick(1.0)
        await c.press("y")
        assert c.station.commands()[-1] == AcknowledgeCheck("stick-loss", "sticks lost: NOTHING", "Ada", (2,))


async def test_a_new_check_on_top_does_not_slide_under_the_mark_of_a_list_that_was_just_opened() -> None:
    top = Check("battery-loss", CheckState.FAIL, "battery low: NOTHING", "set the parameter", (8,))
    async with console(NARROW, with_checks(*CHECKS), kind=RunKind.LIVE) as c:
        c.app.operator.name = "Ada"
        await c.press("P")
        c.station.preflight = (top, *CHECKS)
        await c.tick()
        await c.press("y")
        assert c.station.commands()[-1] == AcknowledgeCheck("station-loss", NOTHING, "Ada", (1, 2, 3, 4))


async def test_a_check_that_has_just_come_to_be_about_others_too_is_looked_at_first() -> None:
    async with console(NARROW, with_checks(CHECKS[0]), kind=RunKind.LIVE) as c:
        c.app.operator.name = "Ada"
        await c.press("P")
        c.station.preflight = (Check("station-loss", CheckState.FAIL, NOTHING, "", ALL),)
        await c.tick()
        await c.press("y")
        assert "this line had just changed" in c.text()
        assert not [r for r in c.station.commands() if isinstance(r, AcknowledgeCheck)]


async def test_a_check_that_is_put_right_on_the_ground_leaves_the_open_list() -> None:
    """Nothing else changes there, not even the time of the mission."""
    async with console(NARROW, with_checks(*CHECKS), kind=RunKind.LIVE) as c:
        await c.press("P")
        assert "battery at 23 %" in c.text()
        c.station.preflight = tuple(check for check in CHECKS if check.name != "battery")
        await c.tick()
        assert "battery at 23 %" not in c.text()


async def test_the_list_is_signed_for_the_scenario_that_was_seen() -> None:
    async with console(NARROW, with_checks(*SIGN), kind=RunKind.LIVE) as c:
        await c.press("P", "S")
        await typed(c, "Ada")
        assert c.station.commands()[-1] == SignOff("Ada", 1)


async def test_read_only_it_asks_nothing() -> None:
    async with console(NARROW, with_checks(*CHECKS), kind=RunKind.LIVE, read_only=True) as c:
        await c.press("P", "y", "R", "escape")
        assert c.station.commands() == []
        assert isinstance(c.app.screen, FlyScreen)


# ---------------------------------------------------------------- the start


async def test_a_live_start_is_refused_until_each_check_is_overridden_by_its_name() -> None:
    async with console(NARROW, with_checks(*CHECKS), kind=RunKind.LIVE) as c:
        await c.press("space")
        assert "REFUSED" in c.text()
        await typed(c, "8")
        assert "type the name of one of these checks" in c.text()
        await typed(c, "rehearsal")
        await typed(c, "fence")
        assert "OVERRIDDEN for this start: rehearsal, fence" in c.text() and "REFUSED" in c.text()
        await typed(c, "station-loss")
        assert "sign with your name" in c.text()
        await typed(c, "Ada")
        assert "OVERRIDDEN by Ada for this start: rehearsal, fence" in c.text()
        assert "3 overridden" in c.text() and "FAIL" not in c.text(), "nothing refuses the start any more"
        await typed(c, "8")
        assert "Esc = STOP THIS" in c.text()
        assert starts(c) == []
        c.clock.advance(3.1)
        c.app.screen.tick()
        await c.settle()
        assert starts(c) == [Start(ALL, overrides=("rehearsal", "fence", "station-loss"), operator="Ada")]


async def test_overrides_end_with_the_question() -> None:
    async with console(NARROW, with_checks(*CHECKS), kind=RunKind.LIVE) as c:
        await c.press("space")
        await typed(c, "rehearsal")
        await c.press("escape", "space")
        assert "OVERRIDDEN" not in c.text() and "REFUSED" in c.text()


async def test_an_unsigned_live_start_is_signed_with_a_name() -> None:
    async with console(NARROW, with_checks(*SIGN), kind=RunKind.LIVE) as c:
        await c.press("space", "enter")
        assert "type your name" in c.text(), "nothing was typed"
        await typed(c, "Ada")
        await typed(c, "8")
        c.clock.advance(3.1)
        c.app.screen.tick()
        await c.settle()
        assert starts(c) == [Start(ALL, operator="Ada")]


async def test_checks_of_vehicles_that_stay_on_the_ground_refuse_no_start() -> None:
    fence = Check("fence", CheckState.FAIL, "2 shapes on board", "", (3,))
    async with console(NARROW, with_checks(fence, *GOOD), kind=RunKind.LIVE) as c:
        c.station.changes[3] = {"freshness": m.Freshness.LOST}
        await c.tick()
        await c.press("space")
        assert "REFUSED" not in c.text()


async def test_simulated_vehicles_start_by_enter_whatever_the_checks_are() -> None:
    warn = Check("heard", CheckState.WARN, "7 of the scenario's 8 are heard")
    async with console(NARROW, with_checks(warn, *GOOD, Check("fence", CheckState.NOT_NEEDED, ""))) as c:
        await c.press("space")
        assert isinstance(c.app.screen, StartDialog)
        assert "checks: 1 warn, 8 ok, 1 not needed" in c.text()
        assert "^ WARN heard                 7 of the scenario's 8 are heard" in c.text(), "the worst one is named"
        await c.press("enter")
        assert starts(c) == [Start(ALL)]


async def test_a_manual_take_off_asks_with_the_checks_that_would_refuse_a_start() -> None:
    async with console(NARROW, with_checks(*CHECKS), kind=RunKind.LIVE) as c:
        await c.press("s", "1", "enter", "c", "a")
        assert ReadChecks() in c.station.requests, "what is not known is read"
        text = c.text()
        assert "! check station-loss vehicles 1-4: " in text
        assert "rehearsal" not in text and "sign-off" not in text, "these are about the scenario's start"
        assert "fence" not in text, "nothing is said of others"


# ---------------------------------------------------------------- the scenario's own checklist

TODO = "do it, then tick it: y in the list"
LONG = "batteries of vehicles 5 to 8 strapped, their leads away from every propeller"


def items(*ticked: str, live: bool = True) -> tuple[Check, ...]:
    """A list of three items, as the station has it."""
    state = CheckState.FAIL if live else CheckState.WARN
    texts = ("propellers tight and undamaged", LONG, "people behind the line")
    open_ones = (Check(CHECKLIST, state, text, TODO) for text in texts if text not in ticked)
    return (*open_ones, *(Check(CHECKLIST, CheckState.TICKED, text, "ticked by Ada at 09:31:02Z") for text in ticked))


def ticks(c: Console) -> list[TickItem]:
    return [request for request in c.station.commands() if isinstance(request, TickItem)]


@pytest.mark.parametrize("size", [NARROW, WIDE])
async def test_pictures_of_a_checklist(size: tuple[int, int]) -> None:
    listed = (*items("people behind the line"), *CHECKS[1:3], *GOOD)
    async with console(size, with_checks(*listed), kind=RunKind.LIVE) as c:
        await c.press("P", "down")
        assert same_as_snapshot(f"preflight-items-{size[0]}x{size[1]}", c.text())
        await c.press("escape", "space")
        assert same_as_snapshot(f"preflight-start-items-{size[0]}x{size[1]}", c.text())


async def test_items_are_ticked_one_after_the_other_and_each_is_seen_before_its_key() -> None:
    async with console(NARROW, with_checks(*items(), *GOOD), kind=RunKind.LIVE) as c:
        await c.press("P", "y")
        assert "your name" in c.text(), "it is asked for once"
        await typed(c, "Ada")
        await c.press("y")
        assert ticks(c) == [TickItem("propellers tight and undamaged", "Ada")]
        assert "this line had just changed: look at it, then y again" in c.text()
        await c.tick(1.0)
        await c.press("y")
        assert ticks(c)[1:] == [TickItem(LONG, "Ada")]


async def test_a_tick_is_taken_back() -> None:
    async with console(NARROW, with_checks(*items(LONG), *GOOD), kind=RunKind.LIVE) as c:
        c.app.operator.name = "Bob"
        await c.press("P", "n")
        assert ticks(c) == [], "the marked item is not ticked"
        await c.press("down", "down")
        assert "n take back" in c.text() and "ticked by Ada at 09:31:02Z" in c.text()
        await c.press("y")
        assert ticks(c) == [], "it is ticked already"
        await c.press("n")
        assert ticks(c) == [TickItem(LONG, "Bob", ticked=False)]


async def test_read_only_nothing_is_ticked() -> None:
    async with console(NARROW, with_checks(*items(LONG), *GOOD), kind=RunKind.LIVE, read_only=True) as c:
        await c.press("P", "y", "down", "down", "n", "escape")
        assert c.station.commands() == []


async def test_a_live_start_is_not_offered_before_all_items_are_ticked() -> None:
    async with console(NARROW, with_checks(*items(), *GOOD), kind=RunKind.LIVE) as c:
        await c.press("space")
        assert "checklist 0 of 3 ticked; Tab = this is done:" in c.text() and "REFUSED" in c.text()
        await c.press("tab")
        assert "your name for the ticks" in c.text()
        await c.press("enter")
        assert "type your name: it is journalled" in c.text()
        await typed(c, "Ada")
        assert ticks(c) == [TickItem("propellers tight and undamaged", "Ada")]
        c.station.preflight = (*items("propellers tight and undamaged"), *GOOD)
        await c.tick()
        c.app.screen.tick()
        await c.settle()
        assert LONG[:40] in c.text()
        await c.press("tab")
        assert len(ticks(c)) == 1 and "this item had just changed" in c.text()
        await c.tick(1.0)
        await c.press("tab")
        assert ticks(c)[1] == TickItem(LONG, "Ada")
        c.station.preflight = (*items("propellers tight and undamaged", LONG, "people behind the line"), *GOOD)
        await c.tick()
        c.app.screen.tick()
        await c.settle()
        assert "checklist: all 3 items ticked" in c.text() and "type 8 and Enter" in c.text()


async def test_open_items_are_overridden_by_the_name_of_the_check() -> None:
    async with console(NARROW, with_checks(*items(), *GOOD), kind=RunKind.LIVE) as c:
        await c.press("space")
        await typed(c, "checklist")
        assert "OVERRIDDEN for this start: checklist" in c.text() and "Tab" not in c.text()
        await c.press("tab")
        assert ticks(c) == []
        await typed(c, "Ada")
        await typed(c, "8")
        c.clock.advance(3.1)
        c.app.screen.tick()
        await c.settle()
        assert starts(c) == [Start(ALL, overrides=("checklist",), operator="Ada")]


async def test_simulated_vehicles_start_with_open_items_which_can_be_practised() -> None:
    async with console(NARROW, with_checks(*items(live=False), *GOOD)) as c:
        c.app.operator.name = "Ada"
        await c.press("space", "tab")
        assert ticks(c) == [TickItem("propellers tight and undamaged", "Ada")]
        await c.press("enter")
        assert starts(c) == [Start(ALL)]


async def test_escape_leaves_the_start_also_while_a_name_is_typed() -> None:
    async with console(NARROW, with_checks(*items(), *GOOD), kind=RunKind.LIVE) as c:
        await c.press("space", "tab", "A", "escape")
        assert isinstance(c.app.screen, FlyScreen) and ticks(c) == []
