"""The working copy behind the plan screen: a scenario's text, what was done to it, and what it was made from.

Plain: no Textual, no bus. Only text that parses as a scenario ever becomes the working copy, so what the map shows
and what is sent can be flown; everything else is answered with the reasons.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from msgspec.structs import replace

from tui_gcs.core.base.undo_history import UndoHistory, UndoStep
from tui_gcs.core.formats.bounded import data_of
from tui_gcs.core.formats.content import FormatError
from tui_gcs.core.formats.file_types import read_file
from tui_gcs.core.formats.scenario_drawings import Put, put_drawings
from tui_gcs.core.geometry.zones import Role, Zone
from tui_gcs.core.protocol.common import ScenarioChanged
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import OperatingArea, Round, Scenario, TakeOffPlace, Team
from tui_gcs.core.scenario.place_allocation import fit_places
from tui_gcs.widgets.forms.form_text import ids_text

Problems = tuple[str, ...]
"""Why a change was not taken, one line each; empty if it was."""

WHERE = "plan"
UNKNOWN_REVISION = -1
"""Of a text that the station does not fly any more."""
_PLACE = re.compile(rf"^{WHERE}: (?:(?P<path>\S+) \(line \d+\): )?")


@dataclass(frozen=True)
class Copy:
    """A scenario's text, and what it says (None: nothing is known yet)."""

    text: str = ""
    scenario: Scenario | None = field(default=None, compare=False)


class ScenarioEditor:
    """A scenario being edited. Empty (`scenario` is None) until the station's is known."""

    def __init__(self) -> None:
        self._history: UndoHistory[Copy, int] = UndoHistory(Copy())
        self.round_index = 0
        """The round that is edited; which one is flown is the station's business."""
        self.path = ""
        """Where the scenario came from, or was saved to."""
        self.base_revision = 0
        """The station's revision this copy was made from."""
        self.newer: ScenarioChanged | None = None
        """What the station flies by now, if that is not what this copy was made from."""
        self.base_text = ""
        """The station's text of that revision."""
        self.origin = ""
        """Where the station has its scenario from."""
        self._saved_text = ""
        self._sent_text = ""
        self._known_texts: set[str] = set()
        self._applied_edits = 0
        self.moved = ""
        """Who changed teams, got or lost a take-off place by the last change of a team, in words."""

    # ------------------------------------------------------------ what is there

    @property
    def text(self) -> str:
        """The copy, as it is sent and saved."""
        return self._history.draft.text

    @property
    def scenario(self) -> Scenario | None:
        """What the text says."""
        return self._history.draft.scenario

    @property
    def current_round(self) -> Round | None:
        """The edited round."""
        return self.scenario.rounds[self.round_index] if self.scenario is not None else None

    @property
    def changes(self) -> int:
        """How many steps the copy is away from what the station flies."""
        if self.text == self.base_text:
            return 0
        return max(1, abs(self._history.edits - self._applied_edits))

    @property
    def unsaved(self) -> bool:
        """Whether the copy differs from the file."""
        return self.text != self._saved_text

    def zone(self, name: str) -> Zone | None:
        """A zone of the edited round."""
        zones = self.current_round.zones if self.current_round is not None else ()
        return next((zone for zone in zones if zone.name == name), None)

    def team(self, name: str) -> Team | None:
        """A team by its name."""
        teams = self.scenario.teams if self.scenario is not None else ()
        return next((team for team in teams if team.name == name), None)

    def team_of_zone(self, zone_name: str) -> Team | None:
        """The first team that serves a zone."""
        teams = self.scenario.teams if self.scenario is not None else ()
        return next((team for team in teams if team.zone == zone_name), None)

    def common_zones(self) -> tuple[str, ...]:
        """Names of the zones that exist in every round: those a team can serve."""
        if self.scenario is None:
            return ()
        first, *others = self.scenario.rounds
        return tuple(z.name for z in first.zones if all(any(z.name == o.name for o in r.zones) for r in others))

    def knows_text(self, text: str) -> bool:
        """Whether a file's content is one this copy was made from or saved as: then it may be replaced."""
        return text in self._known_texts

    # ------------------------------------------------------------ the station

    def station_changed(self, change: ScenarioChanged) -> None:
        """The station flies this. Followed while nothing was edited; otherwise kept aside as `newer`."""
        if self.scenario is None or self.changes == 0:
            if (change.revision, change.toml) != (self.base_revision, self.base_text):
                self._take(change)
        elif change.toml in (self.text, self._sent_text):
            self.applied(change.toml, change.revision)
        elif (change.revision, change.toml) != (self.base_revision, self.base_text):
            self.newer = change
        else:
            self.newer = None

    def recover(self, text: str, base: str, flown: ScenarioChanged) -> Problems:
        """Take edits that were made from `base` before a crash; returns why not."""
        try:
            scenario = parse(text, WHERE)
        except ScenarioError as error:
            return explained(error)
        self._history.do("what was recovered", Copy(text, scenario), where=self.round_index)
        if base != self.base_text:
            self.base_revision, self.base_text, self.newer = UNKNOWN_REVISION, base, flown
        self.keep_round()
        return ()

    def sending(self) -> tuple[int, str]:
        """(base revision, text) for an apply; what is edited meanwhile stays a change."""
        self._sent_text = self.text
        self.end_field()
        return self.base_revision, self.text

    def applied(self, text: str, revision: int) -> None:
        """The station took `text`."""
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
        """Drop this copy for what the station flies by now."""
        if self.newer is not None:
            self._take(self.newer)

    def _take(self, change: ScenarioChanged) -> None:
        if self.scenario is None or self.text == self._saved_text:
            self._saved_text = change.toml
        self._history = UndoHistory(Copy(change.toml, change.scenario))
        self.path = self.path or change.path
        self.origin = change.path
        self.base_revision, self.base_text = change.revision, change.toml
        self._known_texts.add(change.toml)
        self._applied_edits = 0
        self.newer = None
        self.keep_round()

    # ------------------------------------------------------------ changes

    def select_round(self, index: int) -> bool:
        """Edit another round; False if there is none such."""
        if self.scenario is None or not 0 <= index < len(self.scenario.rounds):
            return False
        self.round_index = index
        self.end_field()
        return True

    def set_zone(self, name: str, zone: Zone, field: str = "") -> Problems:
        """Replace a zone of the edited round. A new name is taken over in all rounds and by the teams that serve it."""
        if self.zone(name) == zone:
            return ()
        index = self.round_index

        def change(document: ScenarioDocument) -> None:
            if zone.name != name and self.team_of_zone(name) is not None:
                document.rename_zone(name, zone.name)
                document.set_zone(index, zone.name, zone)
            else:
                document.set_zone(index, name, zone)

        subject = f"zone {index} name" if field == "name" else f"zone {index} {name} {field}"
        return self.edit(f"zone {name}", subject, change)

    def add_zone(self, zone: Zone) -> Problems:
        """Add a zone to the edited round."""
        index = self.round_index
        return self.edit(f"add zone {zone.name}", "", lambda document: document.add_zone(index, zone))

    def import_zones(self, path: Path) -> tuple[Problems, str]:
        """The areas of a drawing as zones, those that say nothing to be defended, in the edited round.

        Why not; or what was done.
        """
        if self.scenario is None:
            return ("no scenario yet",), ""
        scenario, index = self.scenario, self.round_index
        done: list[Put] = []
        try:
            drawn = read_file(data_of(path)).drawings
        except FormatError as error:
            return (f"{path.name}: {error}",), ""
        if not any(drawing.kind == "area" for drawing in drawn):
            return (f"{path.name}: no area is in it (KML, KMZ and GeoJSON have them)",), ""

        def change(document: ScenarioDocument) -> None:
            done.append(put_drawings(document, scenario, drawn, index, Role.DEFEND))

        problems = self.edit(f"zones of {path.name}", "", change)
        if problems:
            return problems, ""
        lost = "".join(f"; left out: {text}" for text in done[0].left_out)
        return (), f"{path.name}: {done[0].text}{lost}"

    def remove_zone(self, name: str) -> Problems:
        """Remove a zone from the edited round."""
        index = self.round_index
        return self.edit(f"delete zone {name}", "", lambda document: document.remove_zone(index, name))

    def set_area(self, area: OperatingArea, field: str = "") -> Problems:
        """Replace the edited round's operating area."""
        index = self.round_index
        if self.current_round is not None and self.current_round.area == area:
            return ()
        return self.edit("operating area", f"area {index} {field}", lambda document: document.set_area(index, area))

    def set_team(self, name: str, team: Team, field: str = "") -> Problems:
        """Replace a team: vehicles, zone, planner, parameters. A vehicle named here leaves the team that had it."""
        renamed = field == "team_name"
        subject = "team name" if renamed else f"team {name} {field}"
        if field and not renamed:
            self.retract_if(subject)  # numbers half typed took vehicles from other teams that are not meant
        self.moved = ""
        scenario = self.scenario
        if scenario is None or self.team(name) == team:
            return ()
        others = {each.name: each.vehicles for each in scenario.teams if each.name != name}
        leaving = {other: [v for v in had if v in team.vehicles] for other, had in others.items()}
        leaving = {other: gone for other, gone in leaving.items() if gone}
        for other, gone in leaving.items():
            if len(gone) == len(others[other]):
                return (f"vehicles: {ids_text(gone)} would leave nobody in team {other}",)

        flown = self._flown_places()
        kept = {other: tuple(v for v in had if v not in team.vehicles) for other, had in others.items()}
        teams = [team] + [replace(each, vehicles=kept[each.name]) for each in scenario.teams if each.name != name]

        def change(document: ScenarioDocument) -> None:
            for other in leaving:
                document.set_team(other, vehicles=kept[other])
            numbers = {"vehicles": team.vehicles} if team.vehicles else {"count": team.count}
            named = team.name if team.name != name else None
            document.set_team(
                name, name=named, zone=team.zone, planner=team.planner, parameters=team.parameters, **numbers
            )
            fit_places(document, scenario, teams, flown)

        problems = self.edit(f"team {name}", subject, change)
        if not problems and self.scenario is not None:
            moved = [f"{ids_text(gone)} from {other} to {name}" for other, gone in leaving.items()]
            self.moved = "; ".join(moved + _places_changed(scenario, self.scenario, flown))
        return problems

    def _flown_places(self) -> tuple[TakeOffPlace, ...]:
        """Where the station has everybody: who leaves a team and joins another one has not moved."""
        try:
            return parse(self.base_text, WHERE).places
        except ScenarioError:  # nothing is flown yet
            return ()

    def new_zone_name(self) -> str:
        """A name no round uses yet."""
        rounds = self.scenario.rounds if self.scenario is not None else ()
        taken = {zone.name for each in rounds for zone in each.zones}
        return next(name for number in range(1, len(taken) + 2) if (name := f"zone {number}") not in taken)

    def undo(self) -> str:
        """Take the last step back; returns what it was, empty if there was none."""
        return self._went(self._history.undo())

    def redo(self) -> str:
        """Do again what was taken back; returns what it is, empty if there was nothing."""
        return self._went(self._history.redo())

    def _went(self, step: UndoStep[Copy, int] | None) -> str:
        if step is None:
            return ""
        self.round_index = step.where or 0
        self.keep_round()
        return step.label

    def end_field(self) -> None:
        """A field was left: more changes of it are a step of their own."""
        self._history.end_subject()

    def retract(self) -> bool:
        """Take back what the open field changed: it holds a value that is not allowed, and half of one is not meant."""
        return self._history.retract()

    def retract_if(self, subject: str) -> bool:
        """Take back what was changed last, if it was about this."""
        return subject == self._history.subject and self.retract()

    def saved(self, path: Path, text: str) -> None:
        """`text` is in the file `path` now, and that is the operator's file from here on."""
        self.path = str(path)
        self._saved_text = text
        self._known_texts.add(text)
        self.end_field()

    def edit(self, label: str, subject: str, change: Callable[[ScenarioDocument], None]) -> Problems:
        """Try a change on a copy; take it over if the result is a valid scenario.

        Changes of one `subject` in a row (typing in one field) are one step.
        """
        if self.scenario is None:
            return ("no scenario yet",)
        try:
            document = ScenarioDocument(self.text)
            change(document)
            scenario = parse(document.text, WHERE)
        except ScenarioError as error:
            return explained(error)
        self._history.do(label, Copy(document.text, scenario), subject, self.round_index)
        return ()

    def keep_round(self) -> None:
        """Edit a round that is there, after some were added or taken out."""
        rounds = len(self.scenario.rounds) if self.scenario is not None else 1
        self.round_index = min(self.round_index, rounds - 1)


def _places_changed(before: Scenario, after: Scenario, flown: Sequence[TakeOffPlace]) -> list[str]:
    """Whose take-off places came and went, in words; `flown` are given back to who had them."""
    had, have = ({place.vehicle: place for place in each.places if place.vehicle} for each in (before, after))
    came = sorted(set(have) - set(had))
    back = [vehicle for vehicle in came if have[vehicle] in flown]
    went, new = sorted(set(had) - set(have)), [vehicle for vehicle in came if vehicle not in back]
    said = [
        (went, "in no team now, no take-off place"),
        (back, "take-off place and layer as before"),
        (new, "new take-off place and layer"),
    ]
    return [f"{ids_text(vehicles)}: {text}" for vehicles, text in said if vehicles]


def explained(error: ScenarioError) -> Problems:
    """The lines of an error without file name and line number, which mean nothing to who fills in a form."""
    return tuple(_PLACE.sub(_key_path, line, count=1) for line in error.problems)


def _key_path(found: re.Match[str]) -> str:
    return f"{found['path']}: " if found["path"] else ""
