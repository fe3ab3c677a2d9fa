"""Detects what changed for a team's vehicles from frame to frame, as events for its planner."""

import math
from typing import Literal

from tui_gcs.core.protocol.common import AnyFrame, Freshness, Phase, PlannerTask
from tui_gcs.planner.api import LOW_BATTERY_PCT, Event

ReportedState = Literal["", "active", "held", "lost", "returned"]
"""The state of a vehicle that the planner was informed of last; "" before the first event."""

_EVENT_KIND: dict[ReportedState, Literal["held", "lost", "returned"]] = {
    "held": "held",
    "lost": "lost",
    "returned": "returned",
}


class TeamChangeDetector:
    """Compares each frame with the one before. The same frames give the same events, in order of id."""

    def __init__(self) -> None:
        """The first frame is the reference: changes are counted from there."""
        self.state: dict[int, ReportedState] = {}
        self.low: list[int] = []
        """Vehicles whose low battery was reported, sorted."""
        self.begun = False

    def update(self, frame: AnyFrame, task: PlannerTask) -> list[Event]:
        """Return the events since the frame before; the first frame gives only low batteries."""
        place = {vehicle: i for i, vehicle in enumerate(frame.ids)}
        events: list[Event] = []
        for vehicle in sorted(task.members):
            i = place.get(vehicle)
            before = self.state.get(vehicle, "")
            now = "lost" if i is None else _state(frame, i, before)
            if now != before and not (before == "" and now != "active") and (before, now) != ("returned", "lost"):
                events.append(Event(_event_kind(before, now), frame.t_s, vehicle))
                self.state[vehicle] = now
            if i is not None and self._newly_low(vehicle, frame.battery_pct[i] if frame.battery_pct else math.nan):
                events.append(Event("low battery", frame.t_s, vehicle))
        # The states in the first frame are no changes.
        if self.begun:
            return events
        self.begun = True
        return [event for event in events if event.kind == "low battery"]

    def _newly_low(self, vehicle: int, battery_pct: float) -> bool:
        """Return True once per flight: a vehicle that joins again with a full battery may be low again."""
        flies = self.state.get(vehicle, "") in ("active", "held")
        if flies and battery_pct < LOW_BATTERY_PCT and vehicle not in self.low:
            self.low = sorted([*self.low, vehicle])
            return True
        if self.state.get(vehicle) in ("returned", "lost") and vehicle in self.low:
            self.low.remove(vehicle)
        return False


def _state(frame: AnyFrame, i: int, before: ReportedState) -> ReportedState:
    if frame.freshness[i] == Freshness.LOST:
        return "lost"
    phase = frame.phase[i]
    if phase == Phase.FLYING:
        return "active" if all(map(math.isfinite, frame.position_m[i])) else "lost"
    if phase in (Phase.HOLDING, Phase.BY_HAND):
        return "held"
    if phase in (Phase.ARMING, Phase.TAKEOFF):  # on its way up, or back to its layer after a hold
        return before
    return "returned"


def _event_kind(before: ReportedState, now: ReportedState) -> Literal["joined", "lost", "held", "returned", "resumed"]:
    if now == "active":
        return "resumed" if before == "held" else "joined"
    return _EVENT_KIND[now]
