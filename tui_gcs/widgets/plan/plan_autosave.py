"""An edited scenario kept against crashes, while neither the station nor a file has it. Plain, no Textual."""

from pathlib import Path

import msgspec

from tui_gcs.core.base.autosave import Autosave
from tui_gcs.core.protocol.common import ScenarioChanged
from tui_gcs.core.scenario.load import MAX_BYTES
from tui_gcs.widgets.plan.scenario_editor import ScenarioEditor

MOST_BYTES = 4 * MAX_BYTES
"""Two texts, and what JSON makes of odd characters."""


class Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is in the file."""

    scenario: str
    """Where it came from."""
    base: str
    """The text that the station flew when it was edited."""
    text: str


class PlanAutosave:
    """Of one working copy; nothing is kept before `recover`."""

    def __init__(self, model: ScenarioEditor, folder: Path | None) -> None:
        """In `folder`, nowhere if that is None."""
        self._model = model
        self._folder = folder
        self._autosave: Autosave | None = None
        self._kept = ""

    def recover(self, flown: ScenarioChanged) -> str:
        """Take what a crash left of the scenario that the station flies; in words, empty if nothing.

        Raises FileRefused: nothing is kept from here on.
        """
        if self._folder is None:
            return ""
        self._autosave = Autosave(self._folder, "plan")
        data = self._autosave.read(MOST_BYTES)
        if data is None:
            return ""
        try:
            kept = msgspec.json.decode(data, type=Kept)
        except msgspec.MsgspecError as error:
            return f"what a crash left cannot be read ({error}): it is in {self._autosave.set_aside(data)}"
        if kept.scenario != flown.path:
            return f"a crash left edits of {kept.scenario}: they are in {self._autosave.set_aside(data)}"
        problems = self._model.recover(kept.text, kept.base, flown)
        if problems:
            return f"what a crash left is no scenario ({problems[0]}): it is in {self._autosave.set_aside(data)}"
        self._kept = kept.text
        return "recovered: edits that were neither applied nor saved; u drops them"

    @property
    def is_behind(self) -> bool:
        """Whether something else is to be kept than is."""
        return self._autosave is not None and self._work != self._kept

    @property
    def _work(self) -> str:
        return self._model.text if self._model.changes and self._model.unsaved else ""

    def keep(self) -> None:
        """Have the edits there after a crash, or nothing if there are none. Raises FileRefused."""
        model, work = self._model, self._work
        if self._autosave is None or work == self._kept:
            return
        if work:
            self._autosave.write(msgspec.json.encode(Kept(model.origin, model.base_text, work)))
        else:
            self._autosave.forget()
        self._kept = work

    def close(self) -> None:
        """The console ends; what is kept waits for the next one."""
        if self._autosave is not None:
            self._autosave.close()
            self._autosave = None
