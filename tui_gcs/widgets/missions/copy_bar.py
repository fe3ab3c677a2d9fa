"""One line that asks for the vehicles that get a copy of a plan."""

from textual.message import Message

from tui_gcs.core.plans.model import PlanKind
from tui_gcs.widgets.forms.form_text import FieldError, to_ids
from tui_gcs.widgets.forms.prompt_bar import PathBar

ALL = "all"
KIND_OF = {kind.word: kind for kind in PlanKind}


class CopyBar(PathBar):
    """Says for whom, and what of it."""

    class Wanted(Message):
        """For these vehicles; None: for nobody, perhaps with a reason. Without `kinds` everything is meant."""

        def __init__(self, vehicles: tuple[int, ...] | None, kinds: tuple[PlanKind, ...] = (), why: str = "") -> None:
            super().__init__()
            self.vehicles, self.kinds, self.why = vehicles, kinds, why

    def ask(self, vehicle: int, what: str, others: tuple[int, ...]) -> None:
        """For whom? `others` are all of them."""
        self._others = others
        self.open(f"Copy {what} of {vehicle} to (2-4, all; all fence: only that)")

    def answered(self, typed: str) -> None:
        """Enter."""
        self.close()
        words = typed.lower().split()
        kinds = tuple(KIND_OF[word] for word in words if word in KIND_OF)
        rest = " ".join(word for word in words if word not in KIND_OF)
        try:
            vehicles = self._others if rest == ALL else to_ids(rest, "vehicles")
            if not vehicles:
                raise FieldError("vehicles: nothing; must be ids like 2-4 7, or all")
        except FieldError as error:
            self.post_message(self.Wanted(None, why=str(error)))
        else:
            self.post_message(self.Wanted(vehicles, kinds))

    def action_cancel(self) -> None:
        """Esc."""
        self.close()
        self.post_message(self.Wanted(None))
