"""The rehearsals screen: layout, views and keys."""

import asyncio
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.rehearsal_actions import REHEARSAL_ACTIONS
from tui_gcs.client.rehearsal_job import OPTIONS, RehearsalJob, RehearsalJobState
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.records.rehearsal_files import read_gates, read_scenario_text, scenario_changes
from tui_gcs.core.records.rehearsal_store import FILE, plan_digest, read_rehearsals
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.notices import Severity
from tui_gcs.screens.common.polled_screen import PolledScreen
from tui_gcs.screens.rehearsals.rehearsal_runs import RehearsalRuns
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.number_text import clock as clock_words
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.rehearsals.rehearsal_lists import (
    ChangeList,
    GateList,
    RehearsalDetail,
    RehearsalList,
    RehearsalPanel,
    RehearsalRow,
    gate_texts,
    rehearsal_texts,
    result_words,
)

GATES, CHANGES = "-gates", "-changes"
"""Classes of the screen while the gates of a rehearsal are shown, or what was changed since."""


class RehearsalsScreen(PolledScreen):
    """Rehearsals on this computer, and the one under way."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = REHEARSAL_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(REHEARSAL_ACTIONS, "rehearsals")
    LOOK_S = 1.0
    NEEDS_STATION = False
    CSS = """
    RehearsalsScreen { layout: vertical; }
    RehearsalsScreen.-gates RehearsalList, RehearsalsScreen.-changes RehearsalList { display: none; }
    RehearsalsScreen.-gates GateList { display: block; }
    RehearsalsScreen.-changes ChangeList { display: block; }
    """

    def __init__(
        self,
        feed: Feed,
        clock: Clock,
        state: Path | None,
        unapplied: Callable[[], int],
        tell: Callable[[str, Severity], None],
        *,
        glyphs: GlyphSet = UNICODE,
    ) -> None:
        """Show the rehearsals below `state`, the state directory of SIM; see `RehearsalRuns.unapplied`.

        `tell` shows a line on every screen: how a rehearsal ended while the operator was looking at another one.
        """
        super().__init__(feed)
        self._state = state
        self._tell = tell
        self._rows: tuple[RehearsalRow, ...] = ()
        self._detail = RehearsalDetail()
        self._job: RehearsalJobState | None = None
        self.runs = RehearsalRuns(self, feed, clock, glyphs, self.show_all, state)
        self.runs.unapplied = unapplied
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.rehearsal_list = RehearsalList(glyphs=glyphs)
        self.rehearsal_list.empty_text = "nothing was rehearsed yet: R rehearses the station's scenario"
        self.gate_list = GateList(glyphs=glyphs)
        self.gate_list.empty_text = "the gates of this one were not kept"
        self.change_list = ChangeList(glyphs=glyphs)
        self.panel = RehearsalPanel(glyphs=glyphs)
        self.options_bar = PromptBar("options")
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed, here="show_rehearsals")

    def compose(self) -> ComposeResult:
        """Compose the top lines, the lists, the panel, the question and the footer."""
        yield self.top_lines
        yield self.rehearsal_list
        yield self.gate_list
        yield self.change_list
        yield self.panel
        yield self.options_bar
        yield self.footer

    @on(events.ScreenResume)
    def look_again(self) -> None:
        """Look at once."""
        self.look()

    def look(self) -> None:
        """Look at all rehearsals; while another screen is shown only whether the one under way has ended."""
        if self.is_current:
            super().look()
        elif self._job is not None and self._job.running and self.runs.job is not None and not self._is_looking:
            self._is_looking = True
            self.run_worker(self._look_for_end(self._job, self.runs.job), group="look", exit_on_error=False)

    async def _look_for_end(self, before: RehearsalJobState, job: RehearsalJob) -> None:
        try:
            now = await asyncio.to_thread(job.look)
            if now is not None and now.running:
                return
            self._rows, self._job = await asyncio.to_thread(self._read)
            self._note_end(before)
            if self._has_result(before):
                record = self._rows[0].record
                level = Severity.NORMAL if record.passed else Severity.CAUTION
                self._tell(f"rehearsal of {clean(record.scenario, 40)}: {result_words(record)}", level)
            elif self._job is not None and not self._job.cancelled:
                self._tell(self._job_texts()[0][0], Severity.CAUTION)
        finally:
            self._is_looking = False

    async def ask_station(self) -> None:
        """Read the rehearsals and the one under way. The station is not asked: they are files."""
        before = self._job
        self._rows, self._job = await asyncio.to_thread(self._read)
        self.rehearsal_list.show_kept(self._rows, lambda row: row.record.wall_s)
        if before is not None and before.running and not (self._job is not None and self._job.running):
            self._note_end(before)
        self._detail = await asyncio.to_thread(self._read_detail, self.rehearsal_list.chosen_row)
        self.show_all()

    def _read(self) -> tuple[tuple[RehearsalRow, ...], RehearsalJobState | None]:
        if self._state is None:
            return (), None
        scenario = self.feed.scenario
        plan = plan_digest(scenario.scenario, self.feed.planner_files) if scenario is not None else ""
        records = reversed(read_rehearsals(self._state / FILE))
        job = self.runs.job.look() if self.runs.job is not None else None
        return tuple(RehearsalRow(record, record.plan == plan) for record in records), job

    def _note_end(self, job: RehearsalJobState) -> None:
        """Choose the result of a rehearsal that has ended; without one the panel says why."""
        self.runs.report = ()
        if self._has_result(job):
            self.rehearsal_list.chosen = 0
            self.runs.say(f"it has ended: {result_words(self._rows[0].record)}")

    def _has_result(self, job: RehearsalJobState) -> bool:
        """Whether the newest result on record is from after the beginning of this rehearsal, which has ended."""
        ended = self._job is not None and not self._job.running
        return ended and bool(self._rows) and self._rows[0].record.wall_s >= job.began_wall_s

    def _read_detail(self, row: RehearsalRow | None) -> RehearsalDetail:
        if row is None or self._state is None or not row.record.folder:
            return RehearsalDetail()
        folder = self._state / Path(row.record.folder).name
        before, scenario = read_scenario_text(folder), self.feed.scenario
        changes = None if before is None or scenario is None else scenario_changes(before, scenario.toml)
        return RehearsalDetail(read_gates(folder), changes)

    @on(events.Resize)
    def show_all(self) -> None:
        """Show what is known; the same row stays chosen."""
        if not self.is_current:
            return
        row = self.rehearsal_list.chosen_row
        self.rehearsal_list.show_kept(self._rows, lambda each: each.record.wall_s)
        self.gate_list.show_kept(self._detail.gates, lambda gate: gate.name)
        self.change_list.show_kept(self._detail.changes or (), lambda change: change)
        self.change_list.empty_text = "no line of the scenario differs, or the one of then was not kept"
        under_way = self._progress_words()
        set_title(self.rehearsal_list, "   ".join(filter(None, (f"rehearsals  {len(self._rows)}", under_way))))
        result = result_words(row.record) if row is not None else ""
        set_title(self.gate_list, "   ".join(filter(None, (f"gates: {result}", under_way))))
        set_title(self.change_list, "   ".join(filter(None, ("scenario now, against the rehearsed one", under_way))))
        self.footer.relabel(self._labels(row))
        self.panel.show(*self._panel(row))

    def _labels(self, row: RehearsalRow | None) -> dict[str, str]:
        """Return what keys are called: what nothing is there for is not offered."""
        running = self._job is not None and self._job.running
        labels = {"end_rehearsal": "cancel"} if running else {"end_rehearsal": ""}
        return labels if row is not None else labels | {"gates": "", "changes": ""}

    def _progress_words(self) -> str:
        """Return how far the rehearsal under way is; "" where none is."""
        job = self._job
        if job is None or not job.running:
            return ""
        if job.cancelled:
            return "BEING CANCELLED"
        passed_s = max(0.0, time.time() - job.began_wall_s)
        left = f", about {clock_words(passed_s / job.done - passed_s)[2:]} left" if job.done > 0.0 else ""
        return f"UNDER WAY {job.done:.0%}, {clock_words(passed_s)[2:]} passed{left}"

    def _panel(self, row: RehearsalRow | None) -> tuple[str, list[Run]]:
        texts: list[Run] = [*self.runs.report, *self._job_texts()]
        if self.has_class(GATES):
            gate = self.gate_list.chosen_row
            return "gate", [*texts, *(gate_texts(gate) if gate is not None else [])]
        return "rehearsal", [*texts, *(rehearsal_texts(row, self._detail) if row is not None else [])]

    def _job_texts(self) -> list[Run]:
        """Return what goes on, or why the newest background rehearsal has no result."""
        job = self._job
        if job is None:
            return []
        options = f" {job.options}" if job.options else ""
        if job.running and job.cancelled:
            return [(f"being cancelled: {job.scenario}{options}   its processes end", Ink.CAUTION)]
        if job.running:
            return [(f"under way: {job.scenario}{options}   {job.text}", Ink.BOLD)]
        if self._has_result(job):
            return []
        if job.cancelled:
            return [(f"{job.scenario}{options} was cancelled, and is not on record", Ink.MUTED)]
        why = job.text or "its process was killed, or the computer was switched off"
        what = f"was flown ({job.result}), but is NOT on record" if job.result else "was NOT rehearsed"
        return [(f"{job.scenario}{options} {what}: {why}", Ink.WARNING)]

    def show_chosen(self) -> None:
        """Show the chosen row at once, and read what belongs to it."""
        self.show_all()
        if self.row_list is self.rehearsal_list:
            self.look()

    @property
    def row_list(self) -> RowsView[Any]:
        """The rehearsals, the gates of one, or what was changed since."""
        if self.has_class(GATES):
            return self.gate_list
        return self.change_list if self.has_class(CHANGES) else self.rehearsal_list

    def say_copied(self, text: str, ink: Ink) -> None:
        """See `ListScreen`."""
        self.runs.say_copied(text, ink)

    # ---------------------------------------------------------------- keys

    def action_rehearse(self) -> None:
        """Ask for the options of a rehearsal of the station's scenario; Enter starts it."""
        if why := self.runs.why_not():
            self.runs.say(why, Ink.CAUTION)
        else:
            # The options cannot be guessed: they are listed while the question is shown.
            examples = "  ".join(f"{name} {example}" for name, example in OPTIONS.items())
            self.runs.say(f"options, none is needed: {examples}   (vehicle@seconds; east,north m/s)")
            self.options_bar.ask("rehearse with", self.runs.default_options())

    @on(PromptBar.Answered, "#options")
    def _options_answered(self, message: PromptBar.Answered) -> None:
        self.set_focus(None)
        if message.text is None:
            self.runs.say("not started")
        else:
            self.runs.start(message.text)
            self.look()

    def action_end_rehearsal(self) -> None:
        """Ask whether the rehearsal under way is to be cancelled."""
        self.runs.cancel(self.look)

    def action_gates(self) -> None:
        """Show the gates of the chosen rehearsal, or go back to the list."""
        self.gate_list.chosen = 0  # of another rehearsal a gate of that name may hold, and the failed ones stand first
        self._show_view("" if self.has_class(GATES) else GATES)

    def action_changes(self) -> None:
        """Show what was changed in the scenario since the chosen rehearsal, or go back to the list."""
        self._show_view("" if self.has_class(CHANGES) else CHANGES)

    def _show_view(self, view: str) -> None:
        if view and self.rehearsal_list.chosen_row is None:
            self.runs.say("no rehearsal is chosen", Ink.CAUTION)
            return
        for name in (GATES, CHANGES):
            self.set_class(name == view, name)
        self.show_all()

    def action_copy_row(self) -> None:
        """Copy the path of the chosen rehearsal's report; of gates and changes, the chosen row."""
        if self.row_list is not self.rehearsal_list:
            super().action_copy_row()
            return
        row = self.rehearsal_list.chosen_row
        self.runs.copy_report(row.record if row is not None else None)

    def action_show_flights(self) -> None:
        """Show the flights screen, which replays and deletes the recordings."""
        self.app.switch_mode("flights")

    def action_cancel(self) -> None:
        """Forget the report of the last key; without one go back to the list."""
        if self.runs.report:
            self.runs.report = ()
            self.show_all()
        else:
            self._show_view("")
