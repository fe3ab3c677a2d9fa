"""What is being filled in: which zone and team, and why what was typed was not taken. Plain, no Textual.

Between the forms, which only know texts, and the working copy, which only knows valid scenarios.
"""

from collections.abc import Mapping

import msgspec

from tui_gcs.core.geometry.zones import Circle, Role, Shape, Zone
from tui_gcs.core.protocol.planning import TYPES, ParamInfo, PlannerInfo
from tui_gcs.core.scenario.model import OperatingArea, Team
from tui_gcs.planner.api import Param
from tui_gcs.planner.runtime import registry
from tui_gcs.widgets.forms.form_text import FieldError
from tui_gcs.widgets.plan.forms.settings_draft import SettingsDraft
from tui_gcs.widgets.plan.forms.team_text import TeamText, to_team
from tui_gcs.widgets.plan.forms.zone_text import AREA_NAME, ZoneText, to_area, to_zone
from tui_gcs.widgets.plan.scenario_editor import Problems, ScenarioEditor
from tui_gcs.widgets.plan.scenario_edits import EditParts, free_name
from tui_gcs.widgets.plan.shape_edit import centre_of, moved

NEW_RADIUS_M = 30.0
NO_AREA = "the operating area stays: every round has one"
ASIDE_M = ((20.0, -20.0), (-20.0, 20.0), (0.0, 0.0))
DUPLICATED_CELLS = 28
"""Names have at most 32; a number comes behind."""


class PlanDraft:
    """The zone and the team in the forms, and what is wrong there."""

    def __init__(self, model: ScenarioEditor) -> None:
        """For this working copy."""
        self.model = model
        self.parts = EditParts(model)
        self.settings = SettingsDraft(model)
        self.zone_name: str | None = None
        """None is the operating area."""
        self.team_name = ""
        self.files: Mapping[str, PlannerInfo] = {}
        """Planners in files of the operator's own, as the station told what they declare."""
        self.pending: Zone | OperatingArea | None = None
        """What the edited one would be, if it were allowed; None: it is as it is shown."""
        self._installed = registry.names()
        """Looked for once: that takes milliseconds."""
        self._zone_problems: Problems = ()
        self._team_problems: Problems = ()
        self._field = ""
        self._name_before: str | None = None
        self._team_before = ""

    @property
    def problems(self) -> Problems:
        """Why values in the forms are not in the working copy."""
        return (*self._zone_problems, *self._team_problems, *self.settings.problems)

    @property
    def zone(self) -> Zone | None:
        """The zone in the form; None if it is the operating area."""
        return self.model.zone(self.zone_name) if self.zone_name is not None else None

    @property
    def edited(self) -> Zone | OperatingArea | None:
        """What the zone form is about; None while there is no scenario."""
        current = self.model.current_round
        return self.zone or (current.area if current is not None else None)

    @property
    def team(self) -> Team | None:
        """What the team form is about."""
        scenario = self.model.scenario
        if scenario is None or not scenario.teams:
            return None
        return self.model.team(self.team_name) or scenario.teams[0]

    def choose_zone(self, name: str | None) -> None:
        """This zone, and the team that serves it."""
        self.zone_name = name if name is not None and self.model.zone(name) is not None else None
        team = self.model.team_of_zone(self.zone_name) if self.zone_name is not None else None
        self.team_name = team.name if team is not None else self.team_name
        self.end_field()

    def end_field(self) -> None:
        """A field was left: what comes next is another change."""
        self._field = ""
        self.model.end_field()

    def choose_first(self) -> None:
        """The first zone of the round."""
        current = self.model.current_round
        self.choose_zone(current.zones[0].name if current is not None and current.zones else None)

    def refilled(self) -> None:
        """The forms show the working copy again: nothing is wrong, and what is edited still exists."""
        self._zone_problems = self._team_problems = ()
        self.pending = None
        self.settings.refilled()
        if self.zone is None:
            self.zone_name = None
        team = self.team
        self.team_name = team.name if team is not None else ""

    def zone_typed(self, texts: ZoneText, field: str) -> None:
        """Take over what stands in the zone form, or keep the reasons why not."""
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
        if self._zone_problems and self.model.retract():
            self.zone_name = self._name_before

    def replace(self, new: Zone | OperatingArea, field: str = "") -> None:
        """Put this in the place of what is edited; what is not allowed stays `pending`, with the reasons."""
        if isinstance(new, OperatingArea):
            problems = self.model.set_area(new, field)
        else:
            problems = self.model.set_zone(self.zone_name or "", new, field)
            self.zone_name = new.name if not problems else self.zone_name
        self._zone_problems, self.pending = self._located(problems), new if problems else None

    def _located(self, problems: Problems) -> Problems:
        """Each with the name of what is edited, instead of where that stands in the file."""
        current, name = self.model.current_round, self.zone_name
        names = [zone.name for zone in current.zones] if current is not None else []
        inside = f"zone[{names.index(name) + 1}]" if name in names else "area"
        path = f"round[{self.model.round_index + 1}].{inside}"
        said = (line.removeprefix(f"{path}.").removeprefix(f"{path}: ") for line in problems)
        return tuple(f"{name or AREA_NAME}: {line}" for line in said)

    def reshape(self, shape: Shape, step: str) -> None:
        """The edited one with another shape, drawn on the map."""
        edited = self.pending or self.edited
        if edited is not None:
            self.replace(reshaped(edited, shape), f"on map {step}")

    def team_typed(self, texts: TeamText, field: str) -> None:
        """Take over what stands in the team form, or keep the reasons why not."""
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
        if problem and texts.planner != old.planner:
            return (problem,)
        try:
            new = to_team(texts, old, params)
        except FieldError as error:
            return (str(error),)
        problems = self.model.set_team(old.name, new, field)
        self.team_name = self.team_name if problems else new.name
        return problems

    def planners(self) -> tuple[str, ...]:
        """All that may be chosen, sorted."""
        return tuple(sorted({*self._installed, *self.files}))

    def declared(self, planner: str) -> tuple[tuple[Param, ...], str]:
        """The parameters a planner declares, and why they are not known here (then there are none)."""
        if planner in self.files:
            return tuple(map(_param, self.files[planner].params)), ""
        try:
            return registry.declared(planner), ""
        except registry.PlannerError as error:
            return (), str(error)

    def add_zone(self) -> Problems:
        """A small zone in the middle of the area, to be edited next; returns why not."""
        current = self.model.current_round
        if current is None:
            return ("no scenario yet",)
        name = self.model.new_zone_name()
        centre = centre_of(current.area.shape)
        problems = self.model.add_zone(Zone(name, Role.DEFEND, Circle(centre, NEW_RADIUS_M)))
        if not problems:
            self.choose_zone(name)
        return problems

    def duplicate_zone(self) -> Problems:
        """The same once more, a little aside where there is room; returns why not."""
        zone = self.zone
        if zone is None:
            return (NO_AREA,)
        current = self.model.current_round
        name = free_name(zone.name[:DUPLICATED_CELLS], [each.name for each in current.zones] if current else [])
        for east_m, north_m in ASIDE_M:
            shape = moved(zone.shape, east_m, north_m)
            problems = self.model.add_zone(msgspec.structs.replace(zone, name=name, shape=shape))
            if not problems:
                self.choose_zone(name)
                break
        return problems

    def copy_zone(self, indices: list[int]) -> Problems:
        """Into these rounds, instead of what has its name there; returns why not."""
        zone = self.zone
        return self.parts.copy_zone(zone, indices) if zone is not None else (NO_AREA,)

    def delete_zone(self) -> Problems:
        """Take the edited zone out of the round; returns why not."""
        if self.zone_name is None:
            return (NO_AREA,)
        problems = self.model.remove_zone(self.zone_name)
        if not problems:
            self.choose_first()
        return problems


def reshaped(edited: Zone | OperatingArea, shape: Shape) -> Zone | OperatingArea:
    """The same zone or area with another shape."""
    new: Zone | OperatingArea = msgspec.structs.replace(edited, shape=shape)
    return new


def _param(info: ParamInfo) -> Param:
    """What travelled, as it was declared."""
    known = (info.default, info.minimum, info.maximum, info.unit, info.help, info.choices)
    return Param(info.name, TYPES[info.type], *known)
