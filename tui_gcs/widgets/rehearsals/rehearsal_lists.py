"""The lists of the rehearsals screen, and the panel of the chosen rehearsal."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tui_gcs.core.base.text import clean
from tui_gcs.core.records.flight_archive import utc_time
from tui_gcs.core.records.rehearsal_files import GateResult, ScenarioChange
from tui_gcs.core.records.rehearsal_store import RehearsalRecord
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import UNKNOWN
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import Run, cut, wrapped

NAME_CELLS = 46
MAX_CELLS = 300


@dataclass(frozen=True)
class RehearsalRow:
    """A rehearsal, beside what the station would fly now."""

    record: RehearsalRecord
    is_present: bool
    """Exactly the plan that the station has now was rehearsed."""


@dataclass(frozen=True)
class RehearsalDetail:
    """What is known of the chosen rehearsal from its folder."""

    gates: tuple[GateResult, ...] = ()
    changes: tuple[ScenarioChange, ...] | None = None
    """None: not known, because the scenario of then was not kept or none is loaded now."""


class RehearsalList(RowsView[RehearsalRow]):
    """A line for each rehearsal; one that failed has a mark."""

    DEFAULT_CSS = framed("RehearsalList", "width: 1fr; height: 1fr;")

    def header(self, width: int) -> Line:
        """Return the column titles."""
        return [(f"  {'WHEN (UTC)':<16} {'RESULT':<13} {'PLAN NOW':<9} {'BY':<9} SCENARIO, CONDITIONS", Ink.MUTED)]

    def row_line(self, row: RehearsalRow, width: int, *, is_chosen: bool) -> Line:
        """Return a rehearsal as a line."""
        record = row.record
        mark = " " if record.passed else "!"
        rest = "   ".join(clean(part, 120) for part in (record.scenario, record.autopilots, record.conditions) if part)
        text = (
            f" {mark}{utc_time(record.wall_s):<16} {result_words(record):<13}"
            f" {'the same' if row.is_present else 'differs':<9} {cut(clean(record.by, 40), 9):<9} {rest}"
        )
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED if record.passed else Ink.SELECTED_CAUTION)]
        return [(cut(text, width), Ink.TEXT if record.passed else Ink.CAUTION)]


class GateList(RowsView[GateResult]):
    """A line for each gate of a rehearsal, the failed ones first."""

    DEFAULT_CSS = framed("GateList", "width: 1fr; height: 1fr; display: none;")

    def header(self, width: int) -> Line:
        """Return the column titles."""
        return [(f"  {'GATE':<{NAME_CELLS}} {'VALUE':>10} {'LIMIT':>10}", Ink.MUTED)]

    def row_line(self, row: GateResult, width: int, *, is_chosen: bool) -> Line:
        """Return a gate as a line."""
        name = cut(clean(row.name, 120), NAME_CELLS)
        text = f" {' ' if row.ok else '!'}{name:<{NAME_CELLS}} {_number(row.value):>10} {_number(row.limit):>10}"
        text += "" if row.ok else "  FAIL"
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED if row.ok else Ink.SELECTED_CAUTION)]
        return [(cut(text, width), Ink.TEXT if row.ok else Ink.CAUTION)]


class ChangeList(RowsView[ScenarioChange]):
    """A line for each line of the scenario that differs from the rehearsed one."""

    DEFAULT_CSS = framed("ChangeList", "width: 1fr; height: 1fr; display: none;")

    def header(self, width: int) -> Line:
        """Return the column titles."""
        return [("   LINE   ~ changed   + added   - removed since the rehearsal", Ink.MUTED)]

    def row_line(self, row: ScenarioChange, width: int, *, is_chosen: bool) -> Line:
        """Return a change as a line."""
        return [(cut(f"  {row.line:>5} {row.sign} {row.text}", width), Ink.SELECTED if is_chosen else Ink.TEXT)]


class RehearsalPanel(LinesView):
    """The chosen rehearsal in words, and what became of the last key."""

    DEFAULT_CSS = framed("RehearsalPanel", "height: 9;")

    _texts: Sequence[Run] = ()

    def show(self, title: str, texts: Sequence[Run]) -> None:
        """Show these lines."""
        self._texts = texts
        set_title(self, title)
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        found: list[Line] = [[(part, ink)] for text, ink in self._texts for part in wrapped(text, width)]
        return found[:height]


def rehearsal_texts(row: RehearsalRow, detail: RehearsalDetail) -> list[Run]:
    """Return the result of a rehearsal, what failed, what was changed since, and where its report is."""
    record = row.record
    texts: list[Run] = [(_result_line(record), Ink.BOLD if record.passed else Ink.CAUTION)]
    failed = [gate for gate in detail.gates if not gate.ok]
    if failed:
        names = "; ".join(clean(gate.name, 60) for gate in failed[:3])
        more = f" and {len(failed) - 3} more" if len(failed) > 3 else ""
        texts.append((f"failed: {names}{more}", Ink.CAUTION))
    texts.append((change_words(row, detail), Ink.TEXT if row.is_present else Ink.CAUTION))
    report = clean(record.report, MAX_CELLS) or "none was written: tui-gcs rehearse --report writes one"
    texts.append((f"report: {report}", Ink.TEXT))
    return texts


def gate_texts(gate: GateResult) -> list[Run]:
    """Return a gate with the reason for its result."""
    ink = Ink.TEXT if gate.ok else Ink.CAUTION
    texts: list[Run] = [(clean(gate.name, MAX_CELLS), Ink.BOLD)]
    texts.append((f"{'holds' if gate.ok else 'FAILED'}: {_number(gate.value)}, limit {_number(gate.limit)}", ink))
    return [*texts, (clean(gate.why, MAX_CELLS), ink)] if gate.why else texts


def change_words(row: RehearsalRow, detail: RehearsalDetail) -> str:
    """Return what was changed since a rehearsal, in one line."""
    if row.is_present:
        return "since then: nothing; exactly this plan would fly"
    if detail.changes is None:
        return "since then: the plan differs; the scenario of then was not kept, so not in what"
    if not detail.changes:
        return "since then: the same text; the code of a planner or of tui-gcs, or the kind of planner differs"
    count = len(detail.changes)
    return f"since then: {count} line{'s' * (count > 1)} of the scenario differ{'s' * (count == 1)}; d shows them"


def result_words(record: RehearsalRecord) -> str:
    """Return the result in 13 cells."""
    return f"{'passed' if record.passed else 'FAILED'} {record.checks_good}/{record.checks}"


def _result_line(record: RehearsalRecord) -> str:
    result = f"{'passed' if record.passed else 'FAILED'}: {record.checks_good} of {record.checks} gates hold"
    conditions = clean(record.conditions, MAX_CELLS)
    problem = clean(record.problem, MAX_CELLS)
    # With its time: above it the panel may speak of another one, which is under way or was cancelled.
    when = f"{utc_time(record.wall_s)} UTC"
    return "   ".join(filter(None, (when, result, conditions, problem and f"ended early: {problem}")))


def _number(value: float | None) -> str:
    return UNKNOWN if value is None or not math.isfinite(value) else f"{value:.2f}"
