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
    CONTOUR = 1
    BUILDING = 2
    ROAD = 3
    WATER = 4
    """Lines of the base map, under everything else."""
    GRID = 5
    AREA = 6
    OVERLAY = 7
    PLAN = 8
    TOUR_1 = 9
    TOUR_2 = 10
    TOUR_3 = 11
    TOUR_4 = 12
    TOUR_5 = 13
    TOUR_6 = 14
    """Tours of the teams, in the order of their names."""
    TRAIL = 15
    NO_FLY = 16
    DEFEND = 17
    ATTACK = 18
    EDITED = 19
    PLACE = 20
    TEXT = 21
    TEAM_1 = 22
    TEAM_2 = 23
    TEAM_3 = 24
    TEAM_4 = 25
    TEAM_5 = 26
    TEAM_6 = 27
    """Vehicles of the teams that need no attention."""
    MUTED = 28
    NORMAL = 29
    ADVISORY = 30
    CAUTION = 31
    WARNING = 32
    ALARM = 33
    """A new warning on the alarm line, in reverse."""
    SELECTED = 34
    SELECTED_CAUTION = 35
    SELECTED_WARNING = 36
    BOLD = 37
    LIVE = 38
    REPLAY = 39
    TARGET = 40
    """A target that sensors have found."""


STYLES: dict[int, Style] = {
    Ink.BLANK: Style(),
    Ink.CONTOUR: Style(color=colours.GROUND),
    Ink.BUILDING: Style(color=colours.GROUND),
    Ink.ROAD: Style(color=colours.GROUND),
    Ink.WATER: Style(color=colours.WATER),
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
