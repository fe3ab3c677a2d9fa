"""The screen of tasks and people: layout, views and keys."""

from collections.abc import Callable, Hashable, Sequence
from typing import Any, ClassVar, TypeVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.screen import Screen

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.task_actions import TASK_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.people import HandOver, TakeControl
from tui_gcs.core.protocol.services import CancelTask, TaskInfo
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import StationBack, StationLost
from tui_gcs.feed.task_watch import TaskWatch
from tui_gcs.screens.common.sure_dialog import SureDialog
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowPicked, RowsView
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.tasks.task_lists import PeopleList, TaskList, TaskPanel

LOOK_S = 0.5
"""The station is asked this often while the screen is shown."""
R = TypeVar("R")


class TasksScreen(Screen[None]):
    """What goes on, and who is there."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = TASK_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(TASK_ACTIONS, "tasks")
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-wide")]
    AUTO_FOCUS = None
    CSS = """
    TasksScreen { layout: vertical; }
    TasksScreen.-people TaskList { display: none; }
    TasksScreen.-people PeopleList { display: block; }
    """

    def __init__(self, feed: Feed, clock: Clock, *, glyphs: GlyphSet = UNICODE) -> None:
        """Show tasks and principals of the station of `feed`."""
        super().__init__()
        self.feed = feed
        self._clock = clock
        self._glyphs = glyphs
        self._only_running = False
        self._is_looking = False
        self._report: tuple[Run, ...] = ()
        self.watch_tasks = TaskWatch(feed.requests, self.show_all)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.task_list = TaskList(glyphs=glyphs)
        self.people_list = PeopleList(glyphs=glyphs)
        self.task_list.principal = self.people_list.principal = feed.requests.principal
        self.panel = TaskPanel(glyphs=glyphs)

    def compose(self) -> ComposeResult:
        """Compose the top lines, the lists, the panel and the footer."""
        yield self.top_lines
        yield self.task_list
        yield self.people_list
        yield self.panel
        yield FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=self._glyphs, feed=self.feed, here="show_tasks")

    def on_mount(self) -> None:
        """Begin to receive the feed's messages, and to ask."""
        self.feed.listen(self)
        self.set_interval(LOOK_S, self.look)

    @on(events.ScreenResume)
    @on(StationBack)
    def look(self) -> None:
        """Ask the station; not while another screen is shown."""
        if self.is_current and not self._is_looking and not self.feed.station_lost:
            self._is_looking = True
            self.run_worker(self._look(), group="look", exit_on_error=False)

    async def _look(self) -> None:
        try:
            await self.watch_tasks.look()
        finally:
            self._is_looking = False

    @on(events.Resize)
    @on(StationLost)
    def show_all(self) -> None:
        """Show what is known; the same row stays chosen while others come and go."""
        if not self.is_current:
            return
        tasks = [task for task in self.watch_tasks.tasks if not (self._only_running and task.over)]
        self.task_list.empty_text = "nothing goes on" if self._only_running else "nothing was asked of a vehicle yet"
        show_kept(self.task_list, tasks, lambda task: task.number)
        show_kept(self.people_list, self.watch_tasks.people, lambda person: person.principal)
        running = sum(not task.over for task in self.watch_tasks.tasks)
        silent = "   STATION SILENT" if self.feed.station_lost else ""
        shown = "under way" if self._only_running else "all remembered"
        set_title(self.task_list, f"tasks  {running} under way   {shown}{silent}")
        set_title(self.people_list, f"people and programs  {len(self.people_list.rows)}{silent}")
        self.panel.show(self._list.chosen_row, self._report)

    @property
    def _list(self) -> RowsView[Any]:
        return self.people_list if self.has_class("-people") else self.task_list

    def on_row_picked(self, message: RowPicked) -> None:
        """Choose the row that was clicked."""
        message.view.show(message.view.rows, message.index)
        self.show_all()

    def _say(self, text: str, ink: Ink = Ink.TEXT) -> None:
        self._report = ((clean(text, 400), ink),)
        self.show_all()

    def _ask(self, title: str, reason: str, does: str, request: CancelTask | HandOver | TakeControl) -> None:
        """Ask whether a request is meant, and send it."""
        if why := self.feed.requests.read_only:
            self._say(why, Ink.CAUTION)
            return

        def answered(yes: bool | None) -> None:
            if yes:
                self.run_worker(self._send(request), group="send", exit_on_error=False)
            else:
                self._say("left as it is")

        self.app.push_screen(SureDialog(title, [reason], does, self._glyphs, self._clock), answered)

    async def _send(self, request: CancelTask | HandOver | TakeControl) -> None:
        reply = await self.feed.requests.send(request)
        self._say(reply.text if reply.ok else f"NOT DONE: {reply.text}", Ink.NORMAL if reply.ok else Ink.WARNING)
        self.look()

    # ---------------------------------------------------------------- keys

    def action_next_view(self) -> None:
        """Show the tasks, or who is connected."""
        self.toggle_class("-people")
        self.show_all()

    def action_only_running(self) -> None:
        """Show only tasks under way, or all that are remembered."""
        self._only_running = not self._only_running
        self.show_all()

    def action_end_task(self) -> None:
        """Ask whether the chosen task is to be cancelled."""
        task: TaskInfo | None = self.task_list.chosen_row if not self.has_class("-people") else None
        if task is None or task.over:
            self._say(
                "no task under way is chosen" if task is None else f"task {task.number} is {task.state}", Ink.CAUTION
            )
            return
        reason = f"vehicle {task.vehicle}: {task.what}, asked by {task.who}; what it has changed so far stays"
        self._ask(f"cancel task {task.number}", reason, "cancel it", CancelTask(task.number))

    def action_hand_over(self) -> None:
        """Ask whether control is to be handed to the chosen console."""
        person = self.people_list.chosen_row if self.has_class("-people") else None
        if person is None:
            self._say("choose a console first: Tab shows who is connected", Ink.CAUTION)
        elif person.principal == self.feed.requests.principal:
            self._say("that is this console: choose another one, or G takes control", Ink.CAUTION)
        else:
            reason = "the next command of any console takes control again"
            self._ask(f"hand control over to {person.principal}", reason, "hand over", HandOver(person.principal))

    def action_take_control(self) -> None:
        """Ask whether this console is to hold control."""
        status = self.feed.status
        holder = status.in_control if status is not None else ""
        if holder == self.feed.requests.principal:
            self._say("this console has control already")
            return
        self._ask("take control", f"{holder or 'nobody'} has control now", "take it", TakeControl())

    def action_cancel(self) -> None:
        """Forget the report of the last key."""
        self._report = ()
        self.show_all()

    def action_step(self, by: int) -> None:
        """Choose the row above or below."""
        self._list.step(by)
        self.show_all()

    def action_page(self, by: int) -> None:
        """Move by a page."""
        self.action_step(by * self._list.page)

    def action_end(self, direction: int) -> None:
        """Choose the first row (-1) or the last one (1)."""
        self.action_step(direction * len(self._list.rows))


def show_kept(view: RowsView[R], rows: Sequence[R], key: Callable[[R], Hashable]) -> None:
    """Show rows; the one with the same key as before stays chosen."""
    chosen = key(view.chosen_row) if view.chosen_row is not None else None
    at = next((at for at, row in enumerate(rows) if key(row) == chosen), view.chosen)
    view.show(rows, at)
