"""Colours and what they mean. Few, and each with a shape or a word beside it.

The alarm colours keep their meaning in 16-colour terminals (facts/terminal.md B8, D7): vehicles are coloured by alarm
level only, zones by role only.
"""

from enum import IntEnum

from rich.style import Style

WARNING = "#ff5050"
CAUTION = "#f0c040"
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


class Ink(IntEnum):
    """What a cell of the map or a word of a line stands for; its colour follows. Higher wins a shared cell."""

    BLANK = 0
    AREA = 1
    PLAN = 2
    TRAIL = 3
    NO_FLY = 4
    DEFEND = 5
    ATTACK = 6
    EDITED = 7
    PLACE = 8
    TEXT = 9
    MUTED = 10
    NORMAL = 11
    ADVISORY = 12
    CAUTION = 13
    WARNING = 14
    ALARM = 15
    """The alarm line: warning in reverse."""
    SELECTED = 16
    SELECTED_CAUTION = 17
    SELECTED_WARNING = 18
    BOLD = 19
    LIVE = 20
    REPLAY = 21
    TARGET = 22
    """What sensors have found."""


STYLES: dict[int, Style] = {
    Ink.BLANK: Style(),
    Ink.AREA: Style(color=MUTED),
    Ink.NO_FLY: Style(color=NO_FLY),
    Ink.DEFEND: Style(color=DEFEND),
    Ink.ATTACK: Style(color=ATTACK),
    Ink.PLAN: Style(color="#5c6a78"),
    Ink.TRAIL: Style(color="#7d8894"),
    Ink.EDITED: Style(color="#ffffff", bold=True),
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
    Ink.LIVE: Style(color="#ffffff", bold=True, reverse=True),
    Ink.REPLAY: Style(color=ADVISORY, bold=True, reverse=True),
    Ink.TARGET: Style(color=TARGET, bold=True),
}
