"""Themes, and what the palette becomes with 16 colours: tables from the palette's colours to others.

They are applied where cells are written (`cell_painter`), so that every panel, border and dialog follows and no widget
knows of them. Shapes and words carry every meaning without colour; colours only repeat it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

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
WATER = "#2f5f9f"
GROUND = "#5c5040"
"""Lines of the base map: water, and all that is on land."""
WHITE = "#ffffff"
TEAMS = ("#4fd0c0", "#b8a0ff", "#a0d468", "#e8a0d8", "#8cc8ff", "#d8c8a0")
"""Vehicles of the first, second … team that need no attention. None is near a colour of alarms."""
TOURS = ("#2f7d73", "#6e6099", "#607f3e", "#8b6082", "#547899", "#827860")
"""The tours of these teams, darker."""


@dataclass(frozen=True)
class Theme:
    """Colours by the name of what the palette has in their place, and a rule for those in between."""

    name: str
    colours: Mapping[str, str] = field(default_factory=dict)
    other: Literal["as it is", "inverted", "red"] = "as it is"
    """Fields of forms, and what a dialog shines through."""

    def colour(self, name: str) -> str:
        """What this theme has for a colour, both as `#rrggbb`."""
        if name in self.colours or self.other == "as it is":
            return self.colours.get(name, name)
        red, green, blue = (int(name[at : at + 2], 16) for at in (1, 3, 5))
        if self.other == "inverted":
            return f"#{255 - red:02x}{255 - green:02x}{255 - blue:02x}"
        light = round(0.3 * red + 0.59 * green + 0.11 * blue)
        return f"#{light:02x}{light // 5:02x}{light // 7:02x}"


DARK = Theme("dark")
NIGHT = Theme(
    "night",
    {
        # Red light leaves eyes that are used to the dark as they are: brightness and marks tell levels apart.
        # These are reds that the 256 colours have, too.
        BACKGROUND: "#000000",
        TEXT: "#d70000",
        MUTED: "#af0000",
        PANEL_EDGE: "#5f0000",
        WHITE: "#ff5f5f",
        WARNING: "#ff5f5f",
        CAUTION: "#ff0000",
        ADVISORY: "#d70000",
        NORMAL: "#d70000",
        DEFEND: "#d70000",
        ATTACK: "#ff0000",
        NO_FLY: "#af0000",
        TARGET: "#ff5f5f",
        PLAN: "#5f0000",
        TRAIL: "#870000",
        GRID: "#3a0000",
        WATER: "#5f0000",
        GROUND: "#3a0000",
    }
    | dict.fromkeys(TEAMS, "#d70000")
    | dict.fromkeys(TOURS, "#870000"),
    other="red",
)
DAY = Theme(
    "day",
    {
        BACKGROUND: "#ffffff",
        TEXT: "#101418",
        MUTED: "#5a6470",
        PANEL_EDGE: "#808890",
        WHITE: "#000000",
        WARNING: "#c00000",
        CAUTION: "#8a5a00",
        ADVISORY: "#005a9c",
        NORMAL: "#1a6e30",
        DEFEND: "#1048c0",
        ATTACK: "#a02850",
        NO_FLY: "#805010",
        TARGET: "#8020a0",
        PLAN: "#8a94a0",
        TRAIL: "#707a84",
        GRID: "#d0d4d8",
        WATER: "#80a8d8",
        GROUND: "#c0b8a8",
    }
    | dict(zip(TEAMS, ("#00695c", "#5030a0", "#3a6a10", "#90306f", "#105a90", "#6a5520"), strict=True))
    | dict(zip(TOURS, ("#60a89e", "#a090c8", "#90ac70", "#c090b0", "#80a8c8", "#b0a484"), strict=True)),
    other="inverted",
)
CONTRAST = Theme(
    "high contrast",
    {
        BACKGROUND: "#000000",
        TEXT: "#ffffff",
        MUTED: "#d0d0d0",
        PANEL_EDGE: "#ffffff",
        WARNING: "#ff6060",
        CAUTION: "#ffff00",
        ADVISORY: "#60d0ff",
        NORMAL: "#60ff80",
        DEFEND: "#90c0ff",
        ATTACK: "#ff90b0",
        NO_FLY: "#ffb060",
        TARGET: "#ff90ff",
        PLAN: "#a0a8b0",
        TRAIL: "#c0c8d0",
        GRID: "#606060",
        WATER: "#6090d0",
        GROUND: "#808080",
    }
    | dict(zip(TOURS, TEAMS, strict=True)),
)
THEMES = {theme.name: theme for theme in (DARK, NIGHT, DAY, CONTRAST)}

SIXTEEN = {
    BACKGROUND: 0,
    TEXT: 7,
    WHITE: 15,
    MUTED: 7,
    PANEL_EDGE: 8,
    WARNING: 9,
    CAUTION: 11,
    ADVISORY: 14,
    NORMAL: 10,
    DEFEND: 12,
    ATTACK: 13,
    NO_FLY: 3,
    TARGET: 5,
    PLAN: 8,
    TRAIL: 7,
    GRID: 8,
    WATER: 4,
    GROUND: 8,
} | dict(zip((*TEAMS, *TOURS), (6, 2, 5, 14, 10, 13) * 2, strict=True))
"""Numbers of the 16 colours. The nearest by value would give warnings and attack zones the same red. There are too few
for six teams: the sixth one has the colour of attack zones, and no earlier one."""
SIXTEEN_OF = {
    "night": {name: 9 if name in (WARNING, WHITE, CAUTION) else 1 for name in SIXTEEN} | {BACKGROUND: 0},
    "day": {
        BACKGROUND: 15,
        TEXT: 0,
        WHITE: 0,
        MUTED: 8,
        PANEL_EDGE: 8,
        WARNING: 1,
        CAUTION: 0,  # bold, and with its mark: yellow cannot be read on white
        ADVISORY: 12,
        NORMAL: 2,
        DEFEND: 4,
        ATTACK: 5,
        NO_FLY: 8,
        TARGET: 5,
        PLAN: 8,
        TRAIL: 8,
        GRID: 8,
        WATER: 4,
        GROUND: 8,
    }
    | dict(zip((*TEAMS, *TOURS), (6, 2, 13, 8, 4, 5) * 2, strict=True)),
    "high contrast": SIXTEEN | {TEXT: 15, PANEL_EDGE: 15},
}
