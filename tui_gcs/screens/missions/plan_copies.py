"""The missions screen's key that copies one vehicle's plans to other vehicles."""

from collections.abc import Callable

from tui_gcs.core.missions.survey import GeneratorError
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.screens.common.key_feedback import KeyFeedback
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.forms.form_text import FieldError, to_ids
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.missions.mission_editor import MissionEditor

ALL_VEHICLES = "all"
KIND_OF = {kind.word: kind for kind in PlanKind}


class PlanCopies:
    """Copies mission, fence and rally points; the copy is one edit that undo takes back."""

    def __init__(
        self, editor: MissionEditor, prompt: PromptBar, feedback: KeyFeedback, did: Callable[[str], None]
    ) -> None:
        """`did` reports an edit and shows the draft."""
        self._editor = editor
        self._prompt = prompt
        self._feedback = feedback
        self._did = did
        self._others: tuple[int, ...] = ()
        """All vehicles but the edited one, when the prompt was opened."""

    def ask(self) -> None:
        """Ask for the vehicles that get the copy, and for the kinds of plans."""
        editor = self._editor
        planned = self._planned(tuple(PlanKind))
        if editor.preview is not None:
            self._feedback.report("first take what is generated (^G), or drop it (Esc)", Ink.CAUTION)
        elif not planned:
            self._feedback.report(f"nothing is planned for vehicle {editor.vehicle}", Ink.CAUTION)
        else:
            self._others = tuple(vehicle for vehicle in editor.vehicles if vehicle != editor.vehicle)
            self._prompt.ask(f"Copy {planned} of {editor.vehicle} to (2-4, all; all fence: only that)")

    def copy(self, text: str | None) -> None:
        """Copy as the operator typed; None: the prompt was cancelled."""
        editor = self._editor
        if text is None:
            self._feedback.report("nothing copied", Ink.CAUTION)
            return
        try:
            vehicles, kinds = self._parse(text)
            what = self._planned(kinds)
            others = tuple(vehicle for vehicle in vehicles if vehicle != editor.vehicle)
            editor.copy_to(others, kinds)
        except (FieldError, GeneratorError) as error:
            self._feedback.report(f"nothing copied: {error}", Ink.CAUTION)
        else:
            self._did(f"{what} of {editor.vehicle} copied to {ids(others)}, each on its layer; u takes it back")

    def _parse(self, text: str) -> tuple[tuple[int, ...], tuple[PlanKind, ...]]:
        """Return the vehicles and the kinds; without a kind all kinds are meant. Raises FieldError."""
        words = text.lower().split()
        kinds = tuple(KIND_OF[word] for word in words if word in KIND_OF)
        rest = " ".join(word for word in words if word not in KIND_OF)
        vehicles = self._others if rest == ALL_VEHICLES else to_ids(rest, "vehicles")
        if not vehicles:
            raise FieldError("vehicles: nothing; must be ids like 2-4 7, or all")
        return vehicles, kinds or tuple(PlanKind)

    def _planned(self, kinds: tuple[PlanKind, ...]) -> str:
        draft = self._editor.history.draft.of(self._editor.vehicle)
        return ", ".join(kind.word for kind in kinds if draft.items(kind))
