"""A vehicle leaves the mission: it is LOST, without position, replaced, in an emergency, or in a mode of its own.

From then on it is in `Phase.TAKEN_OUT`, and nothing is sent to it unless an operator orders it. When it is heard again,
`comeback` decides what it does. Whether a vehicle is LOST, or its position stale, is decided in `Vehicle.freshness`, by
the time since the last frame of its autopilot and since its last position.
"""

import math
from enum import Enum

from tui_gcs.core.firmware.foreign_command_policy import MISSION_MODES
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import Flight, HoldStep, Lost, TakenOut
from tui_gcs.core.flight.return_home import LAYER_TOLERANCE_M
from tui_gcs.core.protocol.common import EventClass, Freshness, Phase, RunPhase
from tui_gcs.core.records.event_log import ALERT, NOTICE, WARNING

MAX_SILENCE_S = 2.0
"""A vehicle heard within this time whose position is stale has lost its position only; a silent one is left to become
LOST."""
LEFT_REASON_WITHIN_S = 6.0
"""A vehicle that leaves its mode by a failsafe reports the reason this shortly before (PX4 holds for 3 s before it
leaves)."""
_STEERED = (Phase.FLYING, Phase.BY_HAND, Phase.TAKEOFF)
"""In these phases a hold that is under way is the guard's or the planner's doing, not an operator's."""
MISSION_ORDERS = ("mission start", "mission continue")
"""Names of the actions that start the mission on board."""
OUT_MODE_GRACE_S = 3.0
"""A mode change that the station asked for may show in the heartbeat this much later."""


class Comeback(Enum):
    """What a vehicle does that was taken out as LOST, or found in the air, and is heard now."""

    LANDS = "lands"
    """It goes on with its landing."""
    RETURNS = "returns"
    """It goes on with its return, from where it is."""
    RESUMES = "resumes"
    """It goes to its layer and on for its planner: the scenario allows that after a restart of the station."""
    REJOINS = "rejoins"
    """It goes on for its planner at once."""
    HOLDS = "holds"
    """It holds until an operator resumes it."""
    FOUND = "found"
    """This station did not bring it into the air: nothing is sent until it is resumed or returned."""


class VehicleLossController:
    """Takes vehicles out of the mission, and decides what they do when they are back."""

    def __init__(self, services: FlightServices) -> None:
        self._fleet, self._flights, self._firmware = services.fleet, services.flights, services.firmware
        self._commands, self._events, self._clock = services.commands, services.events, services.clock
        self._as_ordered_s: dict[int, float] = {}
        """When each vehicle that flies its mission, or a mode of its own, by order was last seen to do so."""

    def replaced(self, vehicle: Vehicle) -> None:
        """Another vehicle uses its id now: that one is not this station's to steer, wherever the first one may be."""
        flight = self._flights.get(vehicle.id)
        if flight is not None and flight.phase is not Phase.GROUND:
            self.take_out(flight, vehicle, TakenOut.REPLACED, self._clock.now())
            # Its lag belongs to the vehicle that it was.
            flight.tracking = None
            self._commands.cancel(vehicle.id)

    def declare_emergency(self, vehicle: Vehicle, why: str) -> None:
        """Take a vehicle in an emergency out of the mission: it gets no more set-points, and others keep clear."""
        flight = self._flights.get(vehicle.id)
        # Motors that were stopped by order let it fall, which is no news.
        if flight is not None and flight.step is TakenOut.MOTORS_STOPPED:
            return
        taken_out = flight is not None and flight.phase not in (Phase.GROUND, Phase.TAKEN_OUT)
        text = f"EMERGENCY: {why}" + (": taken out of the mission" if taken_out else "")
        self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, ALERT)
        if flight is not None and flight.phase is not Phase.GROUND:
            self.take_out(flight, vehicle, TakenOut.EMERGENCY, self._clock.now())
            flight.left_reason = why
            self._commands.cancel(vehicle.id, keep_stops=True)

    def check(self, flight: Flight, vehicle: Vehicle, now: float) -> bool:
        """Take a vehicle out that is LOST, has no position, or left the mode it is steered in.

        Returns whether it was taken out.

        Stops are still repeated, set-points are not: it follows its own failsafe, which was shown before the start.
        """
        freshness = vehicle.freshness(now)
        # Heard without a position: it can neither be steered nor kept clear of others.
        blind = freshness is Freshness.STALE and now - vehicle.last_heard_s < MAX_SILENCE_S
        if blind or freshness is Freshness.LOST:
            by_hand = flight.phase is Phase.BY_HAND or math.isfinite(flight.manual_alt_m)
            before = Phase.BY_HAND if by_hand else Phase.FLYING if flight.step is HoldStep.READY else flight.phase
            if blind:
                text = "NO POSITION for 3 s: taken out of the mission"
                self._events.report(EventClass.SENSOR, f"vehicle {vehicle.id}", text, ALERT)
            self.take_out(flight, vehicle, Lost(before), now)
            self._commands.cancel(vehicle.id, keep_stops=True)
            return True
        firmware = self._firmware.of(vehicle)
        if flight.phase is Phase.LANDING:
            in_its_mode = firmware.is_landing(vehicle)
        elif flight.phase is Phase.HOLDING:
            in_its_mode = firmware.is_holding(vehicle)
        else:
            in_its_mode = firmware.is_steerable(vehicle)
        if in_its_mode:
            return False
        # A hold for a veto is no operator's order, and is not repeated against a failsafe: the failsafe goes on.
        by_itself = (flight.held_by_station or flight.phase in _STEERED) and firmware.acts_by_itself(vehicle)
        stopping = self._commands.stopping(vehicle.id) and not by_itself
        # While a stop is being repeated its mode may still be the old one.
        settled = now - flight.since_s > OUT_MODE_GRACE_S and not stopping
        if not settled:
            return False
        if flight.ordered_mode == vehicle.telemetry.custom_mode:
            self._follow_ordered_mode(flight, vehicle, now)
            return True
        self._report_left(vehicle, "its mode", now)
        self.take_out(flight, vehicle, TakenOut.MODE_LEFT, now)
        flight.left_reason = self._left_reason(vehicle, now)
        self._commands.cancel(vehicle.id)
        return True

    def _follow_ordered_mode(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        """The vehicle is in the mode that an operator ordered by name: it flies by itself now, which is no surprise."""
        mode, ordered = flight.ordered_mode, vehicle.mode_name
        self._commands.cancel(vehicle.id)
        self.take_out(flight, vehicle, _step_of(ordered), now)
        flight.ordered_mode = mode
        text = f"flies in {ordered}, as ordered: not for its planner any more"
        self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, NOTICE)

    def watch_taken_out(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        """A vehicle on its mission or in a mode by order that leaves it without an order of ours has left."""
        by_order = flight.step in (TakenOut.ON_BOARD, TakenOut.OWN_MODE)
        if vehicle.freshness(now) is not Freshness.OK or not (by_order or flight.step is TakenOut.MODE_LEFT):
            return
        if flight.ordered_mode == vehicle.telemetry.custom_mode:
            step = _step_of(vehicle.mode_name)
            if flight.step is not step:
                flight.go_to_step(step, now)
                flight.left_reason = ""
            self._as_ordered_s[vehicle.id] = now
        elif by_order and (self._goes_on(flight, vehicle) or not vehicle.telemetry.airborne):
            self._as_ordered_s[vehicle.id] = now
        elif by_order and now - max(self._as_ordered_s.get(vehicle.id, -math.inf), flight.since_s) > OUT_MODE_GRACE_S:
            what = "its mission" if flight.step is TakenOut.ON_BOARD else "the mode that was ordered"
            self._report_left(vehicle, what, now)
            flight.go_to_step(TakenOut.MODE_LEFT, now)
            flight.left_reason, flight.ordered_mode = self._left_reason(vehicle, now), None

    def _goes_on(self, flight: Flight, vehicle: Vehicle) -> bool:
        """Whether it still does what was ordered, or the order is under way."""
        firmware = self._firmware.of(vehicle)
        if flight.step is TakenOut.ON_BOARD:
            pending = any(self._commands.pending(vehicle.id, name) for name in MISSION_ORDERS)
            return pending or firmware.flies_mission(vehicle)
        # A return may end in a mode that lands.
        return self._commands.stopping(vehicle.id) or firmware.is_landing(vehicle)

    def _left_reason(self, vehicle: Vehicle, now: float) -> str:
        """Why a vehicle left its mode: its own words, or the stations that were heard commanding it; "" if unknown."""
        words = vehicle.failsafe_words(now - LEFT_REASON_WITHIN_S)
        return words or self._fleet.other_stations.words(vehicle, now)

    def _report_left(self, vehicle: Vehicle, what: str, now: float) -> None:
        mode = vehicle.mode_name
        reason = vehicle.failsafe_words(now - LEFT_REASON_WITHIN_S)
        stations = self._fleet.other_stations.words(vehicle, now)
        text = f"left {what} (now {mode}): taken out of the mission" + (f"; it reported: {reason}" if reason else "")
        text += f"; {stations}" if stations and not reason else ""
        self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, WARNING)

    def take_out(self, flight: Flight, vehicle: Vehicle, step: TakenOut | Lost, now: float) -> None:
        """From now on nothing is sent to the vehicle unless an operator orders it."""
        flight.enter(Phase.TAKEN_OUT, now, step)
        self._firmware.of(vehicle).release(vehicle)

    def comeback(self, flight: Flight, vehicle: Vehicle, run: RunPhase, resume_found: bool) -> Comeback | None:
        """Decide what a lost vehicle does that is heard again; None while it is not, or is no lost one.

        It goes on with what it did if that is still wanted, else it holds. `resume_found`: vehicles that a restarted
        station finds in the air go on by themselves.
        """
        if not isinstance(flight.step, Lost) or vehicle.freshness(self._clock.now()) is not Freshness.OK:
            return None
        if not (vehicle.telemetry.airborne and vehicle.identity.identified):
            return None
        before, firmware = flight.step.before, self._firmware.of(vehicle)
        # Off its layer it could cross others on the way to its course.
        on_layer = abs(vehicle.telemetry.alt_rel_m - flight.layer_m) <= 2 * LAYER_TOLERANCE_M
        steerable = firmware.is_steerable(vehicle)
        if before is Phase.LANDING and (firmware.is_landing(vehicle) or self._commands.stopping(vehicle.id)):
            return Comeback.LANDS
        if before is Phase.RETURNING and steerable:
            return Comeback.RETURNS
        if resume_found and steerable and not flight.stays:
            return Comeback.RESUMES
        if before in (Phase.FLYING, Phase.TAKEOFF) and run is RunPhase.RUNNING and steerable and on_layer:
            return Comeback.REJOINS
        return Comeback.FOUND if before is None else Comeback.HOLDS


def _step_of(mode: str) -> TakenOut:
    """The step of a vehicle in a mode that was ordered."""
    return TakenOut.ON_BOARD if mode in MISSION_MODES else TakenOut.OWN_MODE
