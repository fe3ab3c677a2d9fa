"""The forms of the missions screen: one item, what to generate, what vehicles are assumed to be capable of."""

from collections.abc import Callable
from typing import Protocol

from textual.dom import DOMNode
from textual.widget import Widget

from tui_gcs.core.missions.survey import GeneratorError
from tui_gcs.screens.common.key_feedback import KeyFeedback
from tui_gcs.widgets.basics.narrow_style import show_classes
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.forms.form_text import FieldError
from tui_gcs.widgets.missions.generate_form import GenerateForm
from tui_gcs.widgets.missions.item_form import ItemForm
from tui_gcs.widgets.missions.mission_edits import MissionEdits
from tui_gcs.widgets.missions.mission_text import ItemText, item_text, item_title, to_item
from tui_gcs.widgets.missions.performance_form import PerformanceForm


class Did(Protocol):
    """Reports an edit, and shows the draft; the item form only with `form`: not while it is typed into."""

    def __call__(self, text: str, ink: Ink = Ink.TEXT, *, form: bool = True) -> None:
        """Report an edit in the edit line."""
        ...


class MissionForms:
    """Shows one of the forms below the lists, and passes what is typed into it to the editor."""

    def __init__(
        self,
        node: DOMNode,
        forms: tuple[ItemForm, GenerateForm, PerformanceForm],
        others: tuple[Widget, Widget],
        work_list: Widget,
        edits: MissionEdits,
        feedback: KeyFeedback,
        *,
        did: Did,
        show: Callable[[], None],
    ) -> None:
        """`node` has the CSS classes that decide which form is shown; `others` are styled by them, too.

        `show` shows the draft, but leaves the item form as it is typed.
        """
        self._node = node
        self._item_form, self._generate_form, self._performance_form = forms
        self._others = others
        self._work_list = work_list
        self._edits = edits
        self._editor = edits.editor
        self._feedback = feedback
        self._did, self._show = did, show
        self.problem = ""
        """Why the value that is being typed is not taken."""

    def show_item(self) -> None:
        """Show the edited item; a value that was not allowed is dropped."""
        editor, item = self._editor, self._editor.item
        texts = item_text(editor, item) if item is not None else ItemText()
        self._item_form.show(item, texts, editor.kind, item_title(editor, item) if item is not None else "")

    def take_item(self, texts: ItemText, field: str) -> None:
        """Take what was typed into the item form."""
        item = self._editor.item
        if item is None:
            return
        try:
            new = to_item(self._edits, texts, item)
        except FieldError as error:
            self.problem = str(error)
            # Half a value has been taken already while it was typed, and is not meant.
            self._editor.retract()
            self._show()
            return
        self.problem = ""
        self._edits.replace_item(new, field)
        self._did("", form=field == "command")

    def open_performance(self) -> None:
        """Open the form of the assumed performance; every change counts at once."""
        if self._node.has_class("-generating"):
            self.leave()
        self._show_class("-assuming")
        self._performance_form.begin(self._editor.forecast.performance)

    def take_performance(self) -> None:
        """Forecast with the performance that was typed."""
        try:
            self._editor.assume(self._performance_form.performance(self._editor.forecast.performance))
            self.problem = ""
        except FieldError as error:
            self.problem = str(error)
        self._show()

    def open_generator(self, selected: tuple[int, ...]) -> None:
        """Open the generator for the selected vehicles if the edited one is among them, else for that one."""
        editor = self._editor
        chosen = [vehicle for vehicle in selected if vehicle in editor.vehicles]
        if self._node.has_class("-assuming"):
            self.leave()
        self._show_class("-generating")
        self._generate_form.begin(chosen if editor.vehicle in chosen else [editor.vehicle], list(editor.shapes()))
        self.preview()

    def preview(self) -> None:
        """Show on the map what would be generated."""
        try:
            self._editor.generate_preview(self._generate_form.request())
            self.problem = ""
        except (FieldError, GeneratorError) as error:
            self._editor.drop_preview()
            self.problem = str(error)
        self._show()

    def take_generated(self) -> None:
        """Make what would be generated the draft."""
        if not self._node.has_class("-generating"):
            return
        preview = self._editor.preview
        if preview is None:
            self._feedback.report(f"nothing taken: {self.problem}", Ink.CAUTION)
            return
        request = self._generate_form.request()
        self._close_generator()
        self._editor.take(f"{request.what} over {request.over}", preview)
        self._editor.choose_vehicle(request.vehicles[0])
        self._did(f"{request.what} over {request.over} for {ids(request.vehicles)}; u takes it back")

    def leave(self) -> None:
        """Go back to the list; a preview is dropped, and a value that is not allowed is put back."""
        if self._node.has_class("-assuming"):
            self._show_class("-assuming", on=False)
            self._performance_form.display = False
        if self._node.has_class("-generating"):
            self._close_generator()
            self._editor.drop_preview()
            self._did("nothing generated")
            return
        self._work_list.focus()
        self._did("a value that was not allowed was put back" if self.problem else "")

    def _close_generator(self) -> None:
        self._show_class("-generating", on=False)
        self._generate_form.display = False
        self.problem = ""
        self._work_list.focus()

    def _show_class(self, name: str, *, on: bool = True) -> None:
        show_classes(self._node, {name: on}, [self._others[0], self._item_form, self._others[1]])
