"""What cells and words stand for, and their colours: few, and each with a shape or a word beside it.

The alarm colours keep their meaning in 16-colour terminals (docs/terminal.md B8, D7): vehicles are coloured by alarm
level, and by team only where nothing is wrong with them; zones by role only.
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
    TOUR_1 = 5
    TOUR_2 = 6
    TOUR_3 = 7
    TOUR_4 = 8
    TOUR_5 = 9
    TOUR_6 = 10
    """Tours of the teams, in the order of their names."""
    TRAIL = 11
    NO_FLY = 12
    DEFEND = 13
    ATTACK = 14
    EDITED = 15
    PLACE = 16
    TEXT = 17
    TEAM_1 = 18
    TEAM_2 = 19
    TEAM_3 = 20
    TEAM_4 = 21
    TEAM_5 = 22
    TEAM_6 = 23
    """Vehicles of the teams that need no attention."""
    MUTED = 24
    NORMAL = 25
    ADVISORY = 26
    CAUTION = 27
    WARNING = 28
    ALARM = 29
    """A new warning on the alarm line, in reverse."""
    SELECTED = 30
    SELECTED_CAUTION = 31
    SELECTED_WARNING = 32
    BOLD = 33
    LIVE = 34
    REPLAY = 35
    TARGET = 36
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
TEAM_INKS = (Ink.TEAM_1, Ink.TEAM_2, Ink.TEAM_3, Ink.TEAM_4, Ink.TEAM_5, Ink.TEAM_6)
TOUR_INKS = (Ink.TOUR_1, Ink.TOUR_2, Ink.TOUR_3, Ink.TOUR_4, Ink.TOUR_5, Ink.TOUR_6)
STYLES |= {ink: Style(color=colour) for ink, colour in zip(TEAM_INKS, colours.TEAMS, strict=True)}
STYLES |= {ink: Style(color=colour) for ink, colour in zip(TOUR_INKS, colours.TOURS, strict=True)}
