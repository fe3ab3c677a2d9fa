"""Changes of a scenario by options of one flight: another planner, other parameters, another number of vehicles.

The scenario's file stays as it is. The changes are made in its text, so what is flown is a scenario like any other.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.planning import ParamInfo, ParamValue, PlannerInfo
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.fields import nearest
from tui_gcs.core.scenario.lines import find_line, map_lines
from tui_gcs.core.scenario.load import MAX_VEHICLES, ScenarioError, parse
from tui_gcs.core.scenario.model import Instances, Scenario, Team
from tui_gcs.core.scenario.place_allocation import fit_places
from tui_gcs.planner.runtime import registry

YES, NO = ("true", "yes", "on", "1"), ("false", "no", "off", "0")
MAX_CELLS = 400


@dataclass(frozen=True)
class ScenarioChanges:
    """What the options of one flight change in its scenario."""

    planners: Mapping[str, PlannerInfo]
    """Planners in files, by name."""
    named: tuple[str, ...] = ()
    """Known planners that were given by name instead of a file."""
    settings: tuple[str, ...] = ()
    """NAME=VALUE of planners' parameters."""
    vehicles: int | None = None
    """The number of vehicles of all teams together."""
    instances: Instances | None = None
    """Whether planners run once for a team or once on each vehicle; None: as scenario and planners have it."""

    def made(self, toml: str, where: str) -> tuple[Scenario, str]:
        """Return the changed scenario and its text. Raises `CommandError` with one line for each mistake."""
        known = {*registry.names(), *self.planners}
        try:
            document = ScenarioDocument(toml)
            scenario = parse(toml, where)
            self._set_planner(document, scenario.teams)
            scenario = parse(document.text, where, known)
            self._set_parameters(document, scenario.teams)
            if self.instances is not None:
                self._set_instances(document, scenario.teams, self.instances)
            if self.vehicles is not None:
                self._set_vehicles(document, scenario, self.vehicles)
            scenario = parse(document.text, where, known)
        except ScenarioError as error:
            raise CommandError("; ".join(str(error).splitlines())) from None
        require_fit(scenario, document.text, where, self.planners)
        return scenario, document.text

    def _set_planner(self, document: ScenarioDocument, teams: Collection[Team]) -> None:
        """Let one planner that no team names fly all teams; a team's parameters are for the planner that it names."""
        given = [*self.planners, *self.named]
        if not given or any(team.planner in given for team in teams):
            return
        if len(given) > 1:
            raise CommandError(f"--planner: no team of this scenario names {' or '.join(given)}: give only one of them")
        for team in teams:
            document.set_team(team.name, planner=given[0], parameters={})

    def _set_parameters(self, document: ScenarioDocument, teams: Collection[Team]) -> None:
        infos = {team.name: info for team in teams if (info := self._info(team.planner)) is not None}
        for setting in self.settings:
            name, equals, text = setting.partition("=")
            if not equals or not name:
                raise CommandError(f"--set {clean(setting, MAX_CELLS)}: must be NAME=VALUE")
            takers = [team for team in teams if team.name in infos and _param(infos[team.name], name) is not None]
            if not takers:
                params = {param.name for info in infos.values() for param in info.params}
                takes = "; ".join(dict.fromkeys(_takes(info) for info in infos.values()))
                raise CommandError(f"--set {clean(name, 40)}: no such parameter{nearest(name, params)}; {takes}")
            for team in takers:
                value = _value(setting, infos[team.name], name, text)
                now = next(t for t in parse(document.text).teams if t.name == team.name)
                document.set_team(team.name, parameters=now.parameters | {name: value})

    def _set_instances(self, document: ScenarioDocument, teams: Collection[Team], instances: Instances) -> None:
        """Of the planners that were given, or of all where none was."""
        given = {*self.planners, *self.named} or {team.planner for team in teams}
        for team in teams:
            if team.planner in given:
                document.set_team(team.name, instances=instances)

    def _info(self, planner: str) -> PlannerInfo | None:
        return self.planners.get(planner) or registry.infos({planner}).get(planner)

    def _set_vehicles(self, document: ScenarioDocument, scenario: Scenario, count: int) -> None:
        """Share `count` vehicles among the teams as they share them now, each with a take-off place."""
        teams = scenario.teams
        if not len(teams) <= count <= MAX_VEHICLES:
            raise CommandError(f"--vehicles {count}: must be {len(teams)} (one for each team) to {MAX_VEHICLES}")
        sizes = shares(count, [team.size for team in teams])
        taken = {vehicle for team in teams for vehicle in team.vehicles}
        free = iter(v for v in range(1, MAX_VEHICLES + 1 + len(taken)) if v not in taken)
        changed = []
        for team, size in zip(teams, sizes, strict=True):
            if not team.vehicles:
                document.set_team(team.name, count=size)
                changed.append(Team(team.name, team.zone, team.planner, (), size, team.parameters))
                continue
            ids = (*team.vehicles[:size], *(next(free) for _ in range(size - len(team.vehicles))))
            document.set_team(team.name, vehicles=ids)
            changed.append(Team(team.name, team.zone, team.planner, ids, 0, team.parameters))
        try:
            fit_places(document, scenario, changed)
        except ScenarioError as error:
            raise CommandError(f"--vehicles {count}: {error}") from None


def shares(count: int, sizes: list[int]) -> list[int]:
    """Return `count` divided as `sizes` are, with at least one in each part; whole numbers, the largest rests first."""
    exact = [(count - len(sizes)) * size / sum(sizes) for size in sizes]
    found = [1 + int(share) for share in exact]
    by_rest = sorted(range(len(sizes)), key=lambda i: int(exact[i]) - exact[i])
    for i in by_rest[: count - sum(found)]:
        found[i] += 1
    return found


def require_fit(scenario: Scenario, toml: str, where: str, planners: Mapping[str, PlannerInfo]) -> None:
    """Raise `CommandError` for parameters and gates that no planner of the scenario declares, with file and line."""
    if found := [*wrong_parameters(scenario, toml, planners), *wrong_gates(scenario, toml, planners)]:
        raise CommandError("\n".join(f"{clean(where, MAX_CELLS)}: {problem}" for problem in found))


def wrong_parameters(scenario: Scenario, toml: str, planners: Mapping[str, PlannerInfo]) -> list[str]:
    """Return a line, with its place in the file, for each parameter that its team's planner does not take so."""
    infos = registry.infos({team.planner for team in scenario.teams} - set(planners)) | dict(planners)
    found = []
    for number, team in enumerate(scenario.teams, 1):
        if (info := infos.get(team.planner)) is None:
            continue
        for name, value in team.parameters.items():
            for problem in info.problems({name: value}):
                near = nearest(name, {param.name for param in info.params}) if _param(info, name) is None else ""
                found.append(f"{_at(toml, f'team[{number}].parameters.{name}')}: planner {info.name}: {problem}{near}")
    return found


def _at(toml: str, path: str) -> str:
    """Return a key's path with its line, where it has one."""
    line = find_line(map_lines(toml), path)
    return f"{path} (line {line})" if line is not None else path


def wrong_gates(scenario: Scenario, toml: str, planners: Mapping[str, PlannerInfo]) -> list[str]:
    """Return a line, with its place in the file, for each gate whose metric no planner of the scenario declares."""
    if not scenario.results.metrics:
        return []
    from tui_gcs.core.judging.metric_log import gate_problems

    infos = registry.infos({team.planner for team in scenario.teams} - set(planners)) | dict(planners)
    return [f"{_at(toml, f'results.metrics.{gate}')}: {problem}" for gate, problem in gate_problems(scenario, infos)]


def _param(info: PlannerInfo, name: str) -> ParamInfo | None:
    return next((param for param in info.params if param.name == name), None)


def _takes(info: PlannerInfo) -> str:
    return f"{info.name} has {', '.join(param.name for param in info.params) or 'no parameters'}"


def _value(setting: str, info: PlannerInfo, name: str, text: str) -> ParamValue:
    """Return the value that `text` means for a parameter. Raises `CommandError`."""
    param = _param(info, name)
    assert param is not None  # noqa: S101 - the caller has looked it up
    value: ParamValue = text
    try:
        if param.type in ("int", "float"):
            value = int(text) if param.type == "int" else float(text)
        elif param.type == "bool" and text.lower() in (*YES, *NO):
            value = text.lower() in YES
    except ValueError:
        pass  # the declaration says below what it must be
    if problem := param.problem(value):
        what = f" (planner {info.name})"
        raise CommandError(f"--set {clean(setting, MAX_CELLS)}: {problem}{what}")
    return value
