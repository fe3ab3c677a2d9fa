"""The start of each vehicle, step by step: mode, its own pre-arm checks, arming, take-off, the climb to its layer.

The executive begins a start and decides when all of a group are up; this controller moves one vehicle from step to
step, and gives a start up that does not get on.
"""

import math
from collections.abc import Callable

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import ArmingStep, Flight, HoldStep
from tui_gcs.core.flight.return_home import LAYER_TOLERANCE_M
from tui_gcs.core.protocol.common import EventClass, Phase
from tui_gcs.core.records.event_log import ALERT
from tui_gcs.core.uplink.actions import Outcome, VehicleAction

PREARM_WAIT_S = 15.0
"""Pre-arm checks may depend on the mode, which was just changed: they have this long to pass."""
SYS_STATUS = 1
"""Message id; SYS_STATUS carries the result of the pre-arm checks."""
CHECKS_SETTLE_S = 1.0
"""Autopilots run their checks once a second, and SYS_STATUS reports what the last ones found."""
PREARM_ANSWER_S = 2.0
"""How long a vehicle that was asked for its pre-arm reasons has to answer; unasked it reports them every 30 s only."""
PREARM_REPEAT_S = 35.0
"""Pre-arm reasons that were reported within this time still hold: ArduPilot repeats its pre-arm texts every 30 s."""
MIN_CLIMB_M_S = 0.5
"""The slowest climb that is waited for. Autopilots ship with more: WPNAV_SPEED_UP 2.5, MPC_TKO_SPEED 1.5."""
CLIMB_RESERVE_S = 30.0
"""Added to the time of the climb: motors spool up, and the last metre is flown slowly."""


class StartController:
    """Moves the starts of vehicles on."""

    def __init__(self, services: FlightServices, hold: Callable[[Vehicle, Flight], object]) -> None:
        """`hold` ends a start that is given up: it holds the vehicle, or disarms it on the ground."""
        self._fleet, self._flights, self._firmware = services.fleet, services.flights, services.firmware
        self._commands, self._events, self._clock = services.commands, services.events, services.clock
        self._hold = hold

    def begin(self, flight: Flight, vehicle: Vehicle) -> None:
        """Begin the start of one vehicle: put it into the mode in which it will be armed."""
        flight.enter(Phase.ARMING, self._clock.now(), ArmingStep.SET_MODE)
        self._commands.submit(self._firmware.of(vehicle).prepare(vehicle, self._on_step))

    def _on_step(self, action: VehicleAction, outcome: Outcome, why: str) -> None:
        """An action of a start has ended: begin the next one, or give the start up."""
        flight = self._flights.get(action.vehicle)
        now = self._clock.now()
        if flight is None or flight.phase is not Phase.ARMING or outcome is Outcome.SUPERSEDED:
            return
        if outcome is not Outcome.CONFIRMED:
            self.give_up(flight, f"{action.name} {outcome.value}" + (f": {why}" if why else ""))
        elif action.name == "arm":
            flight.go_to_step(ArmingStep.TAKE_OFF, now)
            vehicle = self._fleet.vehicles[flight.vehicle]
            self._commands.submit(self._firmware.of(vehicle).take_off(vehicle, flight.layer_m, self._on_step))
        elif action.name == "take-off":
            flight.enter(Phase.TAKEOFF, now)
        else:
            flight.go_to_step(ArmingStep.PREARM, now)

    def follow_arming(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        """Move a vehicle in `Phase.ARMING` on: arm it when its checks pass, or give up with the reasons why not."""
        firmware = self._firmware.of(vehicle)
        if flight.step in (ArmingStep.PREARM, ArmingStep.PREARM_REASONS) and self._checks_pass(flight, vehicle, now):
            # Taken at the moment of arming: there its autopilot counts heights from.
            flight.home_m = vehicle.telemetry.position_m
            flight.go_to_step(ArmingStep.ARM, now)
            self._commands.submit(firmware.arm(vehicle, self._on_step))
        elif flight.step is ArmingStep.PREARM and now - flight.since_s > PREARM_WAIT_S:
            flight.go_to_step(ArmingStep.PREARM_REASONS, now)
            if (question := firmware.request_prearm_reasons(vehicle)) is not None:
                self._commands.submit(question)
        elif flight.step is ArmingStep.PREARM_REASONS and now - flight.since_s > PREARM_ANSWER_S:
            reasons = "; ".join(vehicle.reasons_since(now - PREARM_REPEAT_S)) or "it does not say why"
            self.give_up(flight, f"pre-arm checks do not pass: {reasons}")

    def _checks_pass(self, flight: Flight, vehicle: Vehicle, now: float) -> bool:
        """Whether its own checks pass in the mode it will arm in."""
        checked_s = now - vehicle.silent_s(SYS_STATUS, now)
        # What it reported for the mode before does not count: ArduCopter reports success in STABILIZE long before
        # it has a position.
        settled = checked_s > flight.since_s + CHECKS_SETTLE_S or flight.step is ArmingStep.PREARM_REASONS
        return settled and vehicle.telemetry.prearm_ok and self._firmware.of(vehicle).is_prepared(vehicle)

    def give_up(self, flight: Flight, why: str) -> None:
        """End a start that cannot go on, with an alert that has the reason."""
        self._events.report(EventClass.MISSION, f"vehicle {flight.vehicle}", f"not started: {why}", ALERT)
        self._hold(self._fleet.vehicles[flight.vehicle], flight)

    def follow_climb(self, flight: Flight, vehicle: Vehicle, now: float) -> bool:
        """Watch the climb to its layer, where it waits for the others; True at the moment when it is there.

        After a hold the climb is a course that the guard judges.
        """
        by_hand = math.isfinite(flight.manual_alt_m)
        wanted_m = flight.manual_alt_m if by_hand else flight.layer_m
        if abs(vehicle.telemetry.alt_rel_m - wanted_m) <= LAYER_TOLERANCE_M:
            flight.enter(Phase.BY_HAND if by_hand else Phase.HOLDING, now, HoldStep.READY)
            return True
        if now - flight.since_s > CLIMB_RESERVE_S + wanted_m / MIN_CLIMB_M_S:
            text = f"does not reach its layer: holds, {vehicle.telemetry.alt_rel_m:.0f} of {wanted_m:.0f} m high"
            self._events.report(EventClass.MISSION, f"vehicle {flight.vehicle}", text, ALERT)
            self._hold(vehicle, flight)
        return False
