"""Titles in borders: written once, because Textual paints the whole widget whenever a title is set."""

import pytest

from tui_gcs.widgets.basics.border_titles import set_title, show_beyond
from tui_gcs.widgets.basics.lines_view import LinesView


class Painted(LinesView):
    """Counts how often it is painted whole."""

    painted = 0

    def refresh(self, *regions: object, **options: object) -> "Painted":
        self.painted += not regions
        return self


@pytest.mark.parametrize("text", ["fleet  8", "mag [/] [b]", "[unclosed", "back\\slash [", "a\\[b]", ""])
def test_an_equal_title_is_not_written_again(text: str) -> None:
    widget = Painted()
    set_title(widget, "something else")
    before = widget.painted
    set_title(widget, text)
    assert widget.painted == before + 1
    set_title(widget, text)
    assert widget.painted == before + 1


def test_keys_in_brackets_below_a_list_are_not_written_again() -> None:
    widget = Painted()
    show_beyond(widget, 0, 4, "[ ]")
    assert widget.painted == 1
    show_beyond(widget, 0, 4, "[ ]")
    assert widget.painted == 1
    show_beyond(widget, 1, 3, "[ ]")
    assert widget.painted == 2
    show_beyond(widget, 0, 0)
    assert widget.painted == 3 and not widget.border_subtitle
