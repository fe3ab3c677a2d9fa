"""Text on several lines: nothing that a vehicle sends and no terminal is too odd for it."""

from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from tui_gcs.core.base.text import clean
from tui_gcs.widgets.basics.strips import MIN_WRAP_CELLS, wrapped


def test_text_is_broken_at_words() -> None:
    assert wrapped("battery low, return now", 12) == ["battery low,", "return now"]


def test_what_is_cut_says_so() -> None:
    assert wrapped("battery low, return now", 14, 1) == ["battery low,.."]


def test_a_blank_text_is_one_empty_line() -> None:
    assert wrapped(" " * 50, 20) == [""]


@given(st.text(max_size=120), st.integers(-5, 130), st.none() | st.integers(1, 4))
def test_any_text_fits_into_any_width(raw: str, cells: int, most: int | None) -> None:
    text = clean(raw)
    lines = wrapped(text, cells, most)
    assert 1 <= len(lines) <= (most or len(lines))
    assert all(cell_len(line) <= max(cells, MIN_WRAP_CELLS) for line in lines)
    if most is None:
        assert "".join("".join(lines).split()) == "".join(text.split())
