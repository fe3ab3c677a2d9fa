"""Colours and what they mean. Few, and each with a shape or a word beside it.

The alarm colours keep their meaning in 16-colour terminals (facts/terminal.md B8, D7): vehicles are coloured by alarm
level only, zones by role only.
"""

from enum import IntEnum

from rich.style import Style

WARNING = "#ff5050"
CAUTION = "#f0c840"
ADVISORY = "#56b4e9"
NORMAL = "#4ebf71"
MUTED = "#909090"
TEXT = "#d8dee4"
BACKGROUND = "#101418"
PANEL_EDGE = "#4a5560"
DEFEND = "#6ea8ff"
ATTACK = "#e07078"
NO_FLY = "#c08040"
TARGET = "#e080ff"
PLAN = "#5c6a78"
TRAIL = "#7d8894"
GRID = "#2c343c"
WHITE = "#ffffff"


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
    """The alarm line: warning in reverse."""
    SELECTED = 18
    SELECTED_CAUTION = 19
    SELECTED_WARNING = 20
    BOLD = 21
    LIVE = 22
    REPLAY = 23
    TARGET = 24
    """What sensors have found."""


STYLES: dict[int, Style] = {
    Ink.BLANK: Style(),
    Ink.GRID: Style(color=GRID),
    Ink.AREA: Style(color=MUTED),
    Ink.OVERLAY: Style(color=ADVISORY),
    Ink.NO_FLY: Style(color=NO_FLY),
    Ink.DEFEND: Style(color=DEFEND),
    Ink.ATTACK: Style(color=ATTACK),
    Ink.PLAN: Style(color=PLAN),
    Ink.TRAIL: Style(color=TRAIL),
    Ink.EDITED: Style(color=WHITE, bold=True),
    Ink.PLACE: Style(color=MUTED),
    Ink.TEXT: Style(color=TEXT),
    Ink.MUTED: Style(color=MUTED),
    Ink.NORMAL: Style(color=NORMAL),
    Ink.ADVISORY: Style(color=ADVISORY),
    Ink.CAUTION: Style(color=CAUTION, bold=True),
    Ink.WARNING: Style(color=WARNING, bold=True),
    Ink.ALARM: Style(color=WARNING, bold=True, reverse=True),
    Ink.SELECTED: Style(color=TEXT, bold=True, reverse=True),
    Ink.SELECTED_CAUTION: Style(color=CAUTION, bold=True, reverse=True),
    Ink.SELECTED_WARNING: Style(color=WARNING, bold=True, reverse=True),
    Ink.BOLD: Style(color=TEXT, bold=True),
    Ink.LIVE: Style(color=WHITE, bold=True, reverse=True),
    Ink.REPLAY: Style(color=ADVISORY, bold=True, reverse=True),
    Ink.TARGET: Style(color=TARGET, bold=True),
}
