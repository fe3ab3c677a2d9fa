"""Safe text: `clean` is the only way in which text from a vehicle becomes `SafeText`.

Text from a vehicle is hostile. Measured: Textual writes escape sequences in any string verbatim to the terminal, and 50
bytes of STATUSTEXT are enough to write the operator's clipboard. `SafeText` is one line of visible characters of known
width in cells. It is still never markup, a format string, a path or a URL (docs/threats.md B.3).
"""

import unicodedata
from typing import NewType

SafeText = NewType("SafeText", str)
"""A string that went through `clean`."""

REPLACEMENT = "\ufffd"
ELLIPSIS = "…"
# Letters of all languages need one or two combining marks; more are used to paint over the lines around ("Zalgo").
_MAX_COMBINING = 2
_FORBIDDEN_RANGES = (
    (0x1160, 0x11FF),  # conjoining Hangul jamo: width depends on the neighbours
    (0x3164, 0x3164),  # Hangul filler: no width
    (0xD7B0, 0xD7FF),  # more conjoining Hangul jamo
    (0xFE00, 0xFE0F),  # variation selectors
    (0xFFA0, 0xFFA0),  # halfwidth Hangul filler: no width
    (0xFDFA, 0xFDFD),  # single characters as wide as a sentence
    (0x1F1E6, 0x1F1FF),  # regional indicators: two of them make one flag
    (0x1F3FB, 0x1F3FF),  # skin tones: merge with the character before
    (0xE0000, 0xE0FFF),  # tags and more variation selectors
)

_WIDE_SINCE_UNICODE_16 = ((0x2630, 0x2637), (0x268A, 0x268F), (0x4DC0, 0x4DFF), (0x1D300, 0x1D356), (0x1D360, 0x1D376))
"""Trigrams, hexagrams and counting rods: wide for new terminals and for rich, narrow in the tables of older Pythons."""


def clean(raw: str | bytes, max_cells: int = 200) -> SafeText:
    """Return one safe line of `raw`, at most `max_cells` terminal cells wide; never raises.

    Bytes are read as UTF-8. Control characters become their pictures (ESC is shown as ␛). Everything that changes
    direction, is invisible, private or unassigned becomes U+FFFD, and so do piled-up combining marks. Text that was cut
    ends in an ellipsis.
    """
    # What lies beyond cannot be seen: this bounds the work for any input.
    limit = 8 * max(max_cells, 0) + 8
    text = raw[: 4 * limit].decode("utf-8", "replace") if isinstance(raw, bytes) else raw
    if text.isascii() and text.isprintable() and len(text) <= max_cells:
        return SafeText(text)
    return SafeText(_fit(_visible(text[:limit]), max_cells))


def _visible(text: str) -> str:
    """Return `text` with every dangerous character replaced."""
    out: list[str] = []
    # A mark at the start would sit on whatever is drawn before the text.
    marks = _MAX_COMBINING
    for char in text:
        if unicodedata.category(char) in ("Mn", "Me") and not _forbidden(ord(char)):
            marks += 1
            if marks <= _MAX_COMBINING:
                out.append(char)
            elif marks == _MAX_COMBINING + 1:
                out.append(REPLACEMENT)
            continue
        marks = 0
        out.append(_visible_char(char))
    return "".join(out)


def _visible_char(char: str) -> str:
    """Return what is shown for one character that is no combining mark."""
    code = ord(char)
    if 0x20 <= code < 0x7F:
        return char
    if code < 0x20:
        return chr(0x2400 + code)
    if code == 0x7F:
        return "\u2421"
    category = unicodedata.category(char)
    if category == "Zs":
        return " "
    if category[0] in "CMZ" or _forbidden(code):
        return REPLACEMENT
    return char


def _cells(char: str) -> int:
    """Terminal cells of a visible character that is no combining mark: 1 or 2."""
    if unicodedata.east_asian_width(char) in "WF":
        return 2
    code = ord(char)
    return 2 if any(first <= code <= last for first, last in _WIDE_SINCE_UNICODE_16) else 1


def _forbidden(code: int) -> bool:
    return any(first <= code <= last for first, last in _FORBIDDEN_RANGES)


def _fit(text: str, max_cells: int) -> str:
    """Return `text`, cut to `max_cells`."""
    widths = [0 if unicodedata.category(char) in ("Mn", "Me") else _cells(char) for char in text]
    if sum(widths) <= max_cells:
        return text
    if max_cells < 1:
        return ""
    used = 0
    for index, width in enumerate(widths):
        if used + width > max_cells - 1:
            return text[:index] + ELLIPSIS
        used += width
    return text
