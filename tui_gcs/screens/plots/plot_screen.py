"""Panes of curves over one span of time, and their keys; the points may come from a station or from a flight."""

import math
from pathlib import Path
from typing import ClassVar

from textual import events, on
from textual.binding import BindingType
from textual.containers import Vertical
from textual.screen import Screen

from tui_gcs.actions import ConsoleAction, bindings
from tui_gcs.actions.plot_actions import PLOT_ACTIONS
from tui_gcs.core.base.text import clean
from tui_gcs.feed.plots.plot_layout import MAX_PANES, WHOLE_FLIGHT, WINDOWS_S, PanePlan, PlotLayout, PlotViews
from tui_gcs.feed.plots.plot_source import PlotSource, first_s
from tui_gcs.feed.plots.plotted_values import PlotValue
from tui_gcs.screens.common.row_copies import copy_text
from tui_gcs.screens.plots.value_picker import ValuePicker
from tui_gcs.screens.plots.views_dialog import ViewsDialog
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.plots.plot_curve import Curve
from tui_gcs.widgets.plots.plot_pane import PaneContent, PlotPane

PAGES = 4
"""A live window moves on by a quarter at once: a picture that moves with every point is written anew every time."""
CURSOR_STEPS = 100
MIN_PANE_ROWS = 6
MIN_WINDOW_S = 1e-3
GROWTH = 1.25
"""The window of a whole flight grows by this factor at once."""
VIEWS_FILE = "plot-views.json"
EMPTY = "nothing is plotted here: / finds a value by its name, unit or message"


class PlotStateLine(LinesView):
    """One line: the window, whether the picture is frozen, and what became of the last key."""

    DEFAULT_CSS = "PlotStateLine { height: 1; }"
    _runs: tuple[Run, ...] = ()

    def show(self, *runs: Run) -> None:
        """Show these."""
        self._runs = runs
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        return [self._runs]


class PlotScreen(Screen[None]):
    """The panes; a subclass adds what stands above and below them."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = PLOT_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(PLOT_ACTIONS, "plots")
    AUTO_FOCUS = ""
    CSS = """
    PlotScreen { layout: vertical; }
    PlotScreen #panes { height: 1fr; }
    """

    def __init__(self, source: PlotSource, *, folder: Path | None = None, glyphs: GlyphSet = UNICODE) -> None:
        """Plot points of `source`; views are kept in `folder`."""
        super().__init__()
        self.source = source
        self.plan = PlotLayout()
        self.views = PlotViews(folder / VIEWS_FILE if folder is not None else None)
        self._glyphs = glyphs
        self._held: tuple[float, float] | None = None
        """The span that is shown while the picture is frozen."""
        self._cursor_s: float | None = None
        self._report: Run = ("", Ink.TEXT)
        self._is_large = False
        self._is_asking = False
        self.panes = [PlotPane(glyphs=glyphs) for _ in range(MAX_PANES)]
        self.state_line = PlotStateLine(glyphs=glyphs)
        self.name_bar = PromptBar("view")

    def plot_widgets(self) -> tuple[Vertical, PlotStateLine, PromptBar]:
        """Return the panes, the line below them and the question, for `compose`."""
        return Vertical(*self.panes, id="panes"), self.state_line, self.name_bar

    # ---------------------------------------------------------------- the picture

    @property
    def is_frozen(self) -> bool:
        """Whether the picture stays as it is."""
        return self._held is not None

    def span(self) -> tuple[float, float]:
        """Return the shown span of time."""
        if self._held is not None:
            return self._held
        now_s = self.source.now_s
        if not math.isfinite(now_s):
            return 0.0, WINDOWS_S[0]
        if self.plan.window == WHOLE_FLIGHT:
            return self._whole_flight(now_s)
        window_s = WINDOWS_S[self.plan.window]
        page_s = window_s / PAGES
        to_s = math.ceil(now_s / page_s) * page_s if self.source.is_live else now_s
        return to_s - window_s, to_s

    def _whole_flight(self, now_s: float) -> tuple[float, float]:
        begin_s = self.source.begin_s
        if not math.isfinite(begin_s):
            begin_s = first_s(self.source, self.plan.values)
        length_s = max(now_s - begin_s, MIN_WINDOW_S)
        if not self.source.is_live:
            return begin_s, begin_s + length_s
        grown_s = WINDOWS_S[0]
        while grown_s < length_s:
            grown_s *= GROWTH
        return begin_s, begin_s + grown_s

    @on(events.Resize)
    @on(events.ScreenResume)
    def show_all(self) -> None:
        """Draw all panes that are in view, and the line below them."""
        if not self.is_current or not self.is_attached:
            return
        from_s, to_s = self.span()
        shown = self._shown_panes()
        for at, widget in enumerate(self.panes):
            widget.display = at in shown
            if at in shown:
                self._show_pane(widget, at, from_s, to_s)
        self._show_state(len(shown))

    def _shown_panes(self) -> range:
        """Return the indexes of the panes that have room; the chosen one is among them."""
        count = len(self.plan.panes)
        room = max(1, (self.size.height - 5) // MIN_PANE_ROWS)
        if self._is_large or room == 1:
            return range(self.plan.chosen, self.plan.chosen + 1)
        first = max(0, min(self.plan.chosen - room + 1, count - room))
        return range(first, min(first + room, count))

    def _show_pane(self, widget: PlotPane, at: int, from_s: float, to_s: float) -> None:
        plan = self.plan.panes[at]
        curves = tuple(self._curve(plan, value, from_s, to_s) for value in plan.values)
        mark = self._glyphs.selected if at == self.plan.chosen else " "
        title = f"{mark}{at + 1}  {plan.title}" + (f"  {plan.unit}" if plan.unit else "")
        content = PaneContent(curves, plan.unit, from_s, to_s, self.source.time_words, self._cursor_s, EMPTY)
        widget.show(content, clean(title, max(20, self.size.width - 6)))

    def _curve(self, plan: PanePlan, value: PlotValue, from_s: float, to_s: float) -> Curve:
        times_s, values = self.source.points(value, from_s, to_s)
        return Curve(clean(plan.label(value), 60), times_s, values)

    def _show_state(self, shown: int) -> None:
        state = "FROZEN: z goes on" if self.is_frozen and self.source.is_live else self.source.kind_words
        cursor = f"   cursor {self.source.time_words(self._cursor_s)}: x hides it" if self._cursor_s is not None else ""
        hidden = len(self.plan.panes) - shown
        more = f"   {hidden} panes more: up, down" if hidden and not self._is_large else ""
        self.state_line.show(
            (f" window {self.plan.window_words}   ", Ink.TEXT),
            (state, Ink.CAUTION if state.startswith("FROZEN") else Ink.NORMAL),
            (f"{cursor}{more}   ", Ink.MUTED),
            self._report,
        )

    def say(self, text: str, ink: Ink = Ink.TEXT) -> None:
        """Report what became of a key."""
        self._report = (clean(text, 200), ink)
        self.show_all()

    def ask(self) -> None:
        """Ask for new points, one question at a time; not while another screen is shown."""
        if self.is_current and not self._is_asking:
            self._is_asking = True
            self.run_worker(self._ask(), group="ask", exit_on_error=False)

    async def _ask(self) -> None:
        try:
            await self.source.ask()
        finally:
            self._is_asking = False
        if not self.source.is_live:
            self.show_all()

    # ---------------------------------------------------------------- values, panes, views

    def show_layout(self, layout: PlotLayout) -> None:
        """Show another layout."""
        self.plan = layout
        self._follow()

    def _follow(self) -> None:
        self.source.follow(self.plan.values)
        self.show_all()

    def _toggle(self, values: tuple[PlotValue, ...]) -> str:
        words = self.plan.toggle(values)
        self._follow()
        return words

    def action_find(self) -> None:
        """Open the search for values."""
        picker = ValuePicker(
            self.source.names(), self.source.vehicles, self._toggle, lambda: self.plan.values, self._glyphs
        )
        self.app.push_screen(picker, lambda _: self.show_all())
        self.run_worker(self._read_names(picker), group="names", exclusive=True, exit_on_error=False)

    async def _read_names(self, picker: ValuePicker) -> None:
        picker.add_names(await self.source.more_names())

    def action_add_pane(self) -> None:
        """Add an empty pane."""
        if self.plan.add_pane():
            self.say("")
        else:
            self.say(f"{MAX_PANES} panes are all that fit: Del removes one", Ink.CAUTION)

    def action_remove_pane(self) -> None:
        """Remove the chosen pane."""
        self.plan.remove_pane()
        self._report = ("", Ink.TEXT)
        self._follow()

    def action_choose(self, by: int) -> None:
        """Choose another pane."""
        self.plan.choose(by)
        self.show_all()

    def action_enlarge(self) -> None:
        """Show the chosen pane alone, or all again."""
        self._is_large = not self._is_large
        self.show_all()

    def action_save_view(self) -> None:
        """Ask for the name of a view."""
        if self.plan.values:
            self.name_bar.ask("save this view as")
        else:
            self.say("there is nothing to save: / adds a value", Ink.CAUTION)

    @on(PromptBar.Answered, "#view")
    def _save_view(self, message: PromptBar.Answered) -> None:
        self.set_focus(None)
        if message.text is not None:
            self.say(self.views.save(message.text, self.plan))

    def action_load_view(self) -> None:
        """Open the list of views."""

        def chosen(name: str | None) -> None:
            layout = self.views.layout(name or "")
            if layout is not None:
                self._held = self._cursor_s = None
                self._report = (f"view {name}", Ink.TEXT)
                self.show_layout(layout)

        self.app.push_screen(ViewsDialog(self.views, self._glyphs), chosen)

    # ---------------------------------------------------------------- time

    def action_window(self, by: int) -> None:
        """Make the window shorter or longer; a frozen one keeps the cursor, or its end, in view."""
        self.plan.change_window(by)
        if self._held is not None and self.plan.window == WHOLE_FLIGHT:
            self._held = None
            self._held = self.span() if self.source.is_live else None
        elif self._held is not None or (not self.source.is_live and self._cursor_s is not None):
            window_s = WINDOWS_S[self.plan.window]
            to_s = self.span()[1] if self._cursor_s is None else self._cursor_s + window_s / 2
            self._held = (to_s - window_s, to_s)
        self.show_all()

    def action_freeze(self) -> None:
        """Stop the picture, or let it go on."""
        self._held = None if self._held is not None else self.span()
        self.say("")

    def action_newest(self) -> None:
        """Show the newest values again."""
        self._held = None
        self.show_all()

    def action_page(self, by: int) -> None:
        """Show what was half a window earlier or later."""
        from_s, to_s = self.span()
        half_s = (to_s - from_s) / 2 * by
        self._held = (from_s + half_s, to_s + half_s)
        self._keep_cursor()
        self.show_all()

    def action_cursor(self) -> None:
        """Show the cursor at the newest point, or hide it."""
        if self._cursor_s is None:
            self._cursor_s = min(self.source.now_s, self.span()[1]) if math.isfinite(self.source.now_s) else None
            self._keep_cursor()
        else:
            self._cursor_s = None
        self.show_all()

    def action_move(self, by: int) -> None:
        """Move the cursor, which freezes the picture: a cursor on a moving one points at nothing."""
        if self._cursor_s is None:
            self.action_cursor()
            return
        if self._held is None and self.source.is_live:
            self._held = self.span()
        from_s, to_s = self.span()
        self._cursor_s += by * (to_s - from_s) / CURSOR_STEPS
        self._keep_cursor()
        self.show_all()

    def _keep_cursor(self) -> None:
        if self._cursor_s is not None:
            from_s, to_s = self.span()
            self._cursor_s = min(max(self._cursor_s, from_s), to_s)

    def action_dots(self) -> None:
        """Draw in braille, blocks or letters."""
        for pane in self.panes:
            pane.next_dots()
        self.say(f"drawn in {self.panes[0].dots}")

    def action_copy(self) -> None:
        """Send what is shown to the terminal's clipboard."""
        parts = [f"{pane.border_title}\n{pane.text()}" for pane in self.panes if pane.display]
        self.say(*copy_text(self.app, f"{len(parts)} panes", "\n".join(parts)))

    def action_cancel(self) -> None:
        """Hide the cursor, and forget the report of the last key."""
        self._cursor_s = None
        self.say("")
