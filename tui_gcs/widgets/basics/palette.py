"""What cells and words stand for, and their colours: few, and each with a shape or a word beside it.

The alarm colours keep their meaning in 16-colour terminals (docs/terminal.md B8, D7): vehicles are coloured by alarm
level only, zones by role only.
"""

from enum import IntEnum

from rich.style import Style

from tui_gcs.terminal import themes as colours


class Ink(IntEnum):
    """What a cell of the map or a word of a line stands for; its colour follows. Higher wins a shared cell."""

    BLANK = 0
    GRID = 1
    AREA = 2
    OVERLAY = 3
    PLAN = 4
    TRAIL = 5
    NO_FLY = 6
    DEFEND = 7
    ATTACK = 8
    EDITED = 9
    PLACE = 10
    TEXT = 11
    MUTED = 12
    NORMAL = 13
    ADVISORY = 14
    CAUTION = 15
    WARNING = 16
    ALARM = 17
    """A new warning on the alarm line, in reverse."""
    SELECTED = 18
    SELECTED_CAUTION = 19
    SELECTED_WARNING = 20
    BOLD = 21
    LIVE = 22
    REPLAY = 23
    TARGET = 24
    """A target that sensors have found."""


STYLES: dict[int, Style] = {
    Ink.BLANK: Style(),
    Ink.GRID: Style(color=colours.GRID),
    Ink.AREA: Style(color=colours.MUTED),
    Ink.OVERLAY: Style(color=colours.ADVISORY),
    Ink.NO_FLY: Style(color=colours.NO_FLY),
    Ink.DEFEND: Style(color=colours.DEFEND),
    Ink.ATTACK: Style(color=colours.ATTACK),
    Ink.PLAN: Style(color=colours.PLAN),
    Ink.TRAIL: Style(color=colours.TRAIL),
    Ink.EDITED: Style(color=colours.WHITE, bold=True),
    Ink.PLACE: Style(color=colours.MUTED),
    Ink.TEXT: Style(color=colours.TEXT),
    Ink.MUTED: Style(color=colours.MUTED),
    Ink.NORMAL: Style(color=colours.NORMAL),
    Ink.ADVISORY: Style(color=colours.ADVISORY),
    Ink.CAUTION: Style(color=colours.CAUTION, bold=True),
    Ink.WARNING: Style(color=colours.WARNING, bold=True),
    Ink.ALARM: Style(color=colours.WARNING, bold=True, reverse=True),
    Ink.SELECTED: Style(color=colours.TEXT, bold=True, reverse=True),
    Ink.SELECTED_CAUTION: Style(color=colours.CAUTION, bold=True, reverse=True),
    Ink.SELECTED_WARNING: Style(color=colours.WARNING, bold=True, reverse=True),
    Ink.BOLD: Style(color=colours.TEXT, bold=True),
    Ink.LIVE: Style(color=colours.WHITE, bold=True, reverse=True),
    Ink.REPLAY: Style(color=colours.ADVISORY, bold=True, reverse=True),
    Ink.TARGET: Style(color=colours.TARGET, bold=True),
}
