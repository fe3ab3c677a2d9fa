"""The screen of tasks and people: layout, views and keys."""

from typing import Any, ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.task_actions import TASK_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.people import HandOver, TakeControl
from tui_gcs.core.protocol.services import CancelTask, TaskInfo
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import StationBack, StationLost
from tui_gcs.feed.task_watch import TaskWatch
from tui_gcs.screens.common.polled_screen import PolledScreen
from tui_gcs.screens.common.row_copies import below_report
from tui_gcs.screens.common.sure_dialog import SureDialog
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.tasks.task_lists import PeopleList, TaskList, TaskPanel

OF_TASKS = {"next_view": "people", "hand_over": "", "take_control": ""}
OF_PEOPLE = {"next_view": "tasks", "end_task": "", "only_running": ""}
"""Labels of the footer in each view."""


class TasksScreen(PolledScreen):
    """What goes on, and who is there."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = TASK_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(TASK_ACTIONS, "tasks")
    LOOK_S = 0.5
    CSS = """
    TasksScreen { layout: vertical; }
    TasksScreen.-people TaskList { display: none; }
    TasksScreen.-people PeopleList { display: block; }
    """

    def __init__(self, feed: Feed, clock: Clock, *, glyphs: GlyphSet = UNICODE) -> None:
        """Show tasks and principals of the station of `feed`."""
        super().__init__(feed)
        self._clock = clock
        self._glyphs = glyphs
        self._only_running = False
        self._report: tuple[Run, ...] = ()
        self.watch_tasks = TaskWatch(feed.requests, self.show_all)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.task_list = TaskList(glyphs=glyphs)
        self.people_list = PeopleList(glyphs=glyphs)
        self.task_list.principal = self.people_list.principal = feed.requests.principal
        self.panel = TaskPanel(glyphs=glyphs)
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed, here="show_tasks")

    def compose(self) -> ComposeResult:
        """Compose the top lines, the lists, the panel and the footer."""
        yield self.top_lines
        yield self.task_list
        yield self.people_list
        yield self.panel
        yield self.footer

    @on(events.ScreenResume)
    @on(StationBack)
    def look_again(self) -> None:
        """Look at once."""
        self.look()

    async def ask_station(self) -> None:
        """Ask for the tasks, and for the principals."""
        await self.watch_tasks.look()

    @on(events.Resize)
    @on(StationLost)
    def show_all(self) -> None:
        """Show what is known; the same row stays chosen while others come and go."""
        if not self.is_current:
            return
        tasks = [task for task in self.watch_tasks.tasks if not (self._only_running and task.over)]
        self.task_list.empty_text = "nothing goes on" if self._only_running else "nothing was asked of a vehicle yet"
        self.task_list.show_kept(tasks, lambda task: task.number)
        self.people_list.show_kept(self.watch_tasks.people, lambda person: person.principal)
        running = sum(not task.over for task in self.watch_tasks.tasks)
        silent = "   STATION SILENT" if self.feed.station_lost else ""
        shown = "under way" if self._only_running else "all remembered"
        set_title(self.task_list, f"tasks  {running} under way   {shown}   those for planners: S a{silent}")
        set_title(self.people_list, f"people and programs  {len(self.people_list.rows)}{silent}")
        self.footer.relabel(self._labels())
        self.panel.show(self.row_list.chosen_row, self._report)

    def _labels(self) -> dict[str, str]:
        """Return what keys are called: of people, only who has control hands it over, and only others take it."""
        if not self.has_class("-people"):
            return OF_TASKS
        status = self.feed.status
        has_control = status is not None and status.in_control == self.feed.requests.principal
        return OF_PEOPLE | ({"take_control": ""} if has_control else {"hand_over": "", "take_control": "take control"})

    def show_chosen(self) -> None:
        """Show the chosen row."""
        self.show_all()

    @property
    def row_list(self) -> RowsView[Any]:
        """The tasks, or the people."""
        return self.people_list if self.has_class("-people") else self.task_list

    def say_copied(self, text: str, ink: Ink) -> None:
        """See `ListScreen`."""
        self._report = below_report(self._report, text, ink)
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
            self._say("this is your console: choose with the arrows the one that is to have control", Ink.CAUTION)
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
