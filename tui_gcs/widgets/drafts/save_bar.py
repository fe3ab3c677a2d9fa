"""The prompt for saving: to the working copy's own file at once, else to a path that it asks for."""

from textual import on
from textual.message import Message
from textual.widgets import Input

from tui_gcs.widgets.drafts.save_flow import SaveFlow, SaveNext, SaveStep, WorkingCopy
from tui_gcs.widgets.forms.prompt_bar import PromptBar


class SaveBar(PromptBar):
    """Runs a `SaveFlow` with a prompt and posts the outcome of each step."""

    class StepDone(Message):
        """The outcome of one key press, with a line for the operator; `closed` if the prompt was closed by it."""

        def __init__(self, step: SaveStep, *, closed: bool) -> None:
            super().__init__()
            self.step = step
            self.closed = closed

    def __init__(self, model: WorkingCopy, name: str) -> None:
        self._flow = SaveFlow(model, name)
        super().__init__()

    def save(self) -> None:
        """Save to the working copy's own file, or ask for a path."""
        if self.is_open:
            self._field.focus()
            return
        step = self._flow.save()
        if step.what is SaveNext.ASK_PATH:
            self.ask("Save as", step.suggestion)
        self.post_message(self.StepDone(step, closed=False))

    @property
    def is_confirming(self) -> bool:
        """Whether the next press would overwrite a file."""
        return self._flow.is_confirming

    def forget(self) -> None:
        """End a question that waits for its second press: something else was done."""
        self._flow.forget()

    def submit(self, text: str) -> None:
        """Save to the path that was typed; stay open if that failed or needs a second press."""
        step = self._flow.save_as(text)
        done = step.what is SaveNext.DONE
        if done:
            self.close()
        self.post_message(self.StepDone(step, closed=done))

    def action_cancel(self) -> None:
        """Close without saving, on Esc."""
        self.close()
        self._flow.forget()
        self.post_message(self.StepDone(SaveStep(SaveNext.FAILED, "not saved"), closed=True))

    @on(Input.Changed)
    def _changed(self, event: Input.Changed) -> None:
        event.stop()
        self._flow.forget()
