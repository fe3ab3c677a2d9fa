"""The console's app on stock Textual: its own themes, and nothing that needs private parts (`--plain`)."""

import contextlib
import os
from collections.abc import Sequence

from rich.color import Color as RichColor
from rich.segment import Segment
from rich.style import Style
from textual.app import App, ScreenStackError
from textual.color import Color
from textual.filter import LineFilter

from tui_gcs.terminal.themes import DARK, THEMES, Theme


class ThemeFilter(LineFilter):
    """Changes the palette's colours to those of a theme, line by line."""

    def __init__(self, theme: Theme) -> None:
        """Filter for one theme."""
        super().__init__()
        self._theme = theme
        self._styles: dict[Style, Style] = {}

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """See `LineFilter`."""
        return [
            Segment(text, self._themed(style) if style is not None else None, control)
            for text, style, control in segments
        ]

    def _themed(self, style: Style) -> Style:
        found = self._styles.get(style)
        if found is None:
            colours = Style.from_color(*(self._colour(colour) for colour in (style.color, style.bgcolor)))
            found = self._styles[style] = style + colours
        return found

    def _colour(self, colour: RichColor | None) -> RichColor | None:
        if colour is None or colour.triplet is None:
            return colour
        return RichColor.parse(self._theme.colour(colour.triplet.hex))


class PlainApp(App[None]):
    """Textual's app with themes of our own; the base of the console's app in both variants."""

    def __init__(self) -> None:
        """See `App`. `NO_COLOR` is read from the environment."""
        # Textual takes an empty NO_COLOR for "no colours"; no-color.org does not.
        if not os.environ.get("NO_COLOR"):
            os.environ.pop("NO_COLOR", None)
        # Without colour only Textual's ANSI mode leaves bold and reverse alone (docs/terminal.md B8).
        super().__init__(ansi_color=True if "NO_COLOR" in os.environ else None)
        self.colours = DARK

    def get_line_filters(self) -> Sequence[LineFilter]:
        """See `App`; the theme's filter comes before those that fit colours to the terminal."""
        usual = super().get_line_filters()
        return usual if self.colours is DARK else [ThemeFilter(self.colours), *usual]

    @property
    def is_lagging(self) -> bool:
        """Whether the terminal is known not to keep up."""
        return False

    @property
    def display_theme(self) -> str:
        """Name of the theme in which everything is drawn; set it to one of `THEMES`."""
        return self.colours.name

    @display_theme.setter
    def display_theme(self, name: str) -> None:
        self.colours = THEMES[name]
        self.redraw()

    def action_next_theme(self) -> None:
        """Change to the next theme."""
        names = list(THEMES)
        self.display_theme = names[(names.index(self.display_theme) + 1) % len(names)]

    def action_redraw(self) -> None:
        """Write every cell again, when another program has written on the screen."""
        self.redraw()

    def redraw(self) -> None:
        """Write every cell again, whatever the terminal shows now."""
        with contextlib.suppress(ScreenStackError):
            for widget in self.screen.walk_children():
                widget.refresh()  # each keeps lines that were filtered for the theme before
        self.refresh_screen()

    def refresh_screen(self) -> None:
        """Have Textual render the whole screen again."""
        with contextlib.suppress(ScreenStackError):  # the app is closing, or has not begun
            self.screen.refresh()
