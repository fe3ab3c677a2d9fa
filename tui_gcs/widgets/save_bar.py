"""Saving: to the scenario's own file at once, else one line that asks for a path."""

from textual import on
from textual.binding import Binding
from textual.containers import Horizontal
from textual.message import Message
from textual.widgets import Input, Static

from tui_gcs.widgets.form import FormField
from tui_gcs.widgets.save_flow import SaveFlow, SaveNext, SaveStep, WorkingCopy


class SaveBar(Horizontal):
    """Hidden until a path is needed; then Enter answers and Esc forgets."""

    DEFAULT_CSS = """
    SaveBar { height: 1; display: none; background: $surface; }
    SaveBar.-open { display: block; }
    SaveBar > Static { width: auto; padding: 0 1; text-style: bold; }
    """
    BINDINGS = [Binding("escape", "close", "cancel", show=False, priority=True)]

    class Said(Message):
        """What became of it, in a line for the operator; `closed`: the cursor is not needed here any more."""

        def __init__(self, step: SaveStep, *, closed: bool) -> None:
            super().__init__()
            self.step = step
            self.closed = closed

    def __init__(self, model: WorkingCopy, name: str = "scenario.toml") -> None:
        """For this working copy, to be called `name` where it has none; hidden."""
        self._flow = SaveFlow(model, name)
        self._field = PathField("path")
        super().__init__(Static("Save as", markup=False), self._field)

    @property
    def is_open(self) -> bool:
        """Whether a path is asked for."""
        return self.has_class("-open")

    def save(self) -> None:
        """To the scenario's own file, or ask where."""
        if self.is_open:
            self._field.focus()
            return
        step = self._flow.save()
        if step.what is SaveNext.ASK_PATH:
            self.add_class("-open")
            self._field.show(step.suggestion)
            self._field.focus()
        self.post_message(self.Said(step, closed=False))

    @property
    def asks(self) -> bool:
        """Whether a second press would overwrite a file."""
        return self._flow.asks

    def forget(self) -> None:
        """Something else was done: a question that waited for its second press is over."""
        self._flow.forget()

    def action_close(self) -> None:
        """Esc."""
        self.remove_class("-open")
        self._flow.forget()
        self.post_message(self.Said(SaveStep(SaveNext.FAILED, "not saved"), closed=True))

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        event.stop()
        step = self._flow.save_as(event.value)
        if step.what is SaveNext.DONE:
            self.remove_class("-open")
        self.post_message(self.Said(step, closed=step.what is SaveNext.DONE))

    @on(Input.Changed)
    def _changed(self, event: Input.Changed) -> None:
        event.stop()
        self._flow.forget()


class PathField(FormField):
    """Enter answers instead of going on."""

    BINDINGS = [Binding("enter", "submit", "save", show=False)]
