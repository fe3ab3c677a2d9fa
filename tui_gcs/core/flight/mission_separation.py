"""Mission separation: holds vehicles on missions of their own before they come too close to others.

The guard judges every course that this station steers, but a mission is flown by the vehicle itself. Two real
ArduCopters on one mission collided at 27 m, and the station reported nothing. So a vehicle that this station sent on
its mission is held before it comes too close to any other one, while there is room to brake; of two on missions, both
are. Vehicles that a pilot, another station or their own failsafe flies are left alone.
"""

import math
from collections.abc import Callable, Iterator

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import TakenOut
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.guard.conflict_prediction import predicted_conflicts
from tui_gcs.core.guard.motion_prediction import BRAKE_DELAY_S, BRAKE_SHARE, VehicleState
from tui_gcs.core.guard.separation_check import GROUND_M
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import EventClass, Phase
from tui_gcs.core.records.event_log import ALERT

REACTION_S = 1.5
"""Time from a look at the fleet until a vehicle has the order: the gap between two looks, one lost copy, the link."""
CLOSER_M = 1.0
"""Two that are too close already are held if they will be so much closer within `AHEAD_S`."""
AHEAD_S = 2.0
"""How far two vehicles that are too close already are predicted, straight on at their velocities."""
HELD = "was held: too close to another vehicle"


class MissionSeparation:
    """Looks at all vehicles on missions that this station started; to be called some times a second."""

    def __init__(self, services: FlightServices, steering: Steering, hold: Callable[[Vehicle, str], None]) -> None:
        """`hold` stops a vehicle, for a reason that is shown with it."""
        self._fleet, self._flights, self._guard = services.fleet, services.flights, services.guard
        self._clock, self._events = services.clock, services.events
        self._steering, self._hold = steering, hold

    def tick(self) -> None:
        """Hold those that would come too close."""
        on_missions = {f.vehicle for f in self._flights.in_phase(Phase.TAKEN_OUT) if f.step is TakenOut.ON_BOARD}
        if not on_missions:
            return
        for one, other, text in self._too_close():
            for vehicle, partner in ((one, other), (other, one)):
                if vehicle in on_missions:
                    on_missions.discard(vehicle)
                    words = f"HELD on its mission: {text} {vehicles_words([partner])}"
                    self._events.report(EventClass.MISSION, f"vehicle {vehicle}", words, ALERT)
                    self._hold(self._fleet.vehicles[vehicle], HELD)

    def _too_close(self) -> Iterator[tuple[int, int, str]]:
        """Pairs that must not go on, and what would happen."""
        now, limits = self._clock.now(), self._guard.limits
        known = {state.id: state for state in self._steering.known(now)}
        for pair in predicted_conflicts(list(known.values()), limits, now):
            brakes_s = max(map(self._braking_s, (known[pair.one], known[pair.other])))
            if pair.in_s <= brakes_s:
                yield pair.one, pair.other, f"{pair.level_m:.0f} m in {pair.in_s:.0f} s from"
        states = [s for s in known.values() if not s.in_column and s.position_m[2] >= GROUND_M]
        for number, one in enumerate(states):
            for other in states[number + 1 :]:
                level_m = math.dist(one.position_m[:2], other.position_m[:2])
                height_m = abs(one.position_m[2] - other.position_m[2])
                if level_m >= limits.separation_horizontal_m or height_m >= limits.separation_vertical_m:
                    continue
                ahead_m = math.dist(_ahead(one), _ahead(other))
                if ahead_m < math.dist(one.position_m, other.position_m) - CLOSER_M:
                    yield one.id, other.id, f"{level_m:.0f} m and closing, from"

    def _braking_s(self, state: VehicleState) -> float:
        """Seconds from a look at the fleet until the vehicle stands: reaction, delay and braking."""
        speed_m_s = math.hypot(*state.velocity_m_s)
        return REACTION_S + BRAKE_DELAY_S + speed_m_s / (BRAKE_SHARE * self._guard.limits.accel_m_s2)


def _ahead(state: VehicleState) -> list[float]:
    return [p + v * AHEAD_S for p, v in zip(state.position_m, state.velocity_m_s, strict=True)]
