"""A field for one of a few options, chosen with left and right."""

from collections.abc import Sequence

from rich.cells import cell_len
from textual import events
from textual.binding import Binding
from textual.message import Message

from tui_gcs.terminal.variant import run_own_binding
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.forms.field_order import FIELD_BINDINGS, step_field


class ChoiceField(LinesView, can_focus=True):
    """Shows all options where there is room, else the chosen one between arrows."""

    DEFAULT_CSS = """
    ChoiceField { height: 1; width: 1fr; background: $surface; }
    """
    BINDINGS = [
        Binding("left", "step(-1)", "previous", show=False),
        Binding("right", "step(1)", "next", show=False),
        *FIELD_BINDINGS,
    ]

    class Changed(Message):
        """The operator chose another option."""

        def __init__(self, choice: "ChoiceField", value: str) -> None:
            super().__init__()
            self.choice = choice
            self.value = value

        @property
        def control(self) -> "ChoiceField":
            """The widget, for the selector of `on`."""
            return self.choice

    def __init__(self, field: str, options: Sequence[str] = (), *, glyphs: GlyphSet = UNICODE) -> None:
        """`field` names what is chosen."""
        self._options: tuple[str, ...] = tuple(options)
        self._value = self._options[0] if self._options else ""
        super().__init__(glyphs=glyphs)
        self.field = field

    @property
    def value(self) -> str:
        """The option that is chosen now."""
        return self._value

    @property
    def index(self) -> int:
        """Index of the chosen option."""
        return self._options.index(self._value)

    def show(self, value: str, options: Sequence[str] | None = None) -> None:
        """Show a value without posting a change. A value that is no option is shown as an additional one."""
        known = self._options if options is None else tuple(options)
        self._options = known if value in known else (*known, value)
        self._value = value
        self.update_lines()

    def action_step(self, by: int) -> None:
        """Choose the option `by` places further; the list has no end."""
        if len(self._options) > 1:
            index = self._options.index(self._value) + by
            self._value = self._options[index % len(self._options)]
            self.update_lines()
            self.post_message(self.Changed(self, self._value))

    def action_step_field(self, by: int) -> None:
        """Go to the next field (1), or to the one before (-1)."""
        step_field(self, by)

    async def _on_key(self, event: events.Key) -> None:
        await run_own_binding(self, event)

    def on_click(self, event: events.Click) -> None:
        """Choose the option under the pointer; if only one is shown, the next one."""
        for start, end, option in self._places():
            if start <= event.x < end and option != self._value:
                self.action_step(self._options.index(option) - self._options.index(self._value))
                return
        if not self._fits(self.size.width):
            self.action_step(1)

    def watch_has_focus(self, has_focus: bool) -> None:
        """Draw the chosen option as focused, or not."""
        super().watch_has_focus(has_focus)
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """Return all options, or the chosen one where there is no room for all."""
        chosen = Ink.SELECTED if self.has_focus else Ink.BOLD
        if self._fits(width):
            runs: list[Run] = []
            for option in self._options:
                mark = f"({self.glyphs.bullet if option == self._value else ' '})"
                runs += [(f"{mark} {option}", chosen if option == self._value else Ink.MUTED), (" ", Ink.TEXT)]
            return [runs]
        many = len(self._options) > 1
        return [[("< " if many else "", Ink.MUTED), (self._value, chosen), (" >" if many else "", Ink.MUTED)]]

    def _fits(self, width: int) -> bool:
        return sum(cell_len(option) + 5 for option in self._options) - 1 <= width

    def _places(self) -> list[tuple[int, int, str]]:
        if not self._fits(self.size.width):
            return []
        places, start = [], 0
        for option in self._options:
            end = start + cell_len(option) + 4
            places.append((start, end, option))
            start = end + 1
        return places
