"""The panel of the setup screen: prompts of what is under way, the report of the last key, what a section lacks."""

from collections.abc import Sequence

from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.services import TaskInfo
from tui_gcs.feed.setup_watch import ATTENTION, UNKNOWN, FleetSetupField, SectionSummary
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, wrapped
from tui_gcs.widgets.setup.setup_lists import field_words

MAX_NOTES = 2
UNKNOWN_NOT_FROM_READING = "motors"
"""The section that is unknown until its motors were tested, whatever is read."""


class SetupPanel(LinesView):
    """Prompts of what is under way, the report of the last key, the section and its chosen line."""

    DEFAULT_CSS = framed("SetupPanel", "height: 9;") + "SetupPanel.-guided { height: 15; }"

    _runs: Sequence[Run] = ()
    _report: Sequence[Run] = ()

    def show(
        self,
        tasks: Sequence[TaskInfo],
        lead: int | None,
        section: SectionSummary | None,
        field: FleetSetupField | None,
        report: Sequence[Run],
    ) -> None:
        """Show what is under way, with the readings of the vehicle `lead`, then the report, then the section."""
        guidance = task_runs(tasks, lead)
        # A transmitter has a line for each channel.
        self.set_class(any(task.lines for task in tasks), "-guided")
        # What is to be done before a line is changed is in the prompts of what is under way, as far as it still holds.
        chosen = field_runs(field, with_notes=not guidance) if field else ()
        self._runs = (*guidance, *(section_runs(section) if section else ()), *chosen)
        self._report = report
        set_title(self, f"under way: {len(tasks)}" if tasks else "setup")
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`; the report is never cut off by what stands above it."""
        report: list[Line] = [[(part, ink)] for text, ink in self._report for part in wrapped(text, width)]
        body: list[Line] = [[(part, ink)] for text, ink in self._runs for part in _parts(text, width)]
        return [*body[: max(0, height - len(report))], *report[:height]]


def _parts(text: str, width: int) -> list[str]:
    # Readings are columns, which wrapping would close up.
    return [text] if len(text) <= width else wrapped(text, width)


def task_runs(tasks: Sequence[TaskInfo], lead: int | None) -> list[Run]:
    """Return the prompts, equal ones with all their vehicles, and the readings of one vehicle."""
    prompts: dict[tuple[str, str, bool], list[TaskInfo]] = {}
    for task in tasks:
        prompts.setdefault((task.what, task.prompt or task.text, task.waits), []).append(task)
    runs: list[Run] = []
    for (what, prompt, waits), same in prompts.items():
        vehicles = vehicles_words([task.vehicle for task in same])
        shares = [100 * task.done // task.total for task in same if task.total]
        done = f" {min(shares)} %" if shares else ""
        key = "   d = it is done" if waits else ""
        runs.append((f"{what}{done}, {vehicles}: {prompt or 'under way'}{key}", Ink.CAUTION if waits else Ink.BOLD))
    led = next((task for task in tasks if task.vehicle == lead), tasks[0] if tasks else None)
    if led is not None:
        runs += [(line, Ink.TEXT) for line in led.lines]
        runs += [(f"vehicle {led.vehicle} says: {note}", Ink.MUTED) for note in led.notes[-MAX_NOTES:]]
    return runs


def section_runs(section: SectionSummary) -> list[Run]:
    """Return what the section is or lacks; vehicles of which the same holds stand together."""
    return [
        (
            f"{state}: {text}   ({vehicles_words(vehicles)}){_what_to_do(section, state)}",
            Ink.CAUTION if state == ATTENTION else Ink.TEXT,
        )
        for state, text, vehicles in section.texts
    ]


def _what_to_do(section: SectionSummary, state: str) -> str:
    return "   R reads it" if state == UNKNOWN and section.section != UNKNOWN_NOT_FROM_READING else ""


def field_runs(field: FleetSetupField, *, with_notes: bool = True) -> list[Run]:
    """Return the chosen line whole, its parameter, and, with the notes, what is to be done before it is changed."""
    runs: list[Run] = [(f"{field.row.label}: {field_words(field)}", Ink.TEXT)]
    notes = field.prompts if with_notes else ()
    runs += [(f"note: {prompt}   ({vehicles_words(vehicles)})", Ink.TEXT) for prompt, vehicles in notes]
    if field.row.param:
        runs.append((f"parameter {field.row.param}", Ink.MUTED))
    return runs
