"""Changes of what a working copy consists of besides zones: rounds and teams. Plain, no Textual."""

from tui_gcs.core.geometry.zones import Role, Zone
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.model import Round, Team
from tui_gcs.core.scenario.place_allocation import fit_places
from tui_gcs.widgets.plan.scenario_editor import Problems, ScenarioEditor

NO_SCENARIO = ("no scenario yet",)


class EditParts:
    """Every change is one step of the working copy, or the reasons why it was not made."""

    def __init__(self, model: ScenarioEditor) -> None:
        """Of this working copy."""
        self._model = model

    # ------------------------------------------------------------ rounds

    def add_round(self) -> Problems:
        """One more, like the edited one, and edit it."""
        model, scenario = self._model, self._model.scenario
        if scenario is None:
            return NO_SCENARIO
        like, name = model.round_index, free_name("round", [r.name for r in scenario.rounds])
        problems = model.edit(f"add {name}", "", lambda document: document.add_round(like, name))
        if not problems:
            model.select_round(len(scenario.rounds))
        return problems

    def set_round(self, new: Round, field: str = "") -> Problems:
        """Name and duration of the edited round."""
        index = self._model.round_index

        def change(document: ScenarioDocument) -> None:
            document.set_round(index, name=new.name, duration_s=new.duration_s)

        return self._model.edit(f"round {index + 1}", f"round {index} {field}", change)

    def remove_round(self) -> Problems:
        """The edited one."""
        index = self._model.round_index
        problems = self._model.edit(f"delete round {index + 1}", "", lambda document: document.remove_round(index))
        self._model.keep_round()
        return problems

    def copy_zone(self, zone: Zone, indices: list[int]) -> Problems:
        """Put a zone into these rounds, in the place of the one of its name there."""
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

    # ------------------------------------------------------------ teams

    def add_team(self) -> tuple[Problems, str]:
        """One more with one vehicle that is in no team, over a zone that no other serves, if there is one; its name."""
        scenario = self._model.scenario
        if scenario is None:
            return NO_SCENARIO, ""
        taken = {vehicle for team in scenario.teams for vehicle in team.vehicles}
        vehicle = next(number for number in range(1, len(taken) + 2) if number not in taken)
        counted = any(team.count for team in scenario.teams)
        zones = self._serviceable()
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
        """With the places of its vehicles."""
        scenario = self._model.scenario
        if scenario is None:
            return NO_SCENARIO

        def change(document: ScenarioDocument) -> None:
            document.remove_team(name)
            fit_places(document, scenario, [team for team in scenario.teams if team.name != name])

        return self._model.edit(f"delete team {name}", "", change)

    def _serviceable(self) -> list[str]:
        """Zones of every round that nobody may be kept out of; the file has at least one, since teams are there."""
        current, common = self._model.current_round, self._model.common_zones()
        zones = current.zones if current is not None else ()
        return [zone.name for zone in zones if zone.name in common and zone.role is not Role.NO_FLY]


def free_name(stem: str, taken: list[str], first: int = 2, gap: str = " ") -> str:
    """The stem and the lowest number from `first` on that no other has."""
    return next(name for n in range(first, first + len(taken) + 1) if (name := f"{stem}{gap}{n}") not in taken)
