"""Panes of plots: what is drawn, told apart without colour, and safe with any number."""

import math

import numpy as np
import pytest

from tui_gcs.widgets.basics.glyphs import ASCII, UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.plots.plot_curve import LETTERS, MAX_CURVES, Curve, PlotSpan, curve_dots
from tui_gcs.widgets.plots.plot_pane import PaneContent, PlotPane, plain_text, time_axis
from tui_gcs.widgets.plots.plot_scale import nice_scale, short_number, tick_words

TIMES_S = np.arange(0.0, 60.0, 0.2)


def words(t_s: float) -> str:
    return f"12:{int(t_s) // 60:02d}:{int(t_s) % 60:02d}"


def wave(at: int) -> Curve:
    return Curve(f"v{at + 1}", TIMES_S, 30.0 + np.sin(TIMES_S / 7 + at) * (at + 1))


def content(*curves: Curve, cursor_s: float | None = None) -> PaneContent:
    return PaneContent(curves, "m", 0.0, 60.0, words, cursor_s=cursor_s)


def drawn(what: PaneContent, size: tuple[int, int] = (100, 12), glyphs: GlyphSet = UNICODE) -> str:
    pane = PlotPane(glyphs=glyphs)
    pane.content = what
    return plain_text(pane.lines(*size))


def one(*values: float) -> PaneContent:
    return content(Curve("v1", np.linspace(0.0, 60.0, len(values)), np.array(values, dtype=np.float64)))


def test_a_curve_has_its_numbers_beside_it_and_times_below() -> None:
    text = drawn(content(wave(1)))
    assert "NOW    MIN    MAX" in text and "v2" in text and "28     32" in text
    assert text.splitlines()[-1].split() == ["m", "12:00:00", "12:00:30", "12:01:00"]


def test_the_cursor_shows_the_values_at_its_time() -> None:
    text = drawn(content(Curve("v1", TIMES_S, TIMES_S), cursor_s=33.05))
    assert "AT" in text and "     33 " in text and "[12:00:33]" in text


def test_times_give_way_to_that_of_the_cursor() -> None:
    line = time_axis(content(wave(0), cursor_s=21.0), 66)
    assert "[12:00:21]" in line and "12:00:20" not in line


@pytest.mark.parametrize("glyphs", [UNICODE, ASCII], ids=["braille", "ascii"])
def test_each_curve_can_be_told_apart_without_colour(glyphs: GlyphSet) -> None:
    text = drawn(content(*(wave(at) for at in range(MAX_CURVES))), (120, 20), glyphs)
    graph = "".join(line[9:88] for line in text.splitlines()[:-1])
    assert set(LETTERS) <= set(graph)


def test_the_ascii_form_is_ascii() -> None:
    pane = PlotPane(glyphs=ASCII)
    pane.content = content(wave(0), wave(1), cursor_s=10.0)
    assert plain_text(pane.lines(80, 10)).isascii()


def test_lines_of_several_curves_have_different_dashes() -> None:
    flat = [drawn(content(*([wave(9)] * at), Curve("v", TIMES_S, TIMES_S * 0.0 + 30.0))) for at in (0, 1, 2)]
    assert len(set(flat)) == 3


def test_a_gap_interrupts_the_line() -> None:
    values = np.where((TIMES_S > 20) & (TIMES_S < 40), math.nan, 5.0)
    curve = Curve("v1", TIMES_S, values)
    text = drawn(PaneContent((curve,), "m", 0.0, 60.0, words), (9 + 28 + 60, 12))
    columns = {
        at - 9 for line in text.splitlines()[1:-1] for at, sign in enumerate(line[:69]) if at > 8 and sign != " "
    }
    assert columns == {*range(21), *range(40, 60)}


def test_a_spike_of_one_point_among_thousands_is_drawn() -> None:
    values = np.zeros(50_000)
    values[30_000] = 7.0
    curve = Curve("v1", np.linspace(0.0, 60.0, 50_000), values)
    dots = curve_dots(curve, PlotSpan(0.0, 60.0, 0.0, 7.0), 100, 40)
    assert len(dots) <= 202 and dots[:, 1].min() == 0.5


@pytest.mark.parametrize(
    "values",
    [
        (math.nan,) * 3,
        (1e150, -1e150, 3.0),
        (3.4e38, 0.0, -3.4e38),
        (1e38, 1e38, 1e38),
        (5e-324, 0.0, 5e-324),
        (0.0, 0.0),
        (0.135, 0.135),
        (1e16, 1e16 + 2, 1e16),
        (7.0,),
    ],
)
@pytest.mark.parametrize("size", [(100, 12), (60, 4), (20, 3), (2, 1)])
def test_any_number_is_drawn_within_the_pane(values: tuple[float, ...], size: tuple[int, int]) -> None:
    lines = drawn(one(*values), size).splitlines()
    assert len(lines) <= size[1] and all(len(line) <= max(size[0], 18) for line in lines)


def test_without_any_curve_it_says_what_to_do() -> None:
    assert drawn(PaneContent((), "", 0.0, 1.0, words, empty_text="/ finds a value")) == "/ finds a value"


def test_more_curves_than_lines_are_counted() -> None:
    assert "4 more" in drawn(content(*(wave(at) for at in range(6))), (100, 4))


def test_the_scale_stays_while_the_values_fit() -> None:
    pane = PlotPane()
    scales = []
    for high in (10.0, 9.0, 11.0, 3.0):
        pane.content = one(0.0, high)
        pane.lines(100, 12)
        scales.append(pane._scale)
    assert scales[0] is scales[1] and scales[2] is not scales[1] and scales[3] is not scales[2]


def test_scales_begin_and_end_at_round_numbers() -> None:
    scale = nice_scale(0.3, 9.7, 12)
    assert (scale.low, scale.high, scale.step) == (0.0, 10.0, 5.0) or scale.ticks[0] == 0.0
    assert scale.low <= 0.3 and scale.high >= 9.7


@pytest.mark.parametrize(
    ("value", "text"),
    [(12.34567, "12.35"), (-1e-12, "-1e-12"), (3.4e38, "3.4e38"), (52012.4, "52012"), (math.nan, "--"), (-0.0, "0")],
)
def test_numbers_fit_into_six_cells(value: float, text: str) -> None:
    assert short_number(value, 6) == text


def test_marks_have_as_many_decimals_as_they_differ_in() -> None:
    assert tick_words(0.5, 0.05, 8) == "0.50" and tick_words(20.0, 10.0, 8) == "20"
    assert tick_words(1e38, 1e37, 8) == "1e+38"


def test_hostile_labels_are_cut_to_the_legend() -> None:
    text = drawn(content(Curve("x" * 500, TIMES_S, TIMES_S)))
    assert max(map(len, text.splitlines())) <= 100


def test_letters_and_lines_have_the_ink_of_their_curve() -> None:
    pane = PlotPane()
    pane.content = content(wave(0), wave(1))
    inks = {ink for line in pane.lines(100, 12) for _, ink in line}
    assert {Ink.TEAM_1, Ink.TEAM_2} <= inks
