"""Themes and the 16 colours: every meaning stays apart from every other that matters."""

import pytest
from rich.color import Color, ColorSystem
from rich.style import Style

from tui_gcs.terminal import themes as palette
from tui_gcs.terminal.cell_painter import Pens
from tui_gcs.terminal.themes import SIXTEEN, SIXTEEN_OF, THEMES, Theme

ALARMS = (palette.WARNING, palette.CAUTION, palette.ADVISORY, palette.TEXT)


def luminance(name: str) -> float:
    """Relative luminance, WCAG 2."""
    parts = [value / 255 for value in Color.parse(name).get_truecolor()]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("theme", THEMES.values(), ids=lambda theme: theme.name)
def test_what_must_be_read_can_be_read(theme: Theme) -> None:
    ground = theme.colour(palette.BACKGROUND)
    least = 3.0 if theme.name == "night" else 4.5
    for name in (*ALARMS, palette.NORMAL, palette.DEFEND, palette.ATTACK):
        assert contrast(theme.colour(name), ground) > least, name


def test_the_night_is_red() -> None:
    night = THEMES["night"]
    for name in (*ALARMS, palette.DEFEND, palette.PANEL_EDGE, "#1c2126", "#8899aa"):
        red, green, blue = Color.parse(night.colour(name)).get_truecolor()
        assert red >= 1.5 * green
        assert red >= 2 * blue


@pytest.mark.parametrize("sixteen", [SIXTEEN, SIXTEEN_OF["day"], SIXTEEN_OF["high contrast"]])
def test_in_sixteen_colours_alarms_and_zones_stay_apart(sixteen: dict[str, int]) -> None:
    kinds = (palette.WARNING, palette.CAUTION, palette.ADVISORY, palette.NORMAL, palette.ATTACK, palette.DEFEND)
    assert len({sixteen[name] for name in kinds}) == len(kinds)
    # Seen in the demo: the team that defends had the colour of the zone to attack.
    teams = {sixteen[name] for name in palette.TEAMS[:2]}
    assert len(teams) == 2 and not teams & {sixteen[name] for name in kinds[:3] + kinds[4:]}
    assert sixteen[palette.BACKGROUND] not in {sixteen[name] for name in (*kinds, palette.TEXT, palette.MUTED)}


XTERM = (
    *("#000000", "#cd0000", "#00cd00", "#cdcd00", "#0000ee", "#cd00cd", "#00cdcd", "#e5e5e5"),
    *("#7f7f7f", "#ff0000", "#00ff00", "#ffff00", "#5c5cff", "#ff00ff", "#00ffff", "#ffffff"),
)
LINUX = (
    *("#000000", "#aa0000", "#00aa00", "#aa5500", "#0000aa", "#aa00aa", "#00aaaa", "#aaaaaa"),
    *("#555555", "#ff5555", "#55ff55", "#ffff55", "#5555ff", "#ff55ff", "#55ffff", "#ffffff"),
)


@pytest.mark.parametrize("shown", [XTERM, LINUX], ids=["xterm", "linux"])
@pytest.mark.parametrize("theme", THEMES.values(), ids=lambda theme: theme.name)
def test_in_sixteen_colours_what_must_be_read_can_be_read(theme: Theme, shown: tuple[str, ...]) -> None:
    sixteen = SIXTEEN_OF.get(theme.name, SIXTEEN)
    least = 2.5 if theme.name == "night" else 4.0
    for name in (*ALARMS, palette.DEFEND, palette.ATTACK):
        assert contrast(shown[sixteen[name]], shown[sixteen[palette.BACKGROUND]]) > least, name


def test_warning_and_caution_stay_apart_in_256_colours() -> None:
    red, yellow = (Color.parse(name).downgrade(ColorSystem.EIGHT_BIT).number for name in ALARMS[:2])
    assert (red, yellow) == (203, 221), "ff5f5f and ffd75f"


def test_pens_follow_the_theme() -> None:
    style = Style(color=palette.WARNING, bgcolor=palette.BACKGROUND, bold=True)
    assert Pens(ColorSystem.STANDARD).of(style).foreground == "91"
    assert Pens(ColorSystem.TRUECOLOR, THEMES["day"]).of(style).background == "48;2;255;255;255"
    assert Pens(ColorSystem.TRUECOLOR).of(style).foreground == "38;2;255;80;80"
    assert "1" in Pens(ColorSystem.STANDARD, THEMES["night"]).of(style).attributes
