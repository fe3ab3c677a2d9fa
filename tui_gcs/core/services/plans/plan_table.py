"""What is known of the plans that vehicles hold, and of how far they are with their missions."""

import math
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from tui_gcs.core.plans.model import Plan, PlanKind


class MissionProgress(IntEnum):
    """MISSION_STATE of common.xml."""

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
    """What it holds: verified after an upload, or read. None: not known."""
    ours: bool = False
    """We have put it there."""
    partial: bool = False
    """It is the beginning of a plan whose upload failed."""
    stale: str = ""
    """Why `plan` is not what is on board any more, e.g. another station changed it; "" if nothing speaks against it."""
    opaque_id: int = 0
    """The vehicle's own number for `plan`; 0 if it gives none."""
    before: Plan | None = None
    """What it held before an upload that failed: it may be restored."""
    since_s: float = -math.inf
    proven: dict[int, tuple[str, str]] = field(default_factory=dict)
    """Fingerprints of a plan as it was sent and read back, by the vehicle's number for it: same number, same plan."""

    rejected: dict[int, str] = field(default_factory=dict)
    """Why a plan with that number could not be flown: PX4 does not look again at one that it has already."""

    @property
    def known(self) -> bool:
        """Whether `plan` is what is on board, for all we know."""
        return self.plan is not None and not self.stale


@dataclass
class MissionState:
    """How far one vehicle is, and what it holds. Indices count the plan's items from 0."""

    current: int | None = None
    """The item it is flying to, or would; None: it did not say, or what it said cannot be (B.6-65)."""
    reached: int | None = None
    """The item it reached last."""
    total: int | None = None
    """Items of the mission on board, as it says; None: not said."""
    progress: MissionProgress = MissionProgress.UNKNOWN
    heard_s: float = -math.inf
    """When MISSION_CURRENT last came."""
    ids: dict[PlanKind, int] = field(default_factory=dict)
    """Numbers of the plans on board in the newest MISSION_CURRENT, 0 for those it does not number."""
    held: dict[PlanKind, HeldPlan] = field(default_factory=lambda: {kind: HeldPlan() for kind in PlanKind})
    numbered: set[PlanKind] = field(default_factory=set)
    """Kinds that MISSION_CURRENT ever had a number for."""
    strange: dict[PlanKind, int] = field(default_factory=dict)
    """How many reports in a row did not fit to what is held."""
    changed_s: dict[PlanKind, float] = field(default_factory=dict)
    """When we last changed, or tried to change, what is held: reports are late."""


CUT_SHORT = "cut short"
"""No plan has this fingerprint: what is read is not ours."""


class PlanRegistry:
    """One `MissionState` per vehicle."""

    def __init__(self) -> None:
        """Nothing is known."""
        self._states: dict[int, MissionState] = {}
        self._ours: dict[tuple[int, PlanKind], str] = {}
        """Fingerprints of what vehicles last gave back of what we put there; outlives reboots and this station."""

    def state(self, vehicle: int) -> MissionState:
        """What is known of a vehicle; made empty when it is first asked for."""
        found = self._states.get(vehicle)
        if found is None:
            found = self._states[vehicle] = MissionState()
        return found

    def put(self, vehicle: int, kind: PlanKind, fingerprint: str) -> None:
        """What we put there comes back as this."""
        self._ours[vehicle, kind] = fingerprint

    def is_ours(self, vehicle: int, plan: Plan) -> bool:
        """Whether a plan as it was read is what came back of the last one that we put there."""
        return self._ours.get((vehicle, plan.kind)) == plan.fingerprint

    def to_read(self, vehicle: int, kind: PlanKind) -> bool:
        """Whether we put one there of which is not known whether it is still there."""
        held = self.state(vehicle).held[kind]
        put = self._ours.get((vehicle, kind), "")
        return held.plan is None and not held.stale and put not in ("", Plan(kind).fingerprint)

    def memory(self) -> list[list[int | str]]:
        """What the station's next start must know."""
        return [[vehicle, int(kind), fingerprint] for (vehicle, kind), fingerprint in self._ours.items()]

    def recall(self, held: list[list[Any]]) -> None:
        """Go on from what `memory` gave."""
        self._ours = {(vehicle, PlanKind(kind)): fingerprint for vehicle, kind, fingerprint in held}

    def cut_short(self, vehicle: int, kind: PlanKind) -> None:
        """The station ended while it was changing this one: what is there may be a part of it, whole and flyable."""
        self._ours[vehicle, kind] = CUT_SHORT
        held = self.state(vehicle).held[kind]
        held.ours, held.stale = True, "the station ended while it was changing it"

    def forget(self, vehicle: int) -> None:
        """It rebooted, was replaced or is gone."""
        self._states.pop(vehicle, None)
