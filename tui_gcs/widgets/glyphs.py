"""Which characters the console draws with: braille and box signs, or plain ASCII.

Only characters that are one cell wide everywhere: no code point that a terminal may show as an emoji
(so `►`, not the play button). The non-braille signs are those of the old PC character set, which most fonts have.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass

BRAILLE_BASE = 0x2800
"""First code point of the braille patterns; the low eight bits are the dots."""


@dataclass(frozen=True)
class GlyphSet:
    """One character for each meaning; meanings are told apart without colour."""

    name: str
    braille: bool
    """Dots of a cell as one braille pattern; otherwise one letter per cell, by what is drawn there."""
    headings: str
    """Flying: north, north-east, east … north-west."""
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


UNICODE = GlyphSet(
    name="unicode",
    braille=True,
    headings="▲◥►◢▼◣◄◤",
    armed_on_ground="△",
    disarmed="◇",
    lost="×",
    unknown_heading="●",
    place="×",
    marker="+",
    bullet="●",
    running="►",
    stopped="■",
    selected="▸",
    north="N↑",
    times="×",
    degree="°",
    dash="–",
)

ASCII = GlyphSet(
    name="ascii",
    braille=False,
    headings="^/>\\v/<\\",
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
)


def wants_ascii(environ: Mapping[str, str] | None = None, encoding: str | None = None) -> bool:
    """Whether this terminal needs the ASCII set: asked for, not UTF-8, or the Linux console (no braille)."""
    environ = os.environ if environ is None else environ
    if environ.get("TUI_GCS_ASCII", "") not in ("", "0"):
        return True
    if encoding is not None and encoding.replace("-", "").lower() not in ("utf8", ""):
        return True
    return environ.get("TERM", "") == "linux"


def glyph_set(ascii_only: bool) -> GlyphSet:
    """The set to draw with."""
    return ASCII if ascii_only else UNICODE


def heading_glyph(glyphs: GlyphSet, heading_deg: float) -> str:
    """An arrow for a heading in degrees clockwise from north; NaN gives the unknown sign."""
    if heading_deg != heading_deg:  # NaN
        return glyphs.unknown_heading
    return glyphs.headings[int(heading_deg / 45.0 + 0.5) % 8]
