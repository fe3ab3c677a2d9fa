"""What is planned for each vehicle, as values: every edit makes a new one, so undo is keeping the old ones."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from tui_gcs.core.plan import Plan, PlanItem, PlanKind

MOST_UNDO = 500
Items = tuple[PlanItem, ...]


@dataclass(frozen=True)
class VehicleDraft:
    """One vehicle's mission, fence and rally points."""

    mission: Items = ()
    fence: Items = ()
    rally: Items = ()

    def items(self, kind: PlanKind) -> Items:
        """Those of one kind."""
        return (self.mission, self.fence, self.rally)[kind]

    def plan(self, kind: PlanKind) -> Plan:
        """The same, as it is checked and sent."""
        return Plan(kind, self.items(kind))

    def with_items(self, kind: PlanKind, items: Iterable[PlanItem]) -> "VehicleDraft":
        """With these instead of those of this kind."""
        new = tuple(items)
        match kind:
            case PlanKind.MISSION:
                return replace(self, mission=new)
            case PlanKind.FENCE:
                return replace(self, fence=new)
            case PlanKind.RALLY:
                return replace(self, rally=new)

    @property
    def is_empty(self) -> bool:
        """Whether nothing is planned."""
        return not (self.mission or self.fence or self.rally)


NOTHING = VehicleDraft()


@dataclass(frozen=True)
class MissionDraft:
    """What is planned for everybody. `vehicles` is never changed in place."""

    vehicles: Mapping[int, VehicleDraft] = field(default_factory=dict)

    def of(self, vehicle: int) -> VehicleDraft:
        """What is planned for one vehicle."""
        return self.vehicles.get(vehicle, NOTHING)

    def with_vehicle(self, vehicle: int, draft: VehicleDraft) -> "MissionDraft":
        """With this for one vehicle; one for whom nothing is planned is not in it."""
        others = {number: each for number, each in self.vehicles.items() if number != vehicle}
        kept = others if draft.is_empty else others | {vehicle: draft}
        return MissionDraft(dict(sorted(kept.items())))

    def with_items(self, vehicle: int, kind: PlanKind, items: Iterable[PlanItem]) -> "MissionDraft":
        """With these items for one vehicle."""
        return self.with_vehicle(vehicle, self.of(vehicle).with_items(kind, items))

    @property
    def is_empty(self) -> bool:
        """Whether nothing is planned for anybody."""
        return not self.vehicles


Where = tuple[int, PlanKind, int]
"""Vehicle, kind of plan, index of an item."""


@dataclass(frozen=True)
class Step:
    """One edit: what it was called, the draft that it was made from or led to, and where it is to be seen."""

    label: str
    draft: MissionDraft
    where: Where | None = None


class History:
    """The present draft, those before it and those that were taken back."""

    def __init__(self, draft: MissionDraft | None = None) -> None:
        """Begin with this, as it is in its file."""
        self.draft = draft or MissionDraft()
        self._saved = self.draft
        self._before: list[Step] = []
        self._after: list[Step] = []
        self._subject = ""

    @property
    def unsaved(self) -> bool:
        """Whether the draft differs from what was saved."""
        return self.draft is not self._saved and self.draft != self._saved

    @property
    def edits(self) -> int:
        """How many can be taken back."""
        return len(self._before)

    def do(self, label: str, draft: MissionDraft, subject: str = "", where: Where | None = None) -> bool:
        """Take over an edit; False if it changes nothing. Edits of one `subject` in a row (typing) are one step.

        `where` is where the operator was before it.
        """
        if draft == self.draft:
            return False
        if not subject or subject != self._subject:
            self._before.append(Step(label, self.draft, where))
            del self._before[:-MOST_UNDO]
        self._subject = subject
        self._after.clear()
        self.draft = draft
        return True

    def end_subject(self) -> None:
        """What comes next is a step of its own."""
        self._subject = ""

    def retract(self) -> bool:
        """Take back what the open `subject` changed: half of a value is not meant. Whether there was something."""
        if not self._subject or not self._before:
            return False
        self.draft = self._before.pop().draft
        self._subject = ""
        return True

    def undo(self) -> Step | None:
        """Take back the last edit, and tell of it; None if there was none."""
        return self._go(self._before, self._after)

    def redo(self) -> Step | None:
        """Do again what was taken back, and tell of it; None if there was nothing."""
        return self._go(self._after, self._before)

    def saved(self) -> None:
        """This is in the file now."""
        self._saved = self.draft
        self.end_subject()

    def _go(self, source: list[Step], target: list[Step]) -> Step | None:
        self._subject = ""
        if not source:
            return None
        step = source.pop()
        target.append(Step(step.label, self.draft, step.where))
        self.draft = step.draft
        return step
