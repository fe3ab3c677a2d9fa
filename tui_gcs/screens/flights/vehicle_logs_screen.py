"""The screen of logs on vehicles: layout and keys."""

from collections.abc import Callable, Coroutine, Sequence
from typing import Any, ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.vehicle_log_actions import VEHICLE_LOG_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import SelectionChanged, StationBack, StationLost
from tui_gcs.feed.task_requests import TaskOutcome, by_reason
from tui_gcs.screens.common.list_screen import ListScreen
from tui_gcs.screens.common.screen_edits import ScreenEdits
from tui_gcs.screens.flights.onboard_downloads import OnboardDownloads, OnboardLog
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.flights.flight_lists import FlightPanel, size_words
from tui_gcs.widgets.flights.vehicle_log_list import VehicleLogList


class VehicleLogsScreen(ListScreen):
    """What vehicles hold; nothing is asked of them before `u`."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = VEHICLE_LOG_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(VEHICLE_LOG_ACTIONS, "onboard")
    CSS = "VehicleLogsScreen { layout: vertical; }"

    def __init__(self, feed: Feed, clock: Clock, *, glyphs: GlyphSet = UNICODE) -> None:
        """Show logs of the vehicles of `feed`."""
        super().__init__(feed)
        self._glyphs = glyphs
        self.downloads = OnboardDownloads(feed.requests, clock, self.show_all)
        self.edits = ScreenEdits(self, feed, clock, glyphs, self.show_all)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.log_list = VehicleLogList(glyphs=glyphs)
        self.log_list.empty_text = "u asks the selected vehicles, or all, which logs they hold"
        self.panel = FlightPanel(glyphs=glyphs)
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed, here="show_onboard")

    def compose(self) -> ComposeResult:
        """Compose the top lines, the list, the panel and the footer."""
        yield self.top_lines
        yield self.log_list
        yield self.panel
        yield self.footer

    def on_mount(self) -> None:
        """Begin to receive the feed's messages."""
        self.feed.listen(self)

    @on(events.ScreenResume)
    @on(events.Resize)
    @on(SelectionChanged)
    @on(StationLost)
    @on(StationBack)
    def show_all(self) -> None:
        """Show what is known."""
        if not self.is_current:
            return
        logs = self.downloads.rows()
        rows = [(log.vehicle, log.row, log.marked, log.task, log.outcome) for log in logs]
        self.log_list.show_kept(rows, lambda row: (row[0], row[1].id))
        marked = [log for log in logs if log.marked]
        parts = [f"logs on vehicles  {len(rows)}"]
        if marked:
            parts.append(f"{len(marked)} marked, {size_words(sum(log.row.size for log in marked))}")
        if self.downloads.asking:
            parts.append(f"asking {ids(sorted(self.downloads.asking))}")
        if self.feed.station_lost:
            parts.append("STATION SILENT")
        set_title(self.log_list, "   ".join(parts))
        self.footer.relabel(self._labels())
        self.panel.show(None, None, self.edits.report)
        shown = self.feed.shown_vehicles()
        set_title(self.panel, f"for {vehicles_words(shown)}" if shown else "no vehicle is heard yet")

    def _labels(self) -> dict[str, str]:
        """Return what the footer names first: cancelling what goes on, and where downloaded logs are."""
        chosen = self._chosen
        if chosen is not None and chosen.task is not None:
            return {"download": "", "end_downloads": "cancel"}
        if any(log.outcome is not None and log.outcome.ok for log in self.downloads.logs.values()):
            return {"show_files": "flights"}
        return {}

    def show_chosen(self) -> None:
        """Show the chosen row."""
        self.show_all()

    @property
    def row_list(self) -> RowsView[Any]:
        """The logs."""
        return self.log_list

    @property
    def _chosen(self) -> OnboardLog | None:
        row = self.log_list.chosen_row
        return self.downloads.logs.get((row[0], row[1].id)) if row is not None else None

    def _why_not(self) -> str:
        return self.feed.requests.read_only or self.feed.action_context().silent

    def _held(self, ended: Sequence[TaskOutcome]) -> str:
        """Return which of the vehicles hold no log: an empty list is an answer."""
        holding = {log.vehicle for log in self.downloads.rows()}
        without = sorted({one.vehicle for one in ended if one.ok} - holding)
        return f"; no log on {vehicles_words(without)}: most autopilots begin one when they arm" if without else ""

    def _run(
        self,
        what: str,
        work: Callable[[], Coroutine[Any, Any, tuple[TaskOutcome, ...]]],
        more: Callable[[Sequence[TaskOutcome]], str] = lambda ended: "",
    ) -> None:
        """Carry out a request in the background, and report how it ended for each vehicle, and `more` where it did."""

        async def worker() -> None:
            self.edits.say(f"{what} …")
            ended = await work()
            self._report(what, ended, more(ended))

        if why := self._why_not():
            self.edits.say(why, Ink.CAUTION)
        else:
            self.run_worker(worker(), group=what, exit_on_error=False)

    def _report(self, what: str, ended: Sequence[TaskOutcome], more: str) -> None:
        failed = [one for one in ended if not one.ok]
        if failed:
            reasons = "; ".join(f"{vehicles_words(whose)}: {text}" for text, whose in by_reason(ended).items())
            self.edits.say(f"{what}: {len(failed)} of {len(ended)} NOT DONE: {reasons}", Ink.WARNING)
        else:
            self.edits.say(f"{what}: done for {vehicles_words({one.vehicle for one in ended})}{more}", Ink.NORMAL)

    def say_copied(self, text: str, ink: Ink) -> None:
        """See `ListScreen`."""
        self.edits.say_copied(text, ink)

    # ---------------------------------------------------------------- keys

    def action_list_logs(self) -> None:
        """Ask the selected vehicles, or all, for their lists."""
        vehicles = self.feed.shown_vehicles()
        if not vehicles:
            self.edits.say("no vehicle is heard yet", Ink.CAUTION)
        else:
            self._run("list", lambda: self.downloads.list_logs(vehicles), self._held)

    def action_download(self) -> None:
        """Download the marked logs, or the chosen one."""
        chosen = self._chosen
        wanted = [log for log in self.downloads.rows() if log.marked] or ([chosen] if chosen is not None else [])
        wanted = [log for log in wanted if log.task is None]
        if not wanted:
            under_way = "it is being downloaded: Del cancels, the arrows choose another"
            why = under_way if chosen is not None else "no log is listed: u asks vehicles for their logs"
            self.edits.say(why, Ink.CAUTION)
        else:
            self._run(f"download of {len(wanted)}", lambda: self.downloads.download(wanted))

    def action_mark(self) -> None:
        """Mark the chosen log, or take its mark off, and go on to the next."""
        if (log := self._chosen) is not None:
            log.marked = not log.marked
            self.log_list.step(1)
            self.show_all()

    def action_mark_newest(self) -> None:
        """Mark the newest log of each vehicle."""
        for log in self.downloads.newest():
            log.marked = True
        self.show_all()

    def action_end_downloads(self) -> None:
        """Cancel the download of the chosen log."""
        log, why = self._chosen, self._why_not()
        if why or log is None or log.task is None:
            self.edits.say(why or "the chosen log is not being downloaded: the arrows choose another", Ink.CAUTION)
            return

        async def end() -> None:
            self.edits.say(await self.downloads.end(log))

        self.run_worker(end(), group="cancel", exit_on_error=False)

    def action_show_files(self) -> None:
        """Show the flights screen, which lists what was downloaded."""
        self.app.switch_mode("flights")

    def action_cancel(self) -> None:
        """Take all marks off, and forget the report."""
        for log in self.downloads.logs.values():
            log.marked = False
        self.edits.report = ()
        self.show_all()
