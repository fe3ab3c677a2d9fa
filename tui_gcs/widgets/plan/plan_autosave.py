"""An edited scenario kept against a crash, while neither the station nor a file has it. Independent of Textual."""

from pathlib import Path

import msgspec

from tui_gcs.core.base.autosave import Autosave
from tui_gcs.core.protocol.common import ScenarioChanged
from tui_gcs.core.scenario.load import MAX_BYTES
from tui_gcs.widgets.plan.scenario_editor import ScenarioEditor

MAX_KEPT_BYTES = 4 * MAX_BYTES
"""Room for two texts, and for the escapes that JSON makes of non-ASCII characters."""


class KeptPlan(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of the file."""

    scenario: str
    """The file that the station had loaded its scenario from."""
    base: str
    """The text that the station flew when the edits were made."""
    text: str


class PlanAutosave:
    """Keeps the edits of one working copy; nothing is kept before `recover`."""

    def __init__(self, model: ScenarioEditor, folder: Path | None) -> None:
        """Keep in `folder`, or nowhere if that is None."""
        self._model = model
        self._folder = folder
        self._autosave: Autosave | None = None
        self._kept = ""

    def recover(self, flown: ScenarioChanged) -> str:
        """Take the edits that a crash left of the scenario that the station flies; return a line about it, or "".

        Raises FileRefused; then nothing is kept from here on.
        """
        if self._folder is None:
            return ""
        self._autosave = Autosave(self._folder, "plan")
        data = self._autosave.read(MAX_KEPT_BYTES)
        if data is None:
            return ""
        try:
            kept = msgspec.json.decode(data, type=KeptPlan)
        except msgspec.MsgspecError as error:
            return f"what a crash left cannot be read ({error}): it is in {self._autosave.set_aside(data)}"
        # Edits of another scenario file are kept for the operator, not mixed into this one.
        if kept.scenario != flown.path:
            return f"a crash left edits of {kept.scenario}: they are in {self._autosave.set_aside(data)}"
        problems = self._model.recover(kept.text, kept.base, flown)
        if problems:
            return f"what a crash left is no scenario ({problems[0]}): it is in {self._autosave.set_aside(data)}"
        self._kept = kept.text
        return "recovered: edits that were neither applied nor saved; u drops them"

    @property
    def is_behind(self) -> bool:
        """Whether the file differs from what is to be kept."""
        return self._autosave is not None and self._work != self._kept

    @property
    def _work(self) -> str:
        return self._model.text if self._model.changes and self._model.unsaved else ""

    def keep(self) -> None:
        """Write the edits to the file, or remove it if there are none. Raises FileRefused."""
        model, work = self._model, self._work
        if self._autosave is None or work == self._kept:
            return
        if work:
            self._autosave.write(msgspec.json.encode(KeptPlan(model.origin, model.base_text, work)))
        else:
            self._autosave.forget()
        self._kept = work

    def close(self) -> None:
        """Release the file: the next console recovers from it."""
        if self._autosave is not None:
            self._autosave.close()
            self._autosave = None
