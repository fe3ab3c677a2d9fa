"""The scenario that the plan screen edits: its text, the undo history, and what the station flies meanwhile.

Independent of Textual and of the bus. Only text that parses as a scenario is ever taken, so what the map shows and what
is sent can be flown; everything else is returned as reasons. Edits by subject are in `scenario_edits`.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from tui_gcs.core.base.undo_history import UndoHistory, UndoStep
from tui_gcs.core.geometry.zones import Zone
from tui_gcs.core.protocol.common import ScenarioChanged
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import Round, Scenario, Team

Problems = tuple[str, ...]
"""Why a change was not taken, one line each; empty if it was."""

WHERE = "plan"
UNKNOWN_REVISION = -1
"""The base revision of edits that were made from a text which the station does not fly any more."""
_PLACE = re.compile(rf"^{WHERE}: (?:(?P<path>\S+) \(line \d+\): )?")


@dataclass(frozen=True)
class ScenarioText:
    """A scenario's text and the scenario parsed from it; `scenario` is None while nothing is known yet."""

    text: str = ""
    scenario: Scenario | None = field(default=None, compare=False)


class ScenarioEditor:
    """A working copy of the scenario. It is empty (`scenario` is None) until the station's scenario is known."""

    def __init__(self) -> None:
        self._history: UndoHistory[ScenarioText, int] = UndoHistory(ScenarioText())
        self.round_index = 0
        """Index of the edited round; the station may be flying another one."""
        self.path = ""
        """The file that the scenario was loaded from or saved to."""
        self.base_revision = 0
        """The station's revision that this copy was made from."""
        self.newer: ScenarioChanged | None = None
        """What the station flies by now, if that differs from what this copy was made from."""
        self.base_text = ""
        """The station's text of `base_revision`."""
        self.origin = ""
        """The file that the station loaded its scenario from."""
        self._saved_text = ""
        self._sent_text = ""
        self._known_texts: set[str] = set()
        self._applied_edits = 0

    @property
    def text(self) -> str:
        """The TOML text of the working copy, as it is applied and saved."""
        return self._history.draft.text

    @property
    def scenario(self) -> Scenario | None:
        """The scenario parsed from the text."""
        return self._history.draft.scenario

    @property
    def current_round(self) -> Round | None:
        """The edited round; None while there is no scenario."""
        return self.scenario.rounds[self.round_index] if self.scenario is not None else None

    @property
    def changes(self) -> int:
        """The number of undo steps between the copy and what the station flies."""
        if self.text == self.base_text:
            return 0
        return max(1, abs(self._history.edits - self._applied_edits))

    @property
    def unsaved(self) -> bool:
        """Whether the copy differs from its file."""
        return self.text != self._saved_text

    def zone(self, name: str) -> Zone | None:
        """Return the zone of this name in the edited round."""
        zones = self.current_round.zones if self.current_round is not None else ()
        return next((zone for zone in zones if zone.name == name), None)

    def team(self, name: str) -> Team | None:
        """Return the team of this name."""
        teams = self.scenario.teams if self.scenario is not None else ()
        return next((team for team in teams if team.name == name), None)

    def team_of_zone(self, zone_name: str) -> Team | None:
        """Return the first team that serves a zone."""
        teams = self.scenario.teams if self.scenario is not None else ()
        return next((team for team in teams if team.zone == zone_name), None)

    def common_zones(self) -> tuple[str, ...]:
        """Return the names of the zones that exist in every round: only those can be served by a team."""
        if self.scenario is None:
            return ()
        first, *others = self.scenario.rounds
        return tuple(z.name for z in first.zones if all(any(z.name == o.name for o in r.zones) for r in others))

    def knows_text(self, text: str) -> bool:
        """Return whether a file with this content may be replaced: the copy was made from it or saved as it."""
        return text in self._known_texts

    def station_changed(self, change: ScenarioChanged) -> None:
        """Follow the station's new scenario while nothing was edited; otherwise keep it as `newer`."""
        if self.scenario is None or self.changes == 0:
            if (change.revision, change.toml) != (self.base_revision, self.base_text):
                self._take(change)
        # It is what this console has sent, or another console has applied the same text.
        elif change.toml in (self.text, self._sent_text):
            self.applied(change.toml, change.revision)
        elif (change.revision, change.toml) != (self.base_revision, self.base_text):
            self.newer = change
        else:
            self.newer = None

    def recover(self, text: str, base: str, flown: ScenarioChanged) -> Problems:
        """Take edits that were made from the text `base` before a crash; return why not."""
        try:
            scenario = parse(text, WHERE)
        except ScenarioError as error:
            return explained(error)
        self._history.do("what was recovered", ScenarioText(text, scenario), where=self.round_index)
        # The edits were made from a text that is not flown any more: the operator decides, as for any newer scenario.
        if base != self.base_text:
            self.base_revision, self.base_text, self.newer = UNKNOWN_REVISION, base, flown
        self.clamp_round()
        return ()

    def sending(self) -> tuple[int, str]:
        """Return (base revision, text) for an apply; edits made while it is under way remain changes."""
        self._sent_text = self.text
        self.end_field()
        return self.base_revision, self.text

    def applied(self, text: str, revision: int) -> None:
        """Note that the station flies `text` now."""
        self.base_revision, self.base_text = revision, text
        self._known_texts.add(text)
        self._applied_edits = self._history.edits
        self.end_field()
        self.newer = None

    def keep(self) -> None:
        """Stay with this copy: the next apply replaces what the station flies by now."""
        if self.newer is not None:
            self.base_revision, self.base_text = self.newer.revision, self.newer.toml
            self.newer = None

    def discard(self) -> None:
        """Replace this copy with what the station flies by now."""
        if self.newer is not None:
            self._take(self.newer)

    def _take(self, change: ScenarioChanged) -> None:
        # An operator who has saved nothing yet has the station's file as the saved one.
        if self.scenario is None or self.text == self._saved_text:
            self._saved_text = change.toml
        self._history = UndoHistory(ScenarioText(change.toml, change.scenario))
        self.path = self.path or change.path
        self.origin = change.path
        self.base_revision, self.base_text = change.revision, change.toml
        self._known_texts.add(change.toml)
        self._applied_edits = 0
        self.newer = None
        self.clamp_round()

    def select_round(self, index: int) -> bool:
        """Edit another round; return False if the index is out of range."""
        if self.scenario is None or not 0 <= index < len(self.scenario.rounds):
            return False
        self.round_index = index
        self.end_field()
        return True

    def clamp_round(self) -> None:
        """Keep `round_index` in range after rounds were added or removed."""
        rounds = len(self.scenario.rounds) if self.scenario is not None else 1
        self.round_index = min(self.round_index, rounds - 1)

    def edit(self, label: str, subject: str, change: Callable[[ScenarioDocument], None]) -> Problems:
        """Try a change on a copy; take it if the result is a valid scenario, else return the reasons.

        Consecutive changes of the same `subject` (typing in one field) are one undo step.
        """
        if self.scenario is None:
            return ("no scenario yet",)
        try:
            document = ScenarioDocument(self.text)
            change(document)
            scenario = parse(document.text, WHERE)
        except ScenarioError as error:
            return explained(error)
        self._history.do(label, ScenarioText(document.text, scenario), subject, self.round_index)
        return ()

    def undo(self) -> str:
        """Undo the last step; return its label, empty if there was none."""
        return self._show_step(self._history.undo())

    def redo(self) -> str:
        """Redo the step that was undone last; return its label, empty if there was none."""
        return self._show_step(self._history.redo())

    def _show_step(self, step: UndoStep[ScenarioText, int] | None) -> str:
        if step is None:
            return ""
        self.round_index = step.where or 0
        self.clamp_round()
        return step.label

    def end_field(self) -> None:
        """End the undo step of the field that was left: further changes of it are a new step."""
        self._history.end_subject()

    def retract(self) -> bool:
        """Take back what the open field changed: it holds an invalid value now, and half of a value is not meant."""
        return self._history.retract()

    def retract_if(self, subject: str) -> bool:
        """Take back the last change if it was about `subject`."""
        return subject == self._history.subject and self.retract()

    def saved(self, path: Path, text: str) -> None:
        """Note that the file `path` holds `text` now: it is the operator's file from here on."""
        self.path = str(path)
        self._saved_text = text
        self._known_texts.add(text)
        self.end_field()


def explained(error: ScenarioError) -> Problems:
    """Return the lines of an error without file name and line number, which mean nothing beside a form."""
    return tuple(_PLACE.sub(_key_path, line, count=1) for line in error.problems)


def _key_path(found: re.Match[str]) -> str:
    return f"{found['path']}: " if found["path"] else ""
