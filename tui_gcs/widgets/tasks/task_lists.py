"""The lists of the screen of tasks and people, and the panel of the chosen row."""

import math
from collections.abc import Sequence

from tui_gcs.core.protocol.people import PersonRow
from tui_gcs.core.protocol.services import TaskInfo
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import age_words
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import Run, cut, wrapped

WHAT_CELLS = 28
STATE_INKS = {"failed": Ink.CAUTION, "done": Ink.MUTED, "cancelled": Ink.MUTED}


class TaskList(RowsView[TaskInfo]):
    """A line for each task."""

    DEFAULT_CSS = framed("TaskList", "width: 1fr; height: 1fr;")

    principal = ""
    """Whose tasks are called `you`."""

    def header(self, width: int) -> Line:
        """Return the column titles."""
        return [(f"  {'NO':>4} {'VEH':>4} {'STATE':<9} {'DONE':>5} {'AGE':>5} {'WHAT':<{WHAT_CELLS}} WHO", Ink.MUTED)]

    def row_line(self, row: TaskInfo, width: int, *, is_chosen: bool) -> Line:
        """Return a task as a line; one that failed or waits for the operator has a mark."""
        who = "you" if row.who == self.principal else row.who
        mark = "!" if row.state == "failed" or row.waits else " "
        state = "waits" if row.waits and not row.over else row.state
        text = (
            f" {mark}{row.number:>4} {row.vehicle:>4} {state:<9} {done_words(row):>5} {age_words(row.age_s):>5}"
            f" {cut(row.what, WHAT_CELLS)} {who}"
        )
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED_CAUTION if mark == "!" else Ink.SELECTED)]
        return [(text, STATE_INKS.get(row.state, Ink.TEXT))]


class PeopleList(RowsView[PersonRow]):
    """A line for each console, planner worker and script."""

    DEFAULT_CSS = framed("PeopleList", "width: 1fr; height: 1fr; display: none;")

    principal = ""
    """Which row is this console."""

    def header(self, width: int) -> Line:
        """Return the column titles."""
        return [(f"  {'WHO':<28} {'CONNECTED':>9} {'CONTROL':<8} LAST COMMAND", Ink.MUTED)]

    def row_line(self, row: PersonRow, width: int, *, is_chosen: bool) -> Line:
        """Return a principal as a line; the holder of control has a mark."""
        name = f"{row.principal} (you)" if row.principal == self.principal else row.principal
        here = age_words(row.present_s) or "now" if row.is_present else "no"
        age = age_words(row.last_command_age_s) or "0"
        ago = "" if math.isnan(row.last_command_age_s) else f"   {age}{'s' if age.isdecimal() else ''} ago"
        control = "holds it" if row.is_in_control else ""
        text = f" {'*' if row.is_in_control else ' '}{cut(name, 28)} {here:>9} {control:<8} {row.last_command}{ago}"
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED)]
        return [(text, Ink.BOLD if row.is_in_control else Ink.TEXT if row.is_present else Ink.MUTED)]


class TaskPanel(LinesView):
    """The chosen row whole, and what became of the last key."""

    DEFAULT_CSS = framed("TaskPanel", "height: 7;")

    _row: TaskInfo | PersonRow | None = None
    _outcome: Sequence[Run] = ()

    def show(self, row: TaskInfo | PersonRow | None, outcome: Sequence[Run]) -> None:
        """Show this row, and the lines of the last key."""
        self._row, self._outcome = row, outcome
        title = f"task {row.number}" if isinstance(row, TaskInfo) else row.principal if row is not None else "nothing"
        set_title(self, title)
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        outcome: list[Line] = [[(part, ink)] for text, ink in self._outcome for part in wrapped(text, width)]
        row = self._row
        texts = task_texts(row) if isinstance(row, TaskInfo) else person_texts(row) if row is not None else []
        body: list[Line] = [[(part, ink)] for text, ink in texts for part in wrapped(text, width)]
        return [*body[: max(0, height - len(outcome))], *outcome]


def task_texts(task: TaskInfo) -> list[Run]:
    """Return what a task does, what it needs, how it stands, and the newest text of its vehicle."""
    texts: list[Run] = [(f"vehicle {task.vehicle}: {task.what}, asked by {task.who}", Ink.BOLD)]
    if task.prompt:
        texts.append((task.prompt, Ink.CAUTION))
    if task.text:
        texts.append((task.text, Ink.CAUTION if task.state == "failed" else Ink.TEXT))
    return texts + [(f"the vehicle: {note}", Ink.MUTED) for note in task.notes[-2:]]


def person_texts(person: PersonRow) -> list[Run]:
    """Return what a principal may do, and what holding control means."""
    texts: list[Run] = []
    if person.principal.startswith("planner-"):
        texts.append(("a planner worker: it plans for its team and may not command", Ink.TEXT))
    if not person.is_present:
        texts.append(("not connected now: a command of a shell, or a console that has left", Ink.TEXT))
    if person.is_in_control:
        texts.append(("has control; the next command of another console takes it", Ink.BOLD))
    elif not texts:
        texts.append(("has no control; its first command takes it, or who has it hands it over", Ink.TEXT))
    return texts


def done_words(task: TaskInfo) -> str:
    """Return the progress in percent; "" where it is not known."""
    return f"{100 * task.done // task.total}%" if task.total else ""
