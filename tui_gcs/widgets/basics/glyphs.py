"""The characters that the console draws with: braille and box signs, or plain ASCII.

Only characters that are one cell wide everywhere: no code point that a terminal may show as an emoji
(so `►`, not the play button). The non-braille signs are those of the old PC character set, which most fonts have.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

BRAILLE_BASE = 0x2800
"""First code point of the braille patterns; the low eight bits are the dots."""
QUADRANTS = " ▘▝▀▖▌▞▛▗▚▐▜▄▙▟█"
"""Quarters of a cell: bit 0 top left, 1 top right, 2 bottom left, 3 bottom right."""
_NEAREST = str.maketrans("±°×…–—→·µ", "~ x.-->.u")
Dots = Literal["braille", "blocks", "letters"]
"""Eight dots to a cell, four, or one letter for what is drawn there."""


@dataclass(frozen=True)
class GlyphSet:
    """One character for each meaning, so that meanings differ without colour."""

    name: str
    unicode: bool
    """Whether signs and lines beyond ASCII may be used."""
    dots: Dots
    """How the dots of a cell are drawn."""
    headings: str
    """A flying vehicle by heading: north, north-east, east … north-west."""
    by_hand: str
    """A vehicle that flies on a course of an operator, where headings are not shown."""
    armed_on_ground: str
    disarmed: str
    lost: str
    unknown_heading: str
    place: str
    marker: str
    bullet: str
    running: str
    stopped: str
    selected: str
    north: str
    times: str
    degree: str
    dash: str
    cursor: str
    bar: str
    """Left end, middle and right end of the scale bar."""


UNICODE = GlyphSet(
    name="unicode",
    unicode=True,
    dots="braille",
    headings="▲◥►◢▼◣◄◤",
    by_hand="◉",
    armed_on_ground="△",
    disarmed="◇",
    lost="×",
    unknown_heading="●",
    place="H",
    marker="+",
    bullet="●",
    running="►",
    stopped="■",
    selected="▸",
    north="N↑",
    times="×",
    degree="°",
    dash="–",
    cursor="┼",
    bar="├─┤",
)

ASCII = GlyphSet(
    name="ascii",
    unicode=False,
    dots="letters",
    headings="^/>\\v/<\\",
    by_hand="h",
    armed_on_ground="A",
    disarmed="o",
    lost="x",
    unknown_heading="@",
    place="H",
    marker="+",
    bullet="*",
    running=">",
    stopped="#",
    selected=">",
    north="N^",
    times="x",
    degree=" ",
    dash="-",
    cursor="X",
    bar="|-|",
)


def wants_ascii(environ: Mapping[str, str] | None = None, encoding: str | None = None) -> bool:
    """Whether this terminal needs the ASCII set: by choice, not UTF-8, or the Linux console, which has no braille."""
    environ = os.environ if environ is None else environ
    if environ.get("TUI_GCS_ASCII", "") not in ("", "0"):
        return True
    if encoding is not None and encoding.replace("-", "").lower() not in ("utf8", ""):
        return True
    return environ.get("TERM", "") == "linux" or _is_plain(environ)


def _is_plain(environ: Mapping[str, str]) -> bool:
    """Whether the operator's locale is plain C."""
    names = [environ.get(name, "") for name in ("LC_ALL", "LC_CTYPE", "LANG")]
    if not names[0] and names[1] == "C.UTF-8":
        # Python writes UTF-8 in a C locale and puts that into LC_CTYPE (PEP 538): LANG has the operator's choice.
        names[1] = ""
    return next((name for name in names if name), "") in ("C", "POSIX")


def as_ascii(text: str) -> str:
    """`text` for a terminal without other signs, as long as it was: the nearest sign, else a question mark."""
    return text.translate(_NEAREST).encode("ascii", "replace").decode()


def glyph_set(ascii_only: bool) -> GlyphSet:
    """The set to draw with."""
    return ASCII if ascii_only else UNICODE


def next_dots(dots: Dots) -> Dots:
    """The next way to draw dots: the operator tries them until the terminal's font has one."""
    ways: tuple[Dots, ...] = ("braille", "blocks", "letters")
    return ways[(ways.index(dots) + 1) % len(ways)]


def heading_glyph(glyphs: GlyphSet, heading_deg: float) -> str:
    """An arrow for a heading in degrees clockwise from north; NaN gives the unknown sign."""
    if heading_deg != heading_deg:  # NaN
        return glyphs.unknown_heading
    return glyphs.headings[int(heading_deg / 45.0 + 0.5) % 8]
