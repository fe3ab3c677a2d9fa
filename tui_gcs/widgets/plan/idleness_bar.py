"""One line that asks for an idleness."""

from textual.message import Message

from tui_gcs.widgets.forms.form_text import FieldError, to_number
from tui_gcs.widgets.forms.prompt_bar import PathBar

MOST_S = 86_400.0


class IdlenessBar(PathBar):
    """Says what was wanted."""

    class Wanted(Message):
        """So many seconds; None: nothing, perhaps with a reason."""

        def __init__(self, idleness_s: float | None, why: str = "") -> None:
            super().__init__()
            self.idleness_s, self.why = idleness_s, why

    def ask(self, team: str) -> None:
        """For this team."""
        self.open(f"Vehicles of {team} for a worst idleness of how many seconds?")

    def answered(self, typed: str) -> None:
        """Enter."""
        self.close()
        try:
            idleness_s = to_number(typed, "idleness")
            if not 0.1 <= idleness_s <= MOST_S:
                raise FieldError(f"idleness: must be 0.1 to {MOST_S:g} s")
        except FieldError as error:
            self.post_message(self.Wanted(None, str(error)))
        else:
            self.post_message(self.Wanted(idleness_s))

    def action_cancel(self) -> None:
        """Esc."""
        self.close()
        self.post_message(self.Wanted(None))
