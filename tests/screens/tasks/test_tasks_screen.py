"""Tasks that go on and are cancelled; who is connected, and control that is taken and handed over."""

import math

import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.people import HandOver, PersonRow, TakeControl
from tui_gcs.core.protocol.services import CancelTask, TaskInfo


def busy(station: FakeStation) -> None:
    """Two tasks under way, one of another console; one that failed. Two consoles and a planner are connected."""
    tasks = (
        TaskInfo(1, 3, "set WPNAV_SPEED = 700", "console-test", "failed", 0, 1, "[b]refused[/b]: out of range", 80.0),
        TaskInfo(2, 1, "download log 12", "console-test", "running", 30, 120, "", 12.0),
        TaskInfo(
            3, 2, "calibrate accel", "console-77", "running", 1, 6, "", 4.0, prompt="place it level", waits=True,
            notes=("[red]Place vehicle level[/]",),
        ),
    )  # fmt: skip
    station.tasks = {task.number: task for task in tasks}
    station.people = (
        PersonRow("console-test", True, 340.0, True, "start", 300.0),
        PersonRow("console-77", True, 12.0, False, "calibrate", 4.0),
        PersonRow("planner-defend", True, 340.0, False, "", math.nan),
        PersonRow("cli-9", False, math.nan, False, "hold", 90.0),
    )


async def look(c: Console) -> None:
    c.app.screen.look()
    await c.settle()


async def opened(c: Console, *keys: str) -> None:
    await c.press("S", "t")
    await look(c)
    await c.press(*keys)


def panel(c: Console) -> str:
    return " ".join(c.app.screen.panel.text().split())


def asked(c: Console) -> list[object]:
    return [r for r in c.station.requests if isinstance(r, CancelTask | HandOver | TakeControl)]


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
@pytest.mark.parametrize(("view", "keys"), [("tasks", []), ("people", ["tab"])])
async def test_pictures(view: str, keys: list[str], size: tuple[int, int]) -> None:
    async with console(size, busy) as c:
        await opened(c, *keys)
        assert same_as_snapshot(f"tasks-{view}-{size[0]}x{size[1]}", c.text())


async def test_what_goes_on_comes_first_and_the_rest_can_be_left_out() -> None:
    async with console(WIDE, busy) as c:
        await opened(c)
        assert [task.number for task in c.app.screen.task_list.rows] == [3, 2, 1]
        assert "place it level" in panel(c) and "asked by console-77" in panel(c)
        await c.press("e")
        assert [task.number for task in c.app.screen.task_list.rows] == [3, 2]


async def test_a_task_is_cancelled_after_y_also_that_of_another_console() -> None:
    async with console(WIDE, busy) as c:
        await opened(c, "delete")
        assert "cancel task 3" in c.text() and "calibrate accel" in c.text()
        await c.press("enter", "escape")
        assert asked(c) == []
        await c.press("delete", "y")
        assert asked(c) == [CancelTask(3)] and "task 3 ends" in panel(c)


async def test_a_task_that_is_over_is_not_cancelled() -> None:
    async with console(WIDE, busy) as c:
        await opened(c, "end", "delete", "enter")
        assert asked(c) == [] and "task 1 is failed" in panel(c)


async def test_control_is_handed_over_to_the_chosen_console() -> None:
    async with console(WIDE, busy) as c:
        await opened(c, "tab", "O")
        assert "hand control over to console-77" in c.text()
        await c.press("y")
        assert asked(c) == [HandOver("console-77")] and "console-77 has control" in panel(c)


async def test_control_is_not_handed_to_oneself_and_a_refusal_is_shown() -> None:
    def refusing(station: FakeStation) -> None:
        busy(station)
        station.refused_control = "planner-defend is a planner worker: it may not command"

    async with console(WIDE, refusing) as c:
        await opened(c, "O")
        assert "choose a console first" in panel(c)
        await c.press("tab", "down", "O")
        assert "this is your console: choose with the arrows the one that is to have control" in panel(c)
        await c.press("down", "O", "y")
        assert "NOT DONE: planner-defend is a planner worker" in panel(c)


async def test_control_is_taken_from_another_console_after_y() -> None:
    def led(station: FakeStation) -> None:
        busy(station)
        station.in_control = "console-77"

    async with console(WIDE, led) as c:
        await opened(c, "G")
        assert "console-77 has control now" in c.text()
        await c.press("y")
        assert asked(c) == [TakeControl()]
        await c.tick()
        await c.press("G")
        assert "has control already" in panel(c)


async def test_a_read_only_console_changes_nothing() -> None:
    async with console(WIDE, busy, read_only=True) as c:
        await opened(c, "delete", "enter", "tab", "O", "enter")
        assert c.station.commands() == [] and "read-only" in panel(c)


async def test_text_of_a_vehicle_is_text() -> None:
    async with console(WIDE, busy) as c:
        await opened(c)
        assert "[red]Place vehicle level[/]" in panel(c)
        await c.press("end")
        assert "[b]refused[/b]: out of range" in panel(c)


async def test_nothing_is_asked_while_another_screen_is_shown() -> None:
    async with console(WIDE, busy) as c:
        await opened(c)
        screen = c.app.screen
        await c.press("f")
        count = len(c.station.requests)
        screen.look()
        await c.settle()
        assert len(c.station.requests) == count


async def test_the_palette_finds_the_screen() -> None:
    async with console(WIDE, busy) as c:
        await c.press(":", *"tasks", "enter")
        assert c.app.current_mode == "tasks"


async def test_the_footer_has_the_keys_of_the_view_and_the_title_where_planners_tasks_are() -> None:
    async with console(NARROW, busy) as c:
        await opened(c)
        assert "Del cancel" in c.line(-1) and "Tab people" in c.line(-1) and "hand over" not in c.line(-1)
        assert "those for planners: S a" in c.text()
        await c.press("tab")
        assert (
            "O hand over" in c.line(-1)
            and "take control" not in c.line(-1)
            and "Tab tasks" in c.line(-1)
            and "Del cancel" not in c.line(-1)
        )
