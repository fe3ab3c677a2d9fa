"""Planned missions, fences and rally points as immutable values: an edit makes a new one, and undo keeps the old."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from tui_gcs.core.base.undo_history import UndoHistory, UndoStep
from tui_gcs.core.plans.check import PlanProblem, check
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind

Items = tuple[PlanItem, ...]


@dataclass(frozen=True)
class VehicleDraft:
    """The planned mission, fence and rally points of one vehicle."""

    mission: Items = ()
    fence: Items = ()
    rally: Items = ()

    def items(self, kind: PlanKind) -> Items:
        """The items of one kind."""
        return (self.mission, self.fence, self.rally)[kind]

    def plan(self, kind: PlanKind) -> Plan:
        """The items of one kind as a plan."""
        return Plan(kind, self.items(kind))

    def with_items(self, kind: PlanKind, items: Iterable[PlanItem]) -> "VehicleDraft":
        """Return a copy with these items of one kind."""
        new = tuple(items)
        match kind:
            case PlanKind.MISSION:
                return replace(self, mission=new)
            case PlanKind.FENCE:
                return replace(self, fence=new)
            case PlanKind.RALLY:
                return replace(self, rally=new)

    @cached_property
    def problems(self) -> tuple[tuple[PlanKind, PlanProblem], ...]:
        """Why its plans must not be sent to any vehicle."""
        return tuple((kind, problem) for kind in PlanKind if self.items(kind) for problem in check(self.plan(kind)))

    @property
    def is_empty(self) -> bool:
        """Whether nothing is planned for the vehicle."""
        return not (self.mission or self.fence or self.rally)


NOTHING = VehicleDraft()


@dataclass(frozen=True)
class MissionDraft:
    """The plans for all vehicles. `vehicles` is never changed in place."""

    vehicles: Mapping[int, VehicleDraft] = field(default_factory=dict)

    def of(self, vehicle: int) -> VehicleDraft:
        """The plans of one vehicle; empty if there are none."""
        return self.vehicles.get(vehicle, NOTHING)

    def with_vehicle(self, vehicle: int, draft: VehicleDraft) -> "MissionDraft":
        """Return a copy with this draft for one vehicle. A vehicle for which nothing is planned is not in it."""
        others = {number: each for number, each in self.vehicles.items() if number != vehicle}
        kept = others if draft.is_empty else others | {vehicle: draft}
        # Sorted: equal drafts are equal, in whatever order they were edited.
        return MissionDraft(dict(sorted(kept.items())))

    def with_items(self, vehicle: int, kind: PlanKind, items: Iterable[PlanItem]) -> "MissionDraft":
        """Return a copy with these items of one kind for one vehicle."""
        return self.with_vehicle(vehicle, self.of(vehicle).with_items(kind, items))

    @property
    def is_empty(self) -> bool:
        """Whether nothing is planned for any vehicle."""
        return not self.vehicles


Where = tuple[int, PlanKind, int]
"""An item: vehicle, kind of plan, index."""

MissionStep = UndoStep[MissionDraft, Where]
MissionHistory = UndoHistory[MissionDraft, Where]
