"""Which zone and team are in the forms, and why a typed value was not taken. Independent of Textual.

`PlanDraft` stands between the forms, which know texts only, and the `ScenarioEditor`, which knows valid scenarios only.
"""

from collections.abc import Mapping

import msgspec

from tui_gcs.core.geometry.zones import Circle, Role, Shape, Zone
from tui_gcs.core.protocol.planning import TYPES, ParamInfo, PlannerInfo
from tui_gcs.core.scenario.model import OperatingArea, Team
from tui_gcs.planner.api import Param
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.planner_errors import PlannerError
from tui_gcs.widgets.forms.form_text import FieldError
from tui_gcs.widgets.plan.forms.settings_draft import SettingsDraft
from tui_gcs.widgets.plan.forms.team_text import TeamText, to_team
from tui_gcs.widgets.plan.forms.zone_text import AREA_NAME, ZoneText, to_area, to_zone
from tui_gcs.widgets.plan.scenario_editor import Problems, ScenarioEditor
from tui_gcs.widgets.plan.scenario_edits import RoundEdits, TeamEdits, ZoneEdits, free_name
from tui_gcs.widgets.plan.shape_edit import centre_of, moved

NEW_RADIUS_M = 30.0
"""The radius of a new zone, which is a circle."""
NO_AREA = "the operating area stays: every round has one"
DUPLICATE_OFFSETS_M = ((20.0, -20.0), (-20.0, 20.0), (0.0, 0.0))
"""Where a duplicate is tried, east and north of the original, in this order."""
DUPLICATED_CHARS = 28
"""A name has at most 32 characters; a blank and a number are appended to a duplicate's."""


class PlanDraft:
    """The zone and the team that are in the forms, and the problems of what was typed."""

    def __init__(self, model: ScenarioEditor) -> None:
        self.model = model
        self.zones = ZoneEdits(model)
        self.rounds = RoundEdits(model)
        self.teams = TeamEdits(model)
        self.settings = SettingsDraft(model)
        self.zone_name: str | None = None
        """The edited zone; None stands for the operating area."""
        self.team_name = ""
        self.files: Mapping[str, PlannerInfo] = {}
        """Planners from files of the operator, with the parameters that the station reported for them."""
        self.pending: Zone | OperatingArea | None = None
        """The edited zone or area with a shape that is not allowed; None while everything shown is valid."""
        self._installed = registry.names()  # looked up once: it takes milliseconds
        self._zone_problems: Problems = ()
        self._team_problems: Problems = ()
        self._field = ""
        self._name_before: str | None = None
        self._team_before = ""

    @property
    def problems(self) -> Problems:
        """Why values in the forms are not in the working copy, one line each."""
        return (*self._zone_problems, *self._team_problems, *self.settings.problems)

    @property
    def zone(self) -> Zone | None:
        """The zone in the form; None if the operating area is."""
        return self.model.zone(self.zone_name) if self.zone_name is not None else None

    @property
    def edited(self) -> Zone | OperatingArea | None:
        """The zone or operating area in the zone form; None while there is no scenario."""
        current = self.model.current_round
        return self.zone or (current.area if current is not None else None)

    @property
    def team(self) -> Team | None:
        """The team in the team form; None while there is none."""
        scenario = self.model.scenario
        if scenario is None or not scenario.teams:
            return None
        return self.model.team(self.team_name) or scenario.teams[0]

    def choose_zone(self, name: str | None) -> None:
        """Put a zone (None: the operating area) into the form, and the team that serves it."""
        self.zone_name = name if name is not None and self.model.zone(name) is not None else None
        team = self.model.team_of_zone(self.zone_name) if self.zone_name is not None else None
        self.team_name = team.name if team is not None else self.team_name
        self.end_field()

    def end_field(self) -> None:
        """End the undo step of the field that was left."""
        self._field = ""
        self.model.end_field()

    def choose_first(self) -> None:
        """Put the first zone of the round into the form."""
        current = self.model.current_round
        self.choose_zone(current.zones[0].name if current is not None and current.zones else None)

    def refilled(self) -> None:
        """Drop the problems: the forms show the working copy again. A zone or team that is gone is replaced."""
        self._zone_problems = self._team_problems = ()
        self.pending = None
        self.settings.refilled()
        if self.zone is None:
            self.zone_name = None
        team = self.team
        self.team_name = team.name if team is not None else ""

    def zone_typed(self, texts: ZoneText, field: str) -> None:
        """Take the texts of the zone form into the working copy, or note the problems."""
        old = self.edited
        if old is None:
            return
        if field != self._field:
            self._field, self._name_before = field, self.zone_name
        try:
            new = to_zone(texts, old) if isinstance(old, Zone) else to_area(texts, old)
            self.replace(new, field)
        except FieldError as error:
            self._zone_problems, self.pending = self._located((str(error),)), None
        # The name that was typed until now is gone with its undo step.
        if self._zone_problems and self.model.retract():
            self.zone_name = self._name_before

    def replace(self, new: Zone | OperatingArea, field: str = "") -> None:
        """Replace the edited zone or area; one that is not allowed becomes `pending`, and the problems are noted."""
        if isinstance(new, OperatingArea):
            problems = self.zones.set_area(new, field)
        else:
            problems = self.zones.set_zone(self.zone_name or "", new, field)
            self.zone_name = new.name if not problems else self.zone_name
        self._zone_problems, self.pending = self._located(problems), new if problems else None

    def _located(self, problems: Problems) -> Problems:
        """Return the problems with the name of the zone instead of its key path in the file."""
        current, name = self.model.current_round, self.zone_name
        names = [zone.name for zone in current.zones] if current is not None else []
        # The scenario loader names problems by their key path in the file.
        inside = f"zone[{names.index(name) + 1}]" if name in names else "area"
        path = f"round[{self.model.round_index + 1}].{inside}"
        lines = (line.removeprefix(f"{path}.").removeprefix(f"{path}: ") for line in problems)
        return tuple(f"{name or AREA_NAME}: {line}" for line in lines)

    def reshape(self, shape: Shape, step: str) -> None:
        """Give the edited zone or area a shape that was drawn on the map; `step` names the undo step."""
        edited = self.pending or self.edited
        if edited is not None:
            self.replace(reshaped(edited, shape), f"on map {step}")

    def team_typed(self, texts: TeamText, field: str) -> None:
        """Take the texts of the team form into the working copy, or note the problems."""
        old = self.team
        if old is None:
            return
        if field != self._field:
            self._field, self._team_before = field, old.name
        self._team_problems = self._replace_team(texts, old, field)
        if self._team_problems and self.model.retract():
            self.team_name = self._team_before

    def _replace_team(self, texts: TeamText, old: Team, field: str) -> Problems:
        params, problem = self.declared(texts.planner)
        # A planner that is installed at the station only is not known here: a team that has it keeps it.
        if problem and texts.planner != old.planner:
            return (problem,)
        try:
            new = to_team(texts, old, params)
        except FieldError as error:
            return (str(error),)
        problems = self.teams.set_team(old.name, new, field)
        self.team_name = self.team_name if problems else new.name
        return problems

    def planners(self) -> tuple[str, ...]:
        """Return the names of all planners that can be chosen, sorted."""
        return tuple(sorted({*self._installed, *self.files}))

    def declared(self, planner: str) -> tuple[tuple[Param, ...], str]:
        """Return the parameters that a planner declares; () and the reason if they are not known here."""
        if planner in self.files:
            return tuple(map(_param, self.files[planner].params)), ""
        try:
            return registry.declared(planner), ""
        except PlannerError as error:
            return (), str(error)

    def add_zone(self) -> Problems:
        """Add a small zone in the middle of the operating area and put it into the form; return why not."""
        current = self.model.current_round
        if current is None:
            return ("no scenario yet",)
        name = self.zones.new_name()
        centre = centre_of(current.area.shape)
        problems = self.zones.add_zone(Zone(name, Role.DEFEND, Circle(centre, NEW_RADIUS_M)))
        if not problems:
            self.choose_zone(name)
        return problems

    def duplicate_zone(self) -> Problems:
        """Add a copy of the edited zone beside it, or upon it where there is no room; return why not."""
        zone = self.zone
        if zone is None:
            return (NO_AREA,)
        current = self.model.current_round
        name = free_name(zone.name[:DUPLICATED_CHARS], [each.name for each in current.zones] if current else [])
        for east_m, north_m in DUPLICATE_OFFSETS_M:
            shape = moved(zone.shape, east_m, north_m)
            problems = self.zones.add_zone(msgspec.structs.replace(zone, name=name, shape=shape))
            if not problems:
                self.choose_zone(name)
                break
        return problems

    def copy_zone(self, indices: list[int]) -> Problems:
        """Copy the edited zone into the rounds at `indices`, over zones of its name; return why not."""
        zone = self.zone
        return self.zones.copy_zone(zone, indices) if zone is not None else (NO_AREA,)

    def delete_zone(self) -> Problems:
        """Remove the edited zone from the round; return why not."""
        if self.zone_name is None:
            return (NO_AREA,)
        problems = self.zones.remove_zone(self.zone_name)
        if not problems:
            self.choose_first()
        return problems


def reshaped(edited: Zone | OperatingArea, shape: Shape) -> Zone | OperatingArea:
    """Return the zone or area with another shape."""
    new: Zone | OperatingArea = msgspec.structs.replace(edited, shape=shape)
    return new


def _param(info: ParamInfo) -> Param:
    known = (info.default, info.minimum, info.maximum, info.unit, info.help, info.choices)
    return Param(info.name, TYPES[info.type], *known)
