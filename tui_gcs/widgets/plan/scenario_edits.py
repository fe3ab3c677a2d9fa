"""Edits of an edited scenario, by subject: zones, rounds, teams. Independent of Textual.

Every edit is one undo step of the `ScenarioEditor`, or it returns the reasons why it was not made.
"""

from collections.abc import Sequence
from pathlib import Path

from msgspec.structs import replace

from tui_gcs.core.formats.bounded import data_of
from tui_gcs.core.formats.content import FormatError
from tui_gcs.core.formats.file_types import read_file
from tui_gcs.core.formats.scenario_drawings import ZoneImport, put_drawings
from tui_gcs.core.geometry.zones import Role, Zone
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import OperatingArea, Scenario, TakeOffPlace, Team
from tui_gcs.core.scenario.place_allocation import fit_places
from tui_gcs.widgets.forms.form_text import ids_text
from tui_gcs.widgets.plan.scenario_editor import WHERE, Problems, ScenarioEditor

NO_SCENARIO = ("no scenario yet",)


class ZoneEdits:
    """Edits of the zones and the operating area of the edited round."""

    def __init__(self, model: ScenarioEditor) -> None:
        self._model = model

    def set_zone(self, name: str, zone: Zone, field: str = "") -> Problems:
        """Replace a zone of the edited round; a new name is also set in the teams and rounds that use the old one.

        `field` is the form field that is being typed into: typing in one field is one undo step.
        """
        model, index = self._model, self._model.round_index
        if model.zone(name) == zone:
            return ()

        def change(document: ScenarioDocument) -> None:
            # A team's zone exists in every round: the name changes in all of them, or the scenario would not be valid.
            if zone.name != name and model.team_of_zone(name) is not None:
                document.rename_zone(name, zone.name)
                document.set_zone(index, zone.name, zone)
            else:
                document.set_zone(index, name, zone)

        subject = f"zone {index} name" if field == "name" else f"zone {index} {name} {field}"
        return model.edit(f"zone {name}", subject, change)

    def add_zone(self, zone: Zone) -> Problems:
        """Add a zone to the edited round."""
        index = self._model.round_index
        return self._model.edit(f"add zone {zone.name}", "", lambda document: document.add_zone(index, zone))

    def import_zones(self, path: Path) -> tuple[Problems, str]:
        """Add the areas in a file (KML, KMZ, GeoJSON) to the edited round, as zones to defend where no role is given.

        Returns the reasons why nothing was imported, or () and a line that reports what was.
        """
        scenario, index = self._model.scenario, self._model.round_index
        if scenario is None:
            return NO_SCENARIO, ""
        done: list[ZoneImport] = []
        try:
            drawn = read_file(data_of(path), path=path).drawings
        except FormatError as error:
            return (f"{path.name}: {error}",), ""
        if not any(drawing.kind == "area" for drawing in drawn):
            return (f"{path.name}: no area is in it (KML, KMZ and GeoJSON have them)",), ""

        def change(document: ScenarioDocument) -> None:
            done.append(put_drawings(document, scenario, drawn, index, Role.DEFEND))

        problems = self._model.edit(f"zones of {path.name}", "", change)
        if problems:
            return problems, ""
        lost = "".join(f"; left out: {text}" for text in done[0].left_out)
        return (), f"{path.name}: {done[0].text}{lost}"

    def remove_zone(self, name: str) -> Problems:
        """Remove a zone from the edited round."""
        index = self._model.round_index
        return self._model.edit(f"delete zone {name}", "", lambda document: document.remove_zone(index, name))

    def copy_zone(self, zone: Zone, indices: list[int]) -> Problems:
        """Put a zone into the rounds at `indices`; it replaces the zone of the same name there."""
        model, scenario = self._model, self._model.scenario
        if scenario is None:
            return NO_SCENARIO

        def change(document: ScenarioDocument) -> None:
            for index in indices:
                if any(there.name == zone.name for there in scenario.rounds[index].zones):
                    document.set_zone(index, zone.name, zone)
                else:
                    document.add_zone(index, zone)

        return model.edit(f"copy zone {zone.name}", "", change)

    def set_area(self, area: OperatingArea, field: str = "") -> Problems:
        """Replace the operating area of the edited round."""
        model, index = self._model, self._model.round_index
        if model.current_round is not None and model.current_round.area == area:
            return ()
        return model.edit("operating area", f"area {index} {field}", lambda document: document.set_area(index, area))

    def new_name(self) -> str:
        """Return a zone name that is not used in any round."""
        rounds = self._model.scenario.rounds if self._model.scenario is not None else ()
        taken = {zone.name for each in rounds for zone in each.zones}
        return next(name for number in range(1, len(taken) + 2) if (name := f"zone {number}") not in taken)


class RoundEdits:
    """Edits of the list of rounds."""

    def __init__(self, model: ScenarioEditor) -> None:
        self._model = model

    def add_round(self) -> Problems:
        """Add a copy of the edited round at the end, and select it."""
        model, scenario = self._model, self._model.scenario
        if scenario is None:
            return NO_SCENARIO
        like, name = model.round_index, free_name("round", [r.name for r in scenario.rounds])
        problems = model.edit(f"add {name}", "", lambda document: document.add_round(like, name))
        if not problems:
            model.select_round(len(scenario.rounds))
        return problems

    def remove_round(self) -> Problems:
        """Remove the edited round; the next one is edited then."""
        index = self._model.round_index
        problems = self._model.edit(f"delete round {index + 1}", "", lambda document: document.remove_round(index))
        self._model.clamp_round()
        return problems


class TeamEdits:
    """Edits of teams, and of the take-off places that follow from them."""

    def __init__(self, model: ScenarioEditor) -> None:
        self._model = model
        self.moved = ""
        """A line for the operator: vehicles that changed teams or take-off places by the last `set_team`."""

    def set_team(self, name: str, team: Team, field: str = "") -> Problems:
        """Replace a team: vehicles, zone, planner, parameters. A vehicle listed here leaves the team that had it."""
        model = self._model
        renamed = field == "team_name"
        subject = "team name" if renamed else f"team {name} {field}"
        if field and not renamed:
            # While "12" is typed, the "1" has already taken vehicle 1 from its team, which the operator did not mean.
            model.retract_if(subject)
        self.moved = ""
        scenario = model.scenario
        if scenario is None or model.team(name) == team:
            return ()
        others = {each.name: each.vehicles for each in scenario.teams if each.name != name}
        leaving = {other: [v for v in had if v in team.vehicles] for other, had in others.items()}
        leaving = {other: gone for other, gone in leaving.items() if gone}
        for other, gone in leaving.items():
            # A scenario with a team without vehicles is not valid, and the reason would name the other team.
            if len(gone) == len(others[other]):
                return (f"vehicles: {ids_text(gone)} would leave no vehicle in team {other}",)

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

        problems = model.edit(f"team {name}", subject, change)
        if not problems and model.scenario is not None:
            moved = [f"{ids_text(gone)} from {other} to {name}" for other, gone in leaving.items()]
            self.moved = "; ".join(moved + _changed_places(scenario, model.scenario, flown))
        return problems

    def add_team(self) -> tuple[Problems, str]:
        """Add a team of one free vehicle and return its name; it serves a zone without a team if there is one."""
        scenario = self._model.scenario
        if scenario is None:
            return NO_SCENARIO, ""
        taken = {vehicle for team in scenario.teams for vehicle in team.vehicles}
        vehicle = next(number for number in range(1, len(taken) + 2) if number not in taken)
        counted = any(team.count for team in scenario.teams)
        zones = self._serviceable_zones()
        served = {team.zone for team in scenario.teams}
        zone = next((name for name in zones if name not in served), zones[0])
        name = free_name("team", [team.name for team in scenario.teams], len(scenario.teams) + 1, "-")
        vehicles, count = ((), 1) if counted else ((vehicle,), 0)
        team = Team(name, zone, scenario.teams[0].planner, vehicles, count)

        def change(document: ScenarioDocument) -> None:
            document.add_team(team)
            fit_places(document, scenario, [*scenario.teams, team])

        return self._model.edit(f"add {name}", "", change), name

    def remove_team(self, name: str) -> Problems:
        """Remove a team, with the take-off places of its vehicles."""
        scenario = self._model.scenario
        if scenario is None:
            return NO_SCENARIO

        def change(document: ScenarioDocument) -> None:
            document.remove_team(name)
            fit_places(document, scenario, [team for team in scenario.teams if team.name != name])

        return self._model.edit(f"delete team {name}", "", change)

    def _flown_places(self) -> tuple[TakeOffPlace, ...]:
        # A vehicle that leaves a team and joins another has not moved on the ground: it gets its old place back.
        try:
            return parse(self._model.base_text, WHERE).places
        except ScenarioError:  # nothing is flown yet
            return ()

    def _serviceable_zones(self) -> list[str]:
        """Return the zones of every round that are not no-fly; never empty, since each existing team serves one."""
        current, common = self._model.current_round, self._model.common_zones()
        zones = current.zones if current is not None else ()
        return [zone.name for zone in zones if zone.name in common and zone.role is not Role.NO_FLY]


def _changed_places(before: Scenario, after: Scenario, flown: Sequence[TakeOffPlace]) -> list[str]:
    """Describe which vehicles lost, regained (`flown`) or got take-off places."""
    had, have = ({place.vehicle: place for place in each.places if place.vehicle} for each in (before, after))
    came = sorted(set(have) - set(had))
    back = [vehicle for vehicle in came if have[vehicle] in flown]
    went, new = sorted(set(had) - set(have)), [vehicle for vehicle in came if vehicle not in back]
    parts = [
        (went, "in no team now, no take-off place"),
        (back, "take-off place and layer as before"),
        (new, "new take-off place and layer"),
    ]
    return [f"{ids_text(vehicles)}: {text}" for vehicles, text in parts if vehicles]


def free_name(stem: str, taken: list[str], first: int = 2, gap: str = " ") -> str:
    """Return `stem` with the lowest number from `first` on that makes a name which is not in `taken`."""
    return next(name for n in range(first, first + len(taken) + 1) if (name := f"{stem}{gap}{n}") not in taken)
