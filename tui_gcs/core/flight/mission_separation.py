"""Mission separation: holds vehicles that this station does not steer before they come too close to others.

The guard judges every course that this station steers, but a mission is flown by the vehicle itself. Two real
ArduCopters on one mission collided at 27 m, and the station reported nothing. So all vehicles in the air are looked at,
and those that this station may stop (`Executive.may_stop_by_itself`) are held before they come too close to any other
one, while there is room to brake; of two that may be stopped, both are. Who began the mission does not matter: it may
have been this station before a restart, another one, or a pilot.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.guard.conflict_prediction import predicted_conflicts
from tui_gcs.core.guard.motion_prediction import BRAKE_DELAY_S, BRAKE_SHARE, VehicleState
from tui_gcs.core.guard.separation_check import GROUND_M
from tui_gcs.core.motion.course import Samples
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ALERT
from tui_gcs.core.scenario.model import Limits

REACTION_S = 1.5
"""Time from a look at the fleet until a vehicle has the order: the gap between two looks, one lost copy, the link."""
CLOSER_M = 1.0
"""Two that are too close already are held if they will be so much closer within `AHEAD_S`."""
AHEAD_S = 2.0
"""How far two vehicles that are too close already are predicted, straight on at their velocities."""
HELD = "was held: too close to another vehicle"


class MissionSeparation:
    """Looks at all vehicles in the air; to be called some times a second."""

    def __init__(
        self,
        services: FlightServices,
        steering: Steering,
        may_stop: Callable[[Vehicle], bool],
        hold: Callable[[Vehicle, str], None],
    ) -> None:
        """`may_stop` is asked which vehicles may be held; `hold` stops one, for a reason that is shown with it."""
        self._fleet, self._firmware, self._guard = services.fleet, services.firmware, services.guard
        self._clock, self._events = services.clock, services.events
        self._steering, self._may_stop, self._hold = steering, may_stop, hold

    def tick(self) -> Iterator[None]:
        """Hold those that would come too close; in pieces, between which a stop or another request may be answered."""
        if not self._stoppable():
            return
        now, limits = self._clock.now(), self._guard.limits
        states = self._steering.known(now)
        by_id = {state.id: state for state in states}
        yield
        found = []
        for pair in predicted_conflicts(states, limits, now):
            brakes_s = max(map(self._braking_s, (by_id[pair.one], by_id[pair.other])))
            if pair.in_s <= brakes_s:
                found.append((pair.one, pair.other, f"{pair.level_m:.0f} m in {pair.in_s:.0f} s from"))
        yield
        away = [s for s in states if not s.in_column and s.position_m[2] >= GROUND_M]
        for one, other, level_m in _close_and_closing(away, limits):
            found.append((one.id, other.id, f"{level_m:.0f} m and closing, from"))
        self._hold_all_of(found)

    def _stoppable(self) -> set[int]:
        return {v.id for v in self._fleet.vehicles.values() if v.telemetry.airborne and self._may_stop(v)}

    def _hold_all_of(self, found: list[tuple[int, int, str]]) -> None:
        """Hold who may be stopped of these pairs, each once; with each pair stands what would happen."""
        stoppable = self._stoppable() if found else set()  # a request may have been answered since the look began
        for one, other, text in found:
            for number, partner in ((one, other), (other, one)):
                if number in stoppable:
                    stoppable.discard(number)
                    vehicle = self._fleet.vehicles[number]
                    does = "HELD on its mission" if self._firmware.of(vehicle).flies_mission(vehicle) else "HELD"
                    words = f"{does}: {text} {vehicles_words([partner])}"
                    self._events.report(EventClass.MISSION, f"vehicle {number}", words, ALERT)
                    self._hold(vehicle, HELD)

    def _braking_s(self, state: VehicleState) -> float:
        """Seconds from a look at the fleet until the vehicle stands: reaction, delay and braking."""
        speed_m_s = math.hypot(*state.velocity_m_s)
        return REACTION_S + BRAKE_DELAY_S + speed_m_s / (BRAKE_SHARE * self._guard.limits.accel_m_s2)


def _close_and_closing(
    states: list[VehicleState], limits: Limits
) -> Iterator[tuple[VehicleState, VehicleState, float]]:
    """Pairs that are too close now and will be `CLOSER_M` closer within `AHEAD_S`, and their horizontal distance in m.

    All pairs are compared at once, as arrays: one by one 250 vehicles would hold up a stop for 10 ms of CPU time.
    """
    if len(states) < 2:
        return
    here_m = np.array([state.position_m for state in states], dtype=float)
    velocity_m_s = np.nan_to_num([state.velocity_m_s for state in states], nan=0.0, posinf=0.0, neginf=0.0)
    # A number that is not known (NaN) is near to nothing: comparisons with it are false.
    level = _differences(here_m[:, 0]) ** 2 + _differences(here_m[:, 1]) ** 2 < limits.separation_horizontal_m**2
    height = np.abs(_differences(here_m[:, 2])) < limits.separation_vertical_m
    ones, others = np.nonzero(np.triu(level & height, 1))
    gap_m = here_m[ones] - here_m[others]
    ahead_m = gap_m + AHEAD_S * (velocity_m_s[ones] - velocity_m_s[others])
    closing = np.linalg.norm(ahead_m, axis=1) < np.linalg.norm(gap_m, axis=1) - CLOSER_M
    for pair in np.flatnonzero(closing).tolist():
        yield states[ones[pair]], states[others[pair]], math.hypot(*gap_m[pair, :2])


def _differences(values: Samples) -> Samples:
    """(n, n) each of `values`, (n,), minus each other one."""
    differences: Samples = values[:, None] - values
    return differences
