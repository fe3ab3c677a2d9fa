"""What is known of the plans that vehicles hold, and of the progress of their missions."""

import math
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from tui_gcs.core.plans.model import Plan, PlanKind


class MissionProgress(IntEnum):
    """The values of MISSION_STATE in common.xml."""

    UNKNOWN = 0
    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5


@dataclass
class HeldPlan:
    """One kind of plan on one vehicle, as far as it is known."""

    plan: Plan | None = None
    """The plan on board: verified after an upload, or read. None if it is not known."""
    ours: bool = False
    """Whether this station has put it there."""
    partial: bool = False
    """Whether it is the beginning of a plan whose upload failed."""
    stale: str = ""
    """Why `plan` is no longer what is on board, e.g. another station changed it; "" if it is."""
    opaque_id: int = 0
    """The vehicle's own number for `plan`, 0 if it gives none."""
    before: Plan | None = None
    """The plan that it held before an upload failed: it may be restored."""
    since_s: float = -math.inf
    proven: dict[int, tuple[str, str]] = field(default_factory=dict)
    """Fingerprints of a plan as it was sent and as it was read back, by the vehicle's number. The same number means the
    same plan."""

    rejected: dict[int, str] = field(default_factory=dict)
    """Why a plan with that number could not be flown: PX4 does not check one again that it has already."""

    @property
    def known(self) -> bool:
        """Whether `plan` is what is on board, as far as is known."""
        return self.plan is not None and not self.stale


@dataclass
class MissionState:
    """The progress of one vehicle, and what it holds. Indices count the plan's items from 0."""

    current: int | None = None
    """The item it flies to, or would; None if it did not report one, or an impossible one (docs/threats.md B.6-65)."""
    reached: int | None = None
    """The item that it reached last."""
    total: int | None = None
    """The number of items on board as it reports it; None if it does not."""
    progress: MissionProgress = MissionProgress.UNKNOWN
    last_heard_s: float = -math.inf
    """Station time of the last MISSION_CURRENT."""
    led_on_s: float = -math.inf
    """Station time of the newest order of this station to go on with another item."""
    ids: dict[PlanKind, int] = field(default_factory=dict)
    """Numbers of the plans on board in the newest MISSION_CURRENT, 0 for those it does not number."""
    held: dict[PlanKind, HeldPlan] = field(default_factory=lambda: {kind: HeldPlan() for kind in PlanKind})
    numbered: set[PlanKind] = field(default_factory=set)
    """The kinds for which MISSION_CURRENT ever had a number."""
    contradictions: dict[PlanKind, int] = field(default_factory=dict)
    """How many reports in a row contradicted what is held."""
    changed_s: dict[PlanKind, float] = field(default_factory=dict)
    """When this station last changed, or tried to change, what is held: reports are late."""


CUT_SHORT = "cut short"
"""A fingerprint that no plan has: what is read then is not ours."""


class PlanRegistry:
    """Keeps one `MissionState` for each vehicle, and the fingerprints of the plans that this station has put there."""

    def __init__(self) -> None:
        self._states: dict[int, MissionState] = {}
        self._ours: dict[tuple[int, PlanKind], str] = {}
        """Fingerprints of what vehicles last returned of what this station put there; outlives reboots and this
        station."""

    def state(self, vehicle: int) -> MissionState:
        """The state of a vehicle, made empty when it is first asked for."""
        found = self._states.get(vehicle)
        if found is None:
            found = self._states[vehicle] = MissionState()
        return found

    def put(self, vehicle: int, kind: PlanKind, fingerprint: str) -> None:
        """Note that what this station put there is read back with this fingerprint."""
        self._ours[vehicle, kind] = fingerprint

    def is_ours(self, vehicle: int, plan: Plan) -> bool:
        """Whether a plan that was read is what came back of the last one that this station put there."""
        return self._ours.get((vehicle, plan.kind)) == plan.fingerprint

    def to_read(self, vehicle: int, kind: PlanKind) -> bool:
        """Whether this station put a plan there of which it is not known whether it is still there."""
        held = self.state(vehicle).held[kind]
        # The fingerprint of an empty plan needs no reading: it was cleared.
        put = self._ours.get((vehicle, kind), "")
        return held.plan is None and not held.stale and put not in ("", Plan(kind).fingerprint)

    def memory(self) -> list[list[int | str]]:
        """What the station's next start must know."""
        return [[vehicle, int(kind), fingerprint] for (vehicle, kind), fingerprint in self._ours.items()]

    def recall(self, held: list[list[Any]]) -> None:
        """Restore what `memory` returned before a restart."""
        self._ours = {(vehicle, PlanKind(kind)): fingerprint for vehicle, kind, fingerprint in held}

    def cut_short(self, vehicle: int, kind: PlanKind) -> None:
        """Note that the station ended while it changed this plan: a complete, flyable part of it may be on board."""
        self._ours[vehicle, kind] = CUT_SHORT
        held = self.state(vehicle).held[kind]
        held.ours, held.stale = True, "the station ended while it was changing it"

    def forget(self, vehicle: int) -> None:
        """Forget a vehicle that rebooted, was replaced or is gone."""
        self._states.pop(vehicle, None)
