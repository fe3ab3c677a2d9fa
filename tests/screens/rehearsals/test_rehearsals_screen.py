"""The rehearsals screen: starting and cancelling one, gates, what was changed since, the path of the report."""

import dataclasses
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import msgspec
import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import SCENARIO_FILE, FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.client.rehearsal_job import RehearsalJob, RehearsalJobError, RehearsalJobState
from tui_gcs.core.protocol.common import RunPhase
from tui_gcs.core.protocol.replay import ReplayStatus
from tui_gcs.core.records.rehearsal_files import RESULT_NAME, SCENARIO_NAME
from tui_gcs.core.records.rehearsal_store import FILE, RehearsalRecord, plan_digest, remember
from tui_gcs.core.scenario.load import load
from tui_gcs.screens.rehearsals.rehearsals_screen import RehearsalsScreen

DAY_S = 86_400.0
TOML = SCENARIO_FILE.read_text()
CHECKS = [
    {"name": "worst idleness of defend", "value": 21.5, "limit": 30.0, "ok": True, "why": ""},
    {"name": "[b]separation[/b]", "value": 2.91, "limit": 5.0, "ok": False, "why": "vehicles 3 and 4, 2:13"},
]


class PaperJob(RehearsalJob):
    """A background rehearsal without a process."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, lambda: self.waiting)
        self.waiting = 0.0
        """Processes that wait for each processor."""
        self.started: list[tuple[str, list[str], list[str]]] = []
        self.state: RehearsalJobState | None = None
        self.refusal = ""

    @property
    def is_running(self) -> bool:
        return self.state is not None and self.state.running

    def start(self, name: str, toml: str, planners: list[str], options: list[str]) -> None:
        if self.refusal:
            raise RehearsalJobError(self.refusal)
        assert toml == TOML
        self.started.append((name, planners, options))
        self.state = RehearsalJobState(True, name, " ".join(options), time.time() - 60.0, 0.4, "round 2 of 4", False)

    def cancel(self) -> str:
        assert self.state is not None
        self.state = dataclasses.replace(self.state, cancelled=True)
        return "the rehearsal is cancelled; it is not on record"

    def end(self) -> None:
        """Its process is gone."""
        assert self.state is not None
        self.state = dataclasses.replace(self.state, running=False, text="")

    def look(self) -> RehearsalJobState | None:
        return self.state


def rehearsed(folder: Path) -> None:
    """Three: of exactly the station's plan, of another text that failed, and one that kept nothing."""
    plan = plan_digest(load(SCENARIO_FILE), {})
    other = TOML.replace('name = "', 'name = "[red]old ', 1)
    assert other != TOML
    forgotten = RehearsalRecord("x", True, 0.0, "swarm-challenge", 12, 12, by="pat")
    failed = RehearsalRecord("y", False, 0.0, "[red]old", 1, 2, "px4", "--lose 3@120", "", "pat", "rehearsal-2")
    good = RehearsalRecord(plan, True, 0.0, "swarm-challenge", 12, 12, "mixed", by="kim", folder="rehearsal-3")
    for age, (record, text) in enumerate([(forgotten, ""), (failed, other), (good, TOML)]):
        wall_s = 1.79e9 + age * DAY_S
        if record.folder:
            made = folder / record.folder
            made.mkdir(parents=True)
            (made / SCENARIO_NAME).write_text(text)
            (made / RESULT_NAME).write_bytes(msgspec.json.encode({"ok": False, "data": {"checks": CHECKS}}))
        report = "/home/kim/report.html" if record.passed and record.folder else ""
        folder.mkdir(exist_ok=True)
        remember(folder / FILE, msgspec.structs.replace(record, wall_s=wall_s, report=report))


@asynccontextmanager
async def rehearsals(tmp_path: Path, size: tuple[int, int] = WIDE, *, empty: bool = False) -> AsyncIterator[Console]:
    folder = tmp_path / "sim"
    if not empty:
        rehearsed(folder)

    def written(station: FakeStation) -> None:
        station.toml = TOML

    async with console(size, written, recordings={"SIM": folder}) as c:
        await c.press("S", "r")
        screen(c).runs.job = PaperJob(folder)
        await look(c)
        yield c


async def look(c: Console) -> None:
    screen(c).look()
    await c.settle()


def screen(c: Console) -> RehearsalsScreen:
    assert isinstance(c.app.screen, RehearsalsScreen)
    return c.app.screen


def job(c: Console) -> PaperJob:
    found = screen(c).runs.job
    assert isinstance(found, PaperJob)
    return found


def panel(c: Console) -> str:
    return " ".join(screen(c).panel.text().split())


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
@pytest.mark.parametrize(("view", "keys"), [("list", ["down"]), ("gates", ["enter"]), ("changes", ["down", "d"])])
async def test_pictures(tmp_path: Path, view: str, keys: list[str], size: tuple[int, int]) -> None:
    async with rehearsals(tmp_path, size) as c:
        await c.press(*keys)
        assert same_as_snapshot(f"rehearsals-{view}-{size[0]}x{size[1]}", c.text())


async def test_nothing_rehearsed_yet_says_what_to_do(tmp_path: Path) -> None:
    async with rehearsals(tmp_path, empty=True) as c:
        assert "nothing was rehearsed yet: R rehearses" in c.text()
        assert "R rehearse" in c.line(-1)
        assert not any(key in c.line(-1) for key in ("Enter gates", "d changes", "Del cancel")), "nothing is there"
        for key in ("enter", "d", "y"):
            await c.press(key)
            assert "no rehearsal is chosen" in panel(c)
        await c.press("delete")
        assert "no rehearsal is under way" in panel(c)


async def test_a_rehearsal_is_started_with_typed_options_and_shows_how_far_it_is(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        await c.press("R", *"--wind 3,1", "enter")
        assert job(c).started == [("swarm-challenge", [], ["--wind=3,1"])]
        assert "started with --wind=3,1; it goes on when this console is left" in panel(c)
        await look(c)
        assert "UNDER WAY 40%, 01:00 passed, about 01:30 left" in c.text() and "round 2 of 4" in panel(c)
        await c.press("R")
        assert "a rehearsal is under way: Del cancels it" in panel(c) and len(job(c).started) == 1


async def test_escape_starts_nothing_and_a_refusal_is_shown(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        await c.press("R")
        assert "--lose 3@60" in panel(c) and "--fault loss=0.2,delay=200ms" in panel(c)
        await c.press("escape")
        assert "not started" in panel(c) and job(c).started == []
        await c.press("R", *"--output /etc/passwd", "enter")
        assert "NOT STARTED: --output: not known here" in panel(c) and job(c).started == []
        job(c).refusal = "the computer is too busy"
        await c.press("R", "enter")
        assert "NOT STARTED: the computer is too busy" in panel(c)


async def test_the_autopilots_that_are_heard_are_offered(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        c.station.changes = {1: {"autopilot": "PX4"}}
        await c.tick()
        await c.press("R", "enter")
        assert job(c).started[0][2] == ["--autopilot=mixed"]


async def test_edits_that_are_not_applied_are_said_not_to_be_in_it(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        screen(c).runs.unapplied = lambda: 2
        await c.press("R", "enter")
        assert "2 edits of the plan screen are not applied and NOT in it" in panel(c)


async def test_the_key_that_cancels_is_named_while_one_is_under_way(tmp_path: Path) -> None:
    async with rehearsals(tmp_path, NARROW) as c:
        assert "Del cancel" not in c.line(-1)
        await c.press("R", "enter")
        await look(c)
        assert "Del cancel" in c.line(-1)


async def test_the_one_under_way_is_cancelled_after_y(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        await c.press("R", "enter", "delete")
        assert "cancel the rehearsal" in c.text()
        await c.press("escape")
        assert job(c).is_running and "it goes on" in panel(c)
        await c.press("delete", "y")
        assert "cancelled; it is not on record" in panel(c)
        assert "BEING CANCELLED" in c.text() and "UNDER WAY" not in c.text()
        job(c).end()
        await look(c)
        assert "swarm-challenge was cancelled, and is not on record" in panel(c) and "BEING" not in c.text()


async def test_on_a_busy_computer_it_waits_while_something_is_armed(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        job(c).waiting = 2.5
        c.station.fly()
        await c.tick()
        await c.press("R")
        assert "the computer is too busy: 2.5 processes wait for each processor" in panel(c) and not job(c).started
        c.station.run = RunPhase.IDLE
        await c.tick()
        await c.press("R", "enter")
        assert job(c).started and "this computer is busy: it takes longer" in panel(c)


async def test_the_result_of_one_that_ends_is_chosen(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        await c.press("down", "R", "enter")
        await look(c)
        job(c).end()
        record = RehearsalRecord("z", False, time.time(), "swarm-challenge", 11, 12)
        remember(tmp_path / "sim" / FILE, record)
        await look(c)
        assert screen(c).rehearsal_list.chosen == 0 and "it has ended: FAILED 11/12" in panel(c)


@pytest.mark.parametrize("passed", [True, False])
async def test_on_another_screen_a_line_says_how_it_ended(tmp_path: Path, *, passed: bool) -> None:
    async with rehearsals(tmp_path) as c:
        await c.press("R", "enter")
        await look(c)
        rehearsals_screen = screen(c)
        await c.press("f")
        rehearsals_screen.look()
        await c.settle()
        assert "rehearsal of" not in c.told()
        paper = rehearsals_screen.runs.job
        assert isinstance(paper, PaperJob)
        paper.end()
        if passed:
            remember(tmp_path / "sim" / FILE, RehearsalRecord("z", True, time.time(), "[b]swarm", 12, 12))
        rehearsals_screen.look()
        await c.settle()
        told = "rehearsal of [b]swarm: passed 12/12" if passed else "swarm-challenge was NOT rehearsed: its process"
        assert told in c.line(1) and told in c.told()
        rehearsals_screen.look()
        await c.settle()
        assert c.told().count(told) == 1


async def test_a_killed_process_is_said(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        await c.press("R", "enter")
        await look(c)
        job(c).end()
        await look(c)
        assert "NOT rehearsed: its process was killed, or the computer was switched off" in panel(c)
        assert "it goes on when this console is left" not in panel(c)


async def test_why_a_rehearsal_could_not_be_flown_stays_on_the_screen(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        job(c).state = RehearsalJobState(False, "s", "", time.time(), 0.0, "--wind 3: two numbers are needed", False)
        await look(c)
        assert "s was NOT rehearsed: --wind 3: two numbers are needed" in panel(c)


async def test_a_result_that_could_not_be_written_is_said(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        why, result = "report.html: cannot be written (No space left on device)", "16 of 16 checks hold"
        job(c).state = RehearsalJobState(False, "s", "", time.time(), 0.9, why, False, result)
        await look(c)
        assert f"s was flown (16 of 16 checks hold), but is NOT on record: {why}" in panel(c)


async def test_what_was_changed_since(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        assert "since then: nothing; exactly this plan would fly" in panel(c)
        await c.press("down")
        await look(c)
        assert "since then: 1 line of the scenario differs" in panel(c) and "failed: [b]separation[/b]" in panel(c)
        await c.press("d")
        assert [change.sign for change in screen(c).change_list.rows] == ["~"] and "[red]old" in c.text()
        await c.press("escape", "down")
        await look(c)
        assert "the scenario of then was not kept" in panel(c)
        await c.press("enter")
        assert "the gates of this one were not kept" in c.text()


async def test_the_failed_gates_come_first_with_their_reason(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        await c.press("enter")
        assert "FAILED: 2.91, limit 5.00" in panel(c) and "vehicles 3 and 4, 2:13" in panel(c)
        await c.press("down")
        assert "holds: 21.50, limit 30.00" in panel(c)
        await c.press("escape", "enter")
        assert "FAILED: 2.91, limit 5.00" in panel(c), "they are at the first gate again"


async def test_the_path_of_a_report_is_copied(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        await c.press("y")
        assert "clipboard: /home/kim/report.html" in panel(c)
        await c.press("escape", "down", "y")
        assert "this one has no report" in panel(c)


async def test_nothing_is_rehearsed_from_a_replay_nor_without_a_folder(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        status = c.app.feed.status
        assert status is not None
        player = ReplayStatus(at_s=1.0, length_s=2.0, speed=1.0, paused=False)
        c.app.feed.status = msgspec.structs.replace(status, replay=player)
        await c.press("R")
        assert "this is a replay" in panel(c)
    async with console(WIDE) as c:
        await c.press("S", "r", "R")
        assert "tui-gcs rehearse in a shell" in panel(c)


async def test_it_is_reached_from_plan_and_from_the_checks_before_a_start(tmp_path: Path) -> None:
    async with rehearsals(tmp_path) as c:
        await c.press("p", "H")
        assert c.app.current_mode == "rehearsals"
        await c.press("f", "P", "H")
        assert c.app.current_mode == "rehearsals"
        await c.press("L")
        assert c.app.current_mode == "flights"
