"""What stands below the forms of a screen that edits, whole: there it is cut where the terminal is low."""

from textwrap import wrap

from tui_gcs.core.base.text import clean
from tui_gcs.screens.common.text_dialog import MOST_CELLS, ScrolledDialog
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.forms.form_findings import MAX_CELLS, VerdictLines


class RemarksDialog(ScrolledDialog):
    """Over a screen that edits, as it was when it was opened."""

    LEAVE_KEYS = (*ScrolledDialog.LEAVE_KEYS, "ctrl+r")
    title_text = "what is said of this plan"

    def __init__(self, verdict: VerdictLines) -> None:
        """Of these lines."""
        super().__init__(verdict.glyphs)
        self._remarks = verdict.remarks

    def all_lines(self) -> list[Line]:
        """Each wrapped, none cut."""
        return [[(part, said.ink)] for said in self._remarks for part in wrap(clean(said.text, MAX_CELLS), MOST_CELLS)]
