"""Whatever a vehicle says, the terminal sees one line of visible characters of known width."""

import sys
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from tui_gcs.core.base.text import clean


@pytest.mark.parametrize(
    ("raw", "shown"),
    [
        ("PreArm: Check [/] mag", "PreArm: Check [/] mag"),
        ("%s {0} [@click=app.quit]x[/]", "%s {0} [@click=app.quit]x[/]"),
        ("\x1b]52;c;cm0gLXJm\x07", "␛]52;c;cm0gLXJm␇"),
        ("\x1b[2J\x1b[6n", "␛[2J␛[6n"),
        ("line\r\nnext\tcol\x00\x7f", "line␍␊next␉col␀␡"),
        ("\x9b31m \x85", "\ufffd31m \ufffd"),
        ("a\u202eb\u2066c\u200bd\u200de\ufefff", "a\ufffdb\ufffdc\ufffdd\ufffde\ufffdf"),
        ("x\u2028y\u2029z", "x\ufffdy\ufffdz"),
        ("\ue000\U000f0000\ud800", "\ufffd\ufffd\ufffd"),
        ("a\ufe0fb\U000e0041c", "a\ufffdb\ufffdc"),
        ("é e\u0301", "é e\u0301"),
        ("e" + "\u0301" * 50 + "!", "e\u0301\u0301\ufffd!"),
        ("\u0301x", "\ufffdx"),
        ("a\u00a0b\u3000c", "a b c"),
        ("温度 高い", "温度 高い"),
        ("\ufdfd \U0001f1ec\U0001f1e7 \U0001f44d\U0001f3fd", "\ufffd \ufffd\ufffd \U0001f44d\ufffd"),
        ("\u1160\u11ff\u1200 \ufe00\ufe0f\ufe10", "\ufffd\ufffd\u1200 \ufffd\ufffd\ufe10"),
        ("\ufdf9\ufdfa\ufdfd\ufdfe", "\ufdf9\ufffd\ufffd\ufdfe"),
        (b"caf\xc3\xa9 \xff \xc2\x9b", "café \ufffd \ufffd"),
        ("", ""),
    ],
)
def test_dangerous_characters_become_visible_ones(raw: str | bytes, shown: str) -> None:
    assert clean(raw) == shown


def test_every_character_that_is_shown_is_as_wide_as_rich_draws_it() -> None:
    """`clean` counts cells by Python's own tables; the console draws with rich's."""
    for char in shown_for_every_code_point():
        if unicodedata.category(char) not in ("Mn", "Me"):
            three_cells = char * 3 if cell_len(char) == 1 else char + "…"
            assert clean(char * 3, max_cells=3) == three_cells, hex(ord(char))


def shown_for_every_code_point() -> set[str]:
    """What `clean` shows for all characters there are, each once: most become the same U+FFFD.

    Every character stands behind a letter, so that none is seen beside its neighbour.
    """
    blocks = (range(first, first + 0x1000) for first in range(0, sys.maxunicode + 1, 0x1000))
    cleaned = [clean("".join(f"a{chr(code)}" for code in block), max_cells=0x4000) for block in blocks]
    assert {len(text) for text in cleaned} == {2 * 0x1000}
    return {char for text in cleaned for char in text[1::2]}


def test_long_text_is_cut_by_cells_not_characters() -> None:
    assert clean("abcdef", max_cells=6) == "abcdef"
    assert clean("abcdefg", max_cells=6) == "abcde…"
    assert clean("温度温度", max_cells=6) == "温度…"
    assert clean("xy", max_cells=1) == "…"
    assert clean("x", max_cells=0) == ""
    assert clean("xy", max_cells=-3) == ""
    assert clean(b"a" * 10_000_000, max_cells=3) == "aa…"


@given(st.one_of(st.text(st.characters(), max_size=300), st.binary(max_size=300)), st.integers(-1, 80))
def test_clean_never_raises_and_keeps_its_promises(raw: str | bytes, max_cells: int) -> None:
    shown = clean(raw, max_cells)
    assert cell_len(shown) <= max(max_cells, 0)
    assert all(
        unicodedata.category(char)[0] != "C" and unicodedata.category(char) not in ("Zl", "Zp") for char in shown
    )
    assert "\n" not in shown
    assert clean(shown, max_cells) == shown
