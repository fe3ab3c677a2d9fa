"""Carries out a line that was typed after `:`, step by step, as if each step were chosen by itself."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Protocol

from tui_gcs.actions.palette.entries import Entry
from tui_gcs.actions.palette.own_commands import (
    NOT_HERE,
    ORDER_BY_NAME,
    SCREEN_MODES,
    SELECT_STEP,
    CommandLineError,
    CommandStep,
    OwnCommands,
    entry_named,
)
from tui_gcs.console.parts import ShowNotice
from tui_gcs.feed.notices import Severity


class AskOrder(Protocol):
    """Asks the operator to confirm an order to the selected vehicles."""

    def __call__(self, order_id: str, *, values: str = "") -> None:
        """Open the dialog of the order, with values of its fields that were typed already."""


@dataclass(frozen=True)
class CommandLineParts:
    """What the steps of a line do."""

    entries: Callable[[], list[Entry]]
    """What can be done on the present screen, and why not, at the time of the call."""
    show: Callable[[str], Awaitable[object] | None]
    """Shows the screen of a mode; the result waits until it is there, None: it is not shown."""
    select: Callable[[str], str]
    """Selects vehicles by words; returns why not, or ""."""
    order: AskOrder
    run: Callable[[str], Awaitable[None]]
    """Runs the Textual action string of an entry."""
    notice: ShowNotice


class CommandLine:
    """Runs lines. A step that is refused ends its line: the steps behind it were meant for what it should have done."""

    def __init__(self, own: OwnCommands | None, parts: CommandLineParts) -> None:
        self._own = own or OwnCommands()
        self._parts = parts

    async def run(self, line: str) -> None:
        """Carry out all steps of a line; the operator is notified of the first that cannot be done."""
        try:
            steps = self._own.steps(line)
        except CommandLineError as error:
            self._parts.notice(f"{line}: nothing done: {error}", Severity.CAUTION)
            return
        for step in steps:
            if why := await self._do(step):
                what = "nothing done" if step is steps[0] else f"ended at {step.text!r}"
                self._parts.notice(f"{line}: {what}: {why}", Severity.CAUTION)
                return

    async def _do(self, step: CommandStep) -> str:
        """Carry out one step; return why it cannot be done, or ""."""
        entry = entry_named(step.name, self._parts.entries())
        if entry is None or entry.why_not:
            return entry.why_not if entry is not None else NOT_HERE
        if step.name == SELECT_STEP and step.arguments:
            return self._parts.select(step.arguments)
        if step.name in SCREEN_MODES:
            waiting = self._parts.show(SCREEN_MODES[step.name])
            if waiting is None:
                return "it is not shown"
            await waiting  # the next step is for that screen
        elif step.arguments:
            self._parts.order(ORDER_BY_NAME[step.name].id, values=step.arguments)
        else:
            await self._parts.run(entry.run)
        return ""
