"""The menu of all screens: `S`, then one letter."""

from textual import events

from tui_gcs.actions import APP_ACTIONS, ConsoleAction
from tui_gcs.screens.common.text_dialog import TextDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink

PREFIX = "S "
"""How the shown key of a screen begins that has no key of its own."""


class ScreensMenu(TextDialog[str]):
    """Lists the screens that have no key of their own; the letter of one opens it. The result is its action."""

    title_text = "screens"

    def __init__(self, glyphs: GlyphSet) -> None:
        super().__init__(glyphs)
        self._choices: dict[str, ConsoleAction] = {
            action.shown.removeprefix(PREFIX): action for action in APP_ACTIONS if action.shown.startswith(PREFIX)
        }

    def on_key(self, event: events.Key) -> None:
        """Choose by letter, leave by Esc."""
        event.stop()
        if event.key == "escape":
            self.finish("")
        elif (choice := self._choices.get(event.character or "")) is not None:
            self.finish(choice.call)

    def body(self) -> list[Line]:
        """Return a line for each screen, and the keys."""
        rows: list[Line] = [
            [(f" {letter} ", Ink.SELECTED), (f"  {action.help}", Ink.TEXT)] for letter, action in self._choices.items()
        ]
        return [
            *rows,
            [],
            [(" Esc = close ", Ink.SELECTED), ("   without S: f Fly  p Plan  v Vehicles  J Journal", Ink.MUTED)],
        ]
