"""Pointing gimbals by angles, or at a place.

An ACK does not prove that a gimbal turned: a real ArduPilot accepts 80° up for a gimbal that ends at 20° (measured).
Neither autopilot sends its gimbal's angles unasked at a useful rate, so they are requested after the order.
"""

import math
from functools import partial

from tui_gcs.core.fleet.vehicle import NAN, Vehicle
from tui_gcs.core.guard.permission import Order
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.payload.devices import PayloadDevices
from tui_gcs.core.services.payload.gimbal_state import POINTING_TIMEOUT_S, GimbalState, GimbalTarget
from tui_gcs.core.services.payload.payload_commands import Done, PayloadCommands, ignore, without_action
from tui_gcs.core.uplink.actions import Outcome, VehicleAction

# MAV_COMP_ID_MISSIONPLANNER, by convention that of ground stations (docs/autopilots.md C7).
STATION_COMPONENT = 190
# MAV_CMD (common.xml).
SET_ROI_LOCATION, SET_ROI_NONE = 195, 197
GIMBAL_PITCH_YAW, GIMBAL_CONFIGURE = 1000, 1001
GIMBAL_DEVICE_ATTITUDE_STATUS = 285
UNCHANGED, RELEASE = -1, -3
"""Values for the four owners in GIMBAL_CONFIGURE: leave as it is; no owner, if this station was it."""
ROLL_LOCK, PITCH_LOCK, YAW_LOCK = 4, 8, 16
"""GIMBAL_MANAGER_FLAGS: roll and pitch held against the horizon; yaw held against north instead of the nose."""
FRAME_AMSL = 0
UNSEEN_GIMBAL = "accepted; the gimbal reports no angles: check whether it turned"


class GimbalControl:
    """Points the gimbals of vehicles."""

    def __init__(self, context: ServiceContext, devices: PayloadDevices, commands: PayloadCommands) -> None:
        self._context = context
        self._devices = devices
        self._commands = commands

    def point(
        self,
        vehicle: Vehicle,
        pitch_deg: float,
        yaw_deg: float,
        *,
        to_north: bool = False,
        on_done: Done = ignore,
    ) -> None:
        """Point its gimbal, taking control of it first, and check its angles afterwards.

        Args:
            vehicle: The vehicle that carries the gimbal.
            pitch_deg: Up is positive, -90…90.
            yaw_deg: Right of the nose, or of north; -180…180.
            to_north: Whether yaw is counted from north, and kept while the vehicle turns.
            on_done: Called once with how it ended.
        """
        if not (-90 <= pitch_deg <= 90 and -180 <= yaw_deg <= 360):
            on_done(Outcome.REFUSED, "pitch or yaw is beyond what any gimbal can do")
            return
        flags = ROLL_LOCK | PITCH_LOCK | (YAW_LOCK if to_north else 0)
        angles = (pitch_deg, yaw_deg, NAN, NAN, flags, 0, 0)
        component = self._devices.gimbal_component(vehicle)
        payload = self._devices.of(vehicle)
        target = GimbalTarget(pitch_deg, yaw_deg, to_north)

        def turn(action: VehicleAction | None, outcome: Outcome, why: str) -> None:
            payload.gimbal_claimed = payload.gimbal_claimed or outcome is Outcome.CONFIRMED
            if outcome in (Outcome.EXPIRED, Outcome.SUPERSEDED):
                on_done(outcome, why)
                return
            self._commands.submit(
                vehicle,
                "gimbal",
                GIMBAL_PITCH_YAW,
                angles,
                partial(self._on_pointed, vehicle, target, on_done),
                component=component,
                shows=partial(self._is_settled, vehicle, target),
                look=partial(self._devices.request, vehicle, GIMBAL_DEVICE_ATTITUDE_STATUS, component),
            )

        if payload.gimbal_claimed and self._controlled_by_us(vehicle):
            turn(None, Outcome.CONFIRMED, "")
        else:
            mine = (self._context.own_system, STATION_COMPONENT, UNCHANGED, UNCHANGED, 0, 0, 0)
            self._commands.submit(vehicle, "gimbal control", GIMBAL_CONFIGURE, mine, turn, component=component)

    def release(self, vehicle: Vehicle, on_done: Done = ignore) -> None:
        """Give control of its gimbal back."""
        self._devices.of(vehicle).gimbal_claimed = False
        no_owner = (RELEASE, RELEASE, UNCHANGED, UNCHANGED, 0, 0, 0)
        component = self._devices.gimbal_component(vehicle)
        self._commands.submit(
            vehicle, "gimbal release", GIMBAL_CONFIGURE, no_owner, without_action(on_done), component=component
        )

    def look_at(
        self, vehicle: Vehicle, lat_deg: float, lon_deg: float, alt_amsl_m: float, on_done: Done = ignore
    ) -> None:
        """Keep the gimbal, or the nose of a vehicle without one, on a place. `alt_amsl_m` is above mean sea level."""
        if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180 and math.isfinite(alt_amsl_m)):
            on_done(Outcome.REFUSED, "this is no place")
            return
        place = {
            "frame": FRAME_AMSL,  # the one frame that ArduPilot and PX4 both read
            "x": round(lat_deg * 1e7),
            "y": round(lon_deg * 1e7),
            "z": float(alt_amsl_m),
            "current": 0,
            "autocontinue": 0,
        } | {f"param{i}": 0.0 for i in range(1, 5)}
        self._commands.submit_action(
            vehicle,
            "region of interest",
            SET_ROI_LOCATION,
            lambda copy: self._context.uplink.action(
                vehicle.id, Order("region of interest"), "COMMAND_INT", command=SET_ROI_LOCATION, **place
            ),
            without_action(on_done),
        )

    def look_ahead(self, vehicle: Vehicle, on_done: Done = ignore) -> None:
        """Clear the region of interest."""
        self._commands.submit(vehicle, "no region of interest", SET_ROI_NONE, (), without_action(on_done))

    def _is_settled(self, vehicle: Vehicle, target: GimbalTarget, action: VehicleAction) -> bool:
        """Whether the gimbal points there by a report after the ACK, or has had its time to."""
        if action.acked_s is None:
            return False
        if self._context.clock.now() > action.acked_s + POINTING_TIMEOUT_S:
            return True
        state = self._state_since(vehicle, action.acked_s)
        return state is not None and target.is_reached(state, vehicle.telemetry.heading_deg)

    def _on_pointed(
        self,
        vehicle: Vehicle,
        target: GimbalTarget,
        on_done: Done,
        action: VehicleAction,
        outcome: Outcome,
        why: str,
    ) -> None:
        state = self._state_since(vehicle, action.acked_s) if action.acked_s is not None else None
        if outcome is Outcome.CONFIRMED:
            why = f"it is at {state.text()}" if state is not None else UNSEEN_GIMBAL
            # A gimbal without sensors reports its servos' angles (ArduPilot). In flight the vehicle leans, and they
            # differ from the target without anything being wrong.
            if (
                state is not None
                and not target.is_reached(state, vehicle.telemetry.heading_deg)
                and not vehicle.telemetry.airborne
            ):
                outcome = Outcome.NOT_CONFIRMED
        on_done(outcome, why)

    def _state_since(self, vehicle: Vehicle, since_s: float) -> GimbalState | None:
        gimbals = self._devices.gimbals(vehicle)
        return next((g for g in gimbals if g.reported_s >= since_s and g.knows_angles()), None)

    def _controlled_by_us(self, vehicle: Vehicle) -> bool:
        own = (None, self._context.own_system)
        return any(gimbal.controlled_by in own for gimbal in self._devices.gimbals(vehicle))
