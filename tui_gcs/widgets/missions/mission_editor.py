"""What is being planned: the draft of all vehicles' plans, and which vehicle, plan kind and item is edited.

Independent of Textual. Places are ENU metres; heights are in the item's own frame. `MissionEdits` changes items.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import Polygon, Shape
from tui_gcs.core.missions.draft import Items, MissionDraft, MissionHistory, MissionStep
from tui_gcs.core.missions.forecast import Forecast
from tui_gcs.core.missions.generate import OWN_ITEMS, GenerationRequest, generated
from tui_gcs.core.missions.layered_copies import copied
from tui_gcs.core.missions.patrol_crossings import Flown, flown_by, patrols
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.missions.planned_vehicles import planned_vehicles
from tui_gcs.core.plans.model import PlanItem, PlanKind
from tui_gcs.core.protocol.common import Annotation, VehicleRow
from tui_gcs.core.scenario.model import Round, Scenario

Place = tuple[float, float]
AREA_NAME = "operating area"
KINDS = tuple(PlanKind)


class MissionEditor:
    """The draft with its undo history, the selection in it, and what is about to be generated."""

    def __init__(self) -> None:
        self.history = MissionHistory(MissionDraft())
        self.forecast = Forecast()
        self.scenario: Scenario | None = None
        self.vehicle = 0
        self.kind = PlanKind.MISSION
        self.index = 0
        self.preview: MissionDraft | None = None
        """What would be generated; shown instead of the draft until the operator takes or drops it."""
        self._planner_flights: tuple[Flown, Mapping[str, Sequence[Annotation]]] = ({}, {})
        """Vehicles that fly for planners, and the tours that these planners have drawn."""
        self.performance_given = False
        """The operator or a file gave the vehicles' performance; until then the speed is the scenario's."""

    @property
    def draft(self) -> MissionDraft:
        """What is shown: the preview if there is one, else the draft."""
        return self.preview if self.preview is not None else self.history.draft

    @property
    def items(self) -> Items:
        """The items of the edited vehicle and kind."""
        return self.draft.of(self.vehicle).items(self.kind)

    @property
    def item(self) -> PlanItem | None:
        """The edited item; None if there is none."""
        return self.items[self.index] if 0 <= self.index < len(self.items) else None

    @property
    def frame(self) -> LocalFrame:
        """The ENU frame about the scenario's origin."""
        return self.forecast.frame

    @property
    def vehicles(self) -> tuple[int, ...]:
        """Ids of the vehicles that can be planned for: those of the scenario, those present, and those with a draft."""
        return tuple(sorted({*self.forecast.vehicles, *self.draft.vehicles}))

    def place_m(self, item: PlanItem) -> Place | None:
        """Return where an item lies; None if its command has no place or none is set."""
        if not item.is_place or (item.x == 0 and item.y == 0):
            return None
        return self.frame.to_enu(item.lat_deg, item.lon_deg)

    def set_site(
        self,
        scenario: Scenario,
        current: Round,
        rows: Sequence[VehicleRow],
        drawn: Mapping[str, Sequence[Annotation]],
    ) -> bool:
        """Set the scenario, the present round, the vehicles and the tours `drawn` by planners; return what changed."""
        look = self.forecast
        before = (look.current, look.vehicles, look.limits)
        planners_before, self._planner_flights = self._planner_flights, (flown_by(rows), drawn)
        if self.scenario is None or self.scenario.origin != scenario.origin:
            look.frame = LocalFrame(scenario.origin)
        if self.scenario is None or self.scenario.limits != scenario.limits:
            limits = scenario.limits
            # What the operator assumes about the vehicles stays when the scenario changes.
            if not self.performance_given:
                look.performance = replace(look.performance, speed_m_s=limits.speed_m_s)
            look.performance = replace(look.performance, accel_m_s2=limits.accel_m_s2)
            look.limits = limits
        self.scenario, look.current = scenario, current
        look.vehicles = planned_vehicles(scenario, rows, look.vehicles)
        # The edited vehicle may have left the scenario and the air.
        if self.vehicle not in self.vehicles and self.vehicles:
            self.choose_vehicle(self.vehicles[0])
        if self._planner_flights != planners_before:
            look.patrols = patrols(*self._planner_flights)
        return self._planner_flights != planners_before or before != (
            look.current,
            look.vehicles,
            look.limits,
        )

    def assume(self, performance: Performance | None) -> None:
        """Forecast with this performance; its acceleration stays the scenario's. None changes nothing."""
        if performance is not None:
            accel = self.forecast.performance.accel_m_s2
            self.forecast.performance = replace(performance, accel_m_s2=accel)
            self.performance_given = True

    def choose_vehicle(self, vehicle: int) -> bool:
        """Edit the plans of this vehicle; return False if it cannot be planned for."""
        if vehicle not in self.vehicles:
            return False
        self.vehicle, self.index = vehicle, 0
        self.history.end_subject()
        return True

    def step_vehicle(self, by: int) -> None:
        """Edit the plans of the vehicle `by` places further in the list, which has no end."""
        ids = self.vehicles
        if ids:
            at = ids.index(self.vehicle) if self.vehicle in ids else 0
            self.choose_vehicle(ids[(at + by) % len(ids)])

    def step_kind(self) -> None:
        """Edit the next kind of plan: mission, fence, rally points."""
        self.choose_kind(KINDS[(self.kind + 1) % len(KINDS)])

    def choose_kind(self, kind: PlanKind) -> None:
        """Edit this kind of plan."""
        if kind is not self.kind:
            self.kind, self.index = kind, 0
            self.history.end_subject()

    def choose(self, index: int) -> None:
        """Edit the item at `index`, or the nearest that exists."""
        new = min(max(index, 0), max(len(self.items) - 1, 0))
        if new != self.index:
            self.history.end_subject()
        self.index = new

    def nearest(self, place_m: Place, within_m: float) -> int | None:
        """Return the index of the item that is nearest to `place_m`; None if none is within `within_m`."""
        best, found = within_m, None
        for i, item in enumerate(self.items):
            there = self.place_m(item)
            if there is not None and math.dist(there, place_m) <= best:
                best, found = math.dist(there, place_m), i
        return found

    def edit(self, label: str, items: Items, subject: str = "") -> None:
        """Replace the items of the edited vehicle and kind; consecutive edits of one `subject` are one undo step."""
        self.preview = None
        draft = self.history.draft.with_items(self.vehicle, self.kind, items)
        self.history.do(label, draft, subject, (self.vehicle, self.kind, self.index))
        self._update_forecast()

    def retract(self) -> None:
        """Take back what the open field changed: it holds an invalid value now, and half of a value is not meant."""
        self.history.retract()
        self._update_forecast()

    def take(self, label: str, draft: MissionDraft) -> None:
        """Replace the whole draft as one edit: it was generated, downloaded or read from a file."""
        self.preview = None
        self.history.do(label, draft, where=(self.vehicle, self.kind, self.index))
        self.history.end_subject()
        self._update_forecast()
        self.choose(self.index)

    def copy_to(self, vehicles: Sequence[int], kinds: Sequence[PlanKind]) -> None:
        """Copy the edited vehicle's plans of these kinds to other vehicles. Raises GeneratorError."""
        look = self.forecast
        draft = copied(self.history.draft, self.vehicle, vehicles, kinds, look.vehicles, look.frame)
        self.take(f"plans of {self.vehicle} copied", draft)

    def undo(self) -> str:
        """Undo the last edit and select where it was; return a line for the operator."""
        return self._show_step("undone", self.history.undo()) or "nothing to undo"

    def redo(self) -> str:
        """Redo the edit that was undone last; return a line for the operator."""
        return self._show_step("done again", self.history.redo()) or "nothing to do again"

    def _show_step(self, what: str, step: MissionStep | None) -> str:
        self.preview = None
        self._update_forecast()
        if step is None:
            return ""
        if step.where is not None:
            self.vehicle, self.kind, self.index = step.where
        self.choose(self.index)
        return f"{what}: {step.label}"

    def shapes(self) -> dict[str, Shape]:
        """Return the shapes that a plan can be generated over, by name: zones, area, the vehicle's own way-points."""
        found: dict[str, Shape] = {}
        places = [place for item in self.history.draft.of(self.vehicle).mission if (place := self.place_m(item))]
        if self.forecast.current is not None:
            found |= {zone.name: zone.shape for zone in self.forecast.current.zones}
            found[AREA_NAME] = self.forecast.current.area.shape
        if len(places) >= 2:
            found[OWN_ITEMS] = Polygon(tuple(places))
        return found

    def generate_preview(self, request: GenerationRequest) -> None:
        """Show what would be generated. Raises GeneratorError; then the draft is shown."""
        self.preview = None
        look = self.forecast
        shape = self.shapes().get(request.over, Polygon(()))
        try:
            self.preview = generated(self.history.draft, request, shape, look.vehicles, look.frame, look.performance)
        finally:
            self._update_forecast()

    def drop_preview(self) -> None:
        """Show the draft again instead of the preview."""
        self.preview = None
        self._update_forecast()

    def _update_forecast(self) -> None:
        self.forecast.draft = self.draft
