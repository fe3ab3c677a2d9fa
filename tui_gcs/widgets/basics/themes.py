"""Themes, and what the palette becomes with 16 colours: tables from the palette's colours to others.

They are applied where cells are written (`painter.py`), so that every panel, border and dialog follows and no widget
knows of them. Shapes and words carry every meaning without colour; colours only repeat it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from tui_gcs.widgets.basics import palette


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
        palette.BACKGROUND: "#000000",
        palette.TEXT: "#d70000",
        palette.MUTED: "#af0000",
        palette.PANEL_EDGE: "#5f0000",
        palette.WHITE: "#ff5f5f",
        palette.WARNING: "#ff5f5f",
        palette.CAUTION: "#ff0000",
        palette.ADVISORY: "#d70000",
        palette.NORMAL: "#d70000",
        palette.DEFEND: "#d70000",
        palette.ATTACK: "#ff0000",
        palette.NO_FLY: "#af0000",
        palette.TARGET: "#ff5f5f",
        palette.PLAN: "#5f0000",
        palette.TRAIL: "#870000",
        palette.GRID: "#3a0000",
    },
    other="red",
)
DAY = Theme(
    "day",
    {
        palette.BACKGROUND: "#ffffff",
        palette.TEXT: "#101418",
        palette.MUTED: "#5a6470",
        palette.PANEL_EDGE: "#808890",
        palette.WHITE: "#000000",
        palette.WARNING: "#c00000",
        palette.CAUTION: "#8a5a00",
        palette.ADVISORY: "#005a9c",
        palette.NORMAL: "#1a6e30",
        palette.DEFEND: "#1048c0",
        palette.ATTACK: "#a02850",
        palette.NO_FLY: "#805010",
        palette.TARGET: "#8020a0",
        palette.PLAN: "#8a94a0",
        palette.TRAIL: "#707a84",
        palette.GRID: "#d0d4d8",
    },
    other="inverted",
)
CONTRAST = Theme(
    "high contrast",
    {
        palette.BACKGROUND: "#000000",
        palette.TEXT: "#ffffff",
        palette.MUTED: "#d0d0d0",
        palette.PANEL_EDGE: "#ffffff",
        palette.WARNING: "#ff6060",
        palette.CAUTION: "#ffff00",
        palette.ADVISORY: "#60d0ff",
        palette.NORMAL: "#60ff80",
        palette.DEFEND: "#90c0ff",
        palette.ATTACK: "#ff90b0",
        palette.NO_FLY: "#ffb060",
        palette.TARGET: "#ff90ff",
        palette.PLAN: "#a0a8b0",
        palette.TRAIL: "#c0c8d0",
        palette.GRID: "#606060",
    },
)
THEMES = {theme.name: theme for theme in (DARK, NIGHT, DAY, CONTRAST)}

SIXTEEN = {
    palette.BACKGROUND: 0,
    palette.TEXT: 7,
    palette.WHITE: 15,
    palette.MUTED: 7,
    palette.PANEL_EDGE: 8,
    palette.WARNING: 9,
    palette.CAUTION: 11,
    palette.ADVISORY: 14,
    palette.NORMAL: 10,
    palette.DEFEND: 12,
    palette.ATTACK: 13,
    palette.NO_FLY: 3,
    palette.TARGET: 5,
    palette.PLAN: 8,
    palette.TRAIL: 7,
    palette.GRID: 8,
}
"""Numbers of the 16 colours. The nearest by value would give warnings and attack zones the same red."""
SIXTEEN_OF = {
    "night": {name: 9 if name in (palette.WARNING, palette.WHITE, palette.CAUTION) else 1 for name in SIXTEEN}
    | {palette.BACKGROUND: 0},
    "day": {
        palette.BACKGROUND: 15,
        palette.TEXT: 0,
        palette.WHITE: 0,
        palette.MUTED: 8,
        palette.PANEL_EDGE: 8,
        palette.WARNING: 1,
        palette.CAUTION: 0,  # bold, and with its mark: yellow cannot be read on white
        palette.ADVISORY: 12,
        palette.NORMAL: 2,
        palette.DEFEND: 4,
        palette.ATTACK: 5,
        palette.NO_FLY: 8,
        palette.TARGET: 5,
        palette.PLAN: 8,
        palette.TRAIL: 8,
        palette.GRID: 8,
    },
    "high contrast": SIXTEEN | {palette.TEXT: 15, palette.PANEL_EDGE: 15},
}
