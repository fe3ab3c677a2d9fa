"""Saving: to the working copy's own file at once, else one line that asks for a path."""

from textual import on
from textual.message import Message
from textual.widgets import Input

from tui_gcs.widgets.drafts.save_flow import SaveFlow, SaveNext, SaveStep, WorkingCopy
from tui_gcs.widgets.forms.prompt_bar import PathBar


class SaveBar(PathBar):
    """Says what became of it."""

    class Said(Message):
        """What became of it, in a line for the operator; `closed`: the cursor is not needed here any more."""

        def __init__(self, step: SaveStep, *, closed: bool) -> None:
            super().__init__()
            self.step = step
            self.closed = closed

    def __init__(self, model: WorkingCopy, name: str) -> None:
        """For this working copy, to be called `name` where it has none; hidden."""
        self._flow = SaveFlow(model, name)
        super().__init__()

    def save(self) -> None:
        """To its own file, or ask where."""
        if self.is_open:
            self._field.focus()
            return
        step = self._flow.save()
        if step.what is SaveNext.ASK_PATH:
            self.open("Save as", step.suggestion)
        self.post_message(self.Said(step, closed=False))

    @property
    def asks(self) -> bool:
        """Whether a second press would overwrite a file."""
        return self._flow.asks

    def forget(self) -> None:
        """Something else was done: a question that waited for its second press is over."""
        self._flow.forget()

    def answered(self, typed: str) -> None:
        """To this one."""
        step = self._flow.save_as(typed)
        done = step.what is SaveNext.DONE
        if done:
            self.close()
        self.post_message(self.Said(step, closed=done))

    def action_cancel(self) -> None:
        """Nowhere."""
        self.close()
        self._flow.forget()
        self.post_message(self.Said(SaveStep(SaveNext.FAILED, "not saved"), closed=True))

    @on(Input.Changed)
    def _changed(self, event: Input.Changed) -> None:
        event.stop()
        self._flow.forget()
