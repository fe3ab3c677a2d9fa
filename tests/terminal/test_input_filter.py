"""What a terminal sends, and what of it becomes keys (docs/threats.md B.6-108)."""

import pytest

from tui_gcs.terminal.input_filter import BEGIN, END, MAX_PASTED, InputFilter

UP, MOUSE = "\x1b[A", "\x1b[<35;40;12M"


def pieces(data: str, size: int) -> list[str]:
    return [data[at : at + size] for at in range(0, len(data), size)]


def sifted(sieve: InputFilter, *data: str, begin_s: float = 100.0, gap_s: float = 0.001) -> str:
    """What is left of pieces that come one behind the other."""
    return "".join(sieve.filtered(piece, begin_s + index * gap_s) for index, piece in enumerate(data))


@pytest.mark.parametrize(
    ("keys", "gap_s"), [(["!", "h", "\x1b", UP] * 50, 0.1), ([MOUSE] * 1000, 0.01), ([UP] * 3000, 1 / 30)]
)
def test_what_is_typed_stays_as_it_is(keys: list[str], gap_s: float) -> None:
    """Also a key held down for minutes, and a mouse in motion."""
    assert sifted(InputFilter(), *keys, gap_s=gap_s) == "".join(keys)


def test_what_was_typed_ahead_on_a_link_that_stood_still_comes_at_once() -> None:
    assert sifted(InputFilter(), UP * 100 + "!h") == UP * 100 + "!h"


@pytest.mark.parametrize("size", [1, 5, 6, 7, 4096], ids="{} at once".format)
def test_a_paste_is_one_line_of_visible_characters(size: int) -> None:
    """However it is cut by reads; Esc, Enter and all behind it are not in it."""
    sieve = InputFilter()
    data = f"a{BEGIN}\x1b[A!h 52.07\t-0.6\x07\rq\ry{END}b"
    assert sifted(sieve, *pieces(data, size)) == f"a{BEGIN}[A!h 52.07-0.6{END}b"
    assert sieve.take_dropped() > 0 and sieve.take_dropped() == 0


def test_of_a_megabyte_pasted_a_field_gets_little_and_the_rest_is_counted() -> None:
    sieve = InputFilter()
    got = sifted(sieve, BEGIN, *pieces("!h " * 350_000, 4096), END)
    assert got.startswith(f"{BEGIN}!h !h ") and len(got) <= MAX_PASTED + len(BEGIN + END)
    assert sieve.take_dropped() == 1_050_000 - MAX_PASTED


@pytest.mark.parametrize("flood", ["!h q\r" * 200_000, MOUSE * 70_000], ids=["text", "mouse"])
def test_a_flood_without_brackets_is_no_key_at_all_until_it_is_over(flood: str) -> None:
    sieve = InputFilter()
    assert sifted(sieve, *pieces(flood, 4096)) == ""
    assert sieve.take_dropped() == len(flood)
    assert sieve.filtered("!h", 100.001 * len(pieces(flood, 4096)) + 1.0) == "!h"


def test_a_paste_whose_end_got_lost_does_not_swallow_the_keys_behind_it() -> None:
    sieve = InputFilter()
    assert sieve.filtered(f"{BEGIN}half", 100.0) == BEGIN
    assert sieve.filtered(" of it", 101.5) == "", "the link stood still"
    assert sieve.filtered("!h", 104.0) == f"{END}!h"
