"""The planner log screen: what planners print and log, by team, level and words; it follows, or stays where one reads.

Older lines are requested from the station as one goes up.
"""

from typing import ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.viewer_actions import PLANNER_LOG_ACTIONS
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.planner_log import PlannerLogFilter, PlannerLogLine
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.logs.planner_log_watch import PlannerLogWatch
from tui_gcs.feed.messages import StationBack, StationLost
from tui_gcs.screens.common.polled_screen import PolledScreen
from tui_gcs.screens.common.row_copies import below_report
from tui_gcs.screens.common.typed_words import TypedWords
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowPicked, RowsView
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.logs.planner_log_list import PlannerLogList, PlannerLogPanel

MAX_PIECES = 20
"""The most pieces of the log that are searched for one key press, until something fits the filter."""
LEVEL_WORDS = ("all levels", "no debug", "warning+", "error+")
"""The steps of the level filter, by the least rank that is shown."""


class PlannerLogScreen(PolledScreen):
    """The list of lines, and the keys that move in it and filter it."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = PLANNER_LOG_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(PLANNER_LOG_ACTIONS, "planner_log")
    LOOK_S = 1.0
    CSS = "PlannerLogScreen { layout: vertical; }"

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE) -> None:
        """Show the planner log of the station of `feed`."""
        super().__init__(feed)
        self._glyphs = glyphs
        self._follows = True
        self._filter = PlannerLogFilter()
        self._is_asking_older = False
        self.typed = TypedWords()
        self.watch_log = PlannerLogWatch(feed.requests, self.show_all)
        self._report: tuple[Run, ...] = ()
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.log_list = PlannerLogList(glyphs=glyphs)
        self.panel = PlannerLogPanel(glyphs=glyphs)

    def compose(self) -> ComposeResult:
        """Compose the top lines, the lines of the log, the chosen one and the footer."""
        yield self.top_lines
        yield self.log_list
        yield self.panel
        yield FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=self._glyphs, feed=self.feed, here="show_planner_log")

    @on(events.ScreenResume)
    def look_at_once(self) -> None:
        """Look without waiting for the next second."""
        self.look()

    @on(StationBack)
    def look_again(self) -> None:
        """Begin anew: it may be another station, or one that was started again."""
        self.watch_log.forget()
        self.look()

    async def ask_station(self) -> None:
        """Ask for new lines; for older ones, too, if few of those held fit the filter."""
        is_first = not self.watch_log.lines
        await self.watch_log.look()
        if is_first:
            self._fill()

    @on(events.Resize)
    @on(StationLost)
    def show_all(self) -> None:
        """Show the lines that fit the filter: the newest ones, or those that one reads."""
        if not self.is_current:
            return
        lines = self.watch_log.lines
        if self._filter != PlannerLogFilter():
            lines = [line for line in lines if self._filter.passes(line)]
        self.log_list.empty_text = self._empty_text()
        if self._follows:
            self.log_list.show(lines, len(lines) - 1)
        else:
            self.log_list.show_kept(lines, id)  # two lines may be equal
        self.show_chosen()

    def _empty_text(self) -> str:
        if self.watch_log.problem:
            return self.watch_log.problem
        if self._filter != PlannerLogFilter():
            return "no line fits: Esc ends the filter, PgUp looks further back"
        return "no planner has printed or logged anything"

    def show_chosen(self) -> None:
        """Show the title, and the chosen line in whole."""
        set_title(self.log_list, self._title())
        where = ((f"kept in {clean(self.watch_log.path, 300)}", Ink.MUTED),) if self.watch_log.path else ()
        self.panel.show(self.log_list.chosen_row, self._report or where)

    def _title(self) -> str:
        chosen, watch = self._filter, self.watch_log
        below = len(self.log_list.rows) - 1 - self.log_list.chosen
        parts = ["planner log", "follows" if self._follows else f"{below} below: F follows"]
        parts.append(f"team {chosen.team}" if chosen.team else "")
        parts.append(LEVEL_WORDS[chosen.least_rank] if chosen.least_rank else "")
        parts.append(self.typed.title("words"))
        parts.append(f"{watch.left_out} LINES LEFT OUT (too many)" if watch.left_out else "")
        parts.append("from its beginning" if watch.is_oldest else "")
        parts.append("STATION SILENT" if self.feed.station_lost else "")
        return "   ".join(part for part in parts if part)

    @property
    def row_list(self) -> RowsView[PlannerLogLine]:
        """The lines."""
        return self.log_list

    def say(self, text: str, ink: Ink = Ink.TEXT) -> None:
        """Report what became of a key."""
        self._report = ((clean(text, 400), ink),)
        self.show_chosen()

    def say_copied(self, text: str, ink: Ink) -> None:
        """Report what was copied."""
        self._report = below_report(self._report, text, ink)
        self.show_chosen()

    # ---------------------------------------------------------------- older lines

    def _fill(self) -> None:
        """Ask for older lines until the list is full, or nothing older is kept."""
        if len(self.log_list.rows) <= self.log_list.page:
            self._ask_older()

    def _ask_older(self) -> None:
        if not self._is_asking_older and not self.feed.station_lost:
            self._is_asking_older = True
            self.run_worker(self._older(), group="older", exit_on_error=False)

    async def _older(self) -> None:
        shown = len(self.log_list.rows)
        try:
            # A filter may fit few lines: several pieces are read for one key press.
            for _ in range(MAX_PIECES):
                if not await self.watch_log.older():
                    break
                self.show_all()
                if len(self.log_list.rows) >= shown + self.log_list.page:
                    break
        finally:
            self._is_asking_older = False
        self.show_all()

    # ---------------------------------------------------------------- keys

    def on_key(self, event: events.Key) -> None:
        """Take keys as letters of the filter while it is typed."""
        if self.typed.take(event):
            self._set_filter(words=self.typed.words)

    def _set_filter(self, **changes: object) -> None:
        """Change the filter and show the newest lines that fit; request older ones if few do."""
        old = self._filter
        values = {"words": old.words, "team": old.team, "least_rank": old.least_rank, **changes}
        self._filter = PlannerLogFilter(**values)  # type: ignore[arg-type]
        self._follows = True
        self.show_all()
        self._fill()

    def action_filter(self) -> None:
        """Begin to type the words of the filter."""
        self.typed.is_typing = True
        self.show_all()

    def action_next_team(self) -> None:
        """Show only the lines of the next team; after the last one those of all."""
        status = self.feed.status
        known = [team.name for team in status.teams] if status is not None else []
        gone = sorted({line.team for line in self.watch_log.lines}.difference(known))
        teams = ["", *known, *gone]
        at = teams.index(self._filter.team) if self._filter.team in teams else 0
        self._set_filter(team=teams[(at + 1) % len(teams)])

    def action_next_level(self) -> None:
        """Show only more severe lines; after the last step all of them."""
        self._set_filter(least_rank=(self._filter.least_rank + 1) % len(LEVEL_WORDS))

    def action_step(self, by: int) -> None:
        """Choose the line above or below; at the top older ones are requested, at the bottom new ones are followed."""
        chosen, rows = self.log_list.chosen, len(self.log_list.rows)
        if chosen + by <= 0 and by < 0:
            self._ask_older()
        self._follows = chosen + by >= rows - 1
        super().action_step(by)

    def on_row_picked(self, message: RowPicked) -> None:
        """Choose the line that was clicked, and stay there."""
        self._follows = False
        super().on_row_picked(message)

    def action_follow(self) -> None:
        """Show the newest lines, as they come."""
        self._follows = True
        self.run_worker(self.watch_log.newest(), group="newest", exit_on_error=False)
        self.show_all()

    def action_end(self, direction: int) -> None:
        """Choose the oldest line held (-1), or the newest one and follow (1)."""
        if direction > 0:
            self.action_follow()
        else:
            super().action_end(direction)

    def action_cancel(self) -> None:
        """End the filter, and forget the report of the last key."""
        self._report = ()
        self.typed.words = ""
        self._set_filter(words="", team="", least_rank=0)
