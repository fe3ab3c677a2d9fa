"""PX4's COMMAND_LONG and COMMAND_INT: what each does, and how it is acknowledged (docs/autopilots.md "PX4").

Calibrations and actuator tests are in `calibration`, gimbal and camera in `services.payload`.
"""

import math
from collections.abc import Callable

from sitl.common.command import Command
from sitl.common.platform import Part, Platform
from sitl.common.states import Result, Stage
from sitl.physics.point_masses import Point
from sitl.px4.commander import ARMED_BY_COMMAND, BY_MISSION, Commander
from sitl.px4.modes import AVAILABLE, HOLD, LAND, MISSION, ORBIT, RTL, TAKEOFF
from sitl.px4.navigator import Orbit
from sitl.px4.parts import Px4Parts
from sitl.px4.stream_rates import BACK_TO_HZ
from sitl.px4.telemetry import Px4Telemetry

# For a disarm in the air only: when arming it skips no check of PX4.
FORCE = 21196
ONLY_CHANGE_MODE = 1
"""The one value of DO_REPOSITION's flags that PX4 takes."""
NO_PLACE = 2**31 - 1
"""x or y of a COMMAND_INT without a place."""
MAX_ORBIT_M_S = 10.0
DO_SET_MODE = 176
# Message id, and the MAV_CMD that asks for a message.
_AVAILABLE_MODES, _REQUEST_MESSAGE = 435, 512


class Px4Commands(Part):
    """Carries out commands and acknowledges them."""

    def __init__(self, platform: Platform, parts: Px4Parts, commander: Commander, telemetry: Px4Telemetry) -> None:
        super().__init__(platform)
        self._commander, self._telemetry, self._calibration = commander, telemetry, parts.calibration
        self._announcer, self._answers, self._navigator = parts.announcer, parts.answers, parts.navigator
        self._checks, self._fence, self._payload = parts.checks, parts.fence, parts.payload
        self._handlers: dict[int, Callable[[Command], Result]] = {
            20: self._mode_command(RTL, "Returning to launch", "commander_rtl"),
            21: self._mode_command(LAND, "Landing at current position", "commander_landing_current_pos"),
            22: self._take_off,
            34: self._orbit,
            178: self._change_speed,
            179: self._set_home,
            186: self._change_altitude,
            192: self._reposition,
            # Regions of interest are accepted, on the ground too; without a gimbal nothing moves, nor does the nose.
            **dict.fromkeys((195, 196, 197, 201), lambda _: Result.ACCEPTED),
            246: self._reboot,
            300: self._mission_start,
            400: self._arm_disarm,
            410: self._legacy_request("HOME_POSITION"),
            510: self._get_message_interval,
            511: self._set_message_interval,
            _REQUEST_MESSAGE: self._request_message,
            519: self._legacy_request("PROTOCOL_VERSION"),
            520: self._legacy_request("AUTOPILOT_VERSION"),
        }
        """By MAV_CMD. PX4 has neither CONDITION_YAW nor DO_PAUSE_CONTINUE nor DO_SET_MISSION_CURRENT."""

    def execute(self, command: Command) -> None:
        """Carry out a command and acknowledge it.

        DO_SET_MODE is acknowledged twice: at once by the receiver, always ACCEPTED, then by the commander.
        """
        # Nothing answers before the boot is over, unlike ArduCopter, which acknowledges and forgets.
        if self._state.stage < Stage.READY:
            return
        # Calibrations are dialogues of their own.
        if self._calibration.execute(command):
            return
        if command.number == DO_SET_MODE:
            self._outbox.answer(command, Result.ACCEPTED)
            self._outbox.hold_back()
            self._answers.answer(command, self._do_set_mode(command))
            return
        handler = self._handlers.get(command.number)
        # The message comes before the acknowledgement.
        if command.number == _REQUEST_MESSAGE:
            self._outbox.answer(command, self._request_message(command))
            return
        self._outbox.hold_back()
        result = handler(command) if handler is not None else self._payload.execute(command)
        held = self._outbox.take_held()
        if result is None and self._payload.is_silent_about(command):
            return
        self._outbox.answer(command, Result.UNSUPPORTED if result is None else result)
        self._outbox.send_all(held)

    def _do_set_mode(self, command: Command) -> Result:
        if not _int(command.p[0]) & 1:
            return Result.ACCEPTED  # and nothing happens
        return self._commander.request_mode(_int(command.p[1]) & 0xFF, _int(command.p[2]) & 0xFF)

    def _arm_disarm(self, command: Command) -> Result:
        """Arm or disarm: a forced arming skips no check, a forced disarming skips that of being landed."""
        if command.p[0] == 1:
            return self._commander.arm()
        if command.p[0] != 0:
            return Result.UNSUPPORTED
        if not self._state.armed:
            return Result.ACCEPTED
        if not self._state.landed and command.p[1] != FORCE:
            self._announcer.alert("Disarming denied: not landed", "commander_disarm_denied_not_landed")
            return Result.TEMPORARILY_REJECTED
        self._commander.disarm(ARMED_BY_COMMAND, "external command")
        return Result.ACCEPTED

    def _place(self, command: Command) -> Point | None:
        """Return the place of p5 to p7; None for an impossible one. The altitude is AMSL, whatever the frame is."""
        x, y, z = self._body.seen_m()
        latitude, longitude, amsl_m = command.p[4:]
        if command.frame is not None:
            latitude = math.nan if latitude == NO_PLACE else latitude / 1e7
            longitude = math.nan if longitude == NO_PLACE else longitude / 1e7
        if math.isfinite(latitude) and math.isfinite(longitude):
            if abs(latitude) > 90.0 or abs(longitude) > 180.0:
                return None
            x, y = self._body.to_local(latitude, longitude)
        return x, y, amsl_m - self._spec.ground_amsl_m if math.isfinite(amsl_m) else z

    def _take_off(self, command: Command) -> Result:
        """Take off, or climb in flight, to an altitude AMSL; NaN stands for the default height."""
        if not self._checks.can_run(TAKEOFF):
            return Result.TEMPORARILY_REJECTED
        amsl_m = command.p[6]
        self._navigator.takeoff_m = amsl_m - self._spec.ground_amsl_m if math.isfinite(amsl_m) else None
        return self._commander.set_mode(TAKEOFF)

    def _mode_command(self, mode: int, text: str, event: str) -> Callable[[Command], Result]:
        """Return the handler of a command that changes the mode; the same change by DO_SET_MODE has no text."""

        def change(_: Command) -> Result:
            if self._checks.can_run(mode):
                self._announcer.announce(text, event)
            return self._commander.set_mode(mode)

        return change

    def _reposition(self, command: Command) -> Result:
        """Fly to a place. PX4 accepts it also when the place is outside the fence, and only a text reports that."""
        # Without the flag to change the mode PX4 refuses, also if it is in Hold already.
        if command.p[1] != ONLY_CHANGE_MODE:
            return Result.UNSUPPORTED
        place = self._place(command)
        if place is None:
            return Result.DENIED
        if not self._state.armed:
            return Result.ACCEPTED
        # The vehicle is in Hold on its way: a second DO_REPOSITION only moves the goal.
        result = self._commander.set_mode(HOLD)
        if result != Result.ACCEPTED or self._state.landed:
            return result
        if not self._fence.contains(place[0], place[1]):
            text = "Reposition is outside geofence"
            self._announcer.alert(text, "navigator_reposition_outside_geofence", levels=0x63)
            return Result.ACCEPTED
        if command.p[0] > 0.0:
            self._navigator.cruise_m_s = command.p[0]
        yaw = command.p[3]
        self._navigator.go(place, yaw_rad=yaw if math.isfinite(yaw) else None)
        return Result.ACCEPTED

    def _change_altitude(self, command: Command) -> Result:
        """Climb or descend to p1, metres AMSL."""
        if not self._state.armed or self._state.landed or not math.isfinite(command.p[0]):
            return Result.ACCEPTED
        x, y, _ = self._body.seen_m()
        result = self._commander.set_mode(HOLD)
        if result == Result.ACCEPTED:
            self._navigator.go((x, y, command.p[0] - self._spec.ground_amsl_m))
        return result

    def _change_speed(self, command: Command) -> Result:
        self._navigator.change_speed(command.p[1])
        return Result.ACCEPTED

    def _orbit(self, command: Command) -> Result:
        place = self._place(command)
        if place is None:
            return Result.DENIED
        # Missing numbers are PX4's defaults.
        radius_m = command.p[0] if math.isfinite(command.p[0]) and command.p[0] else 20.0
        speed_m_s = min(abs(command.p[1]), MAX_ORBIT_M_S) if math.isfinite(command.p[1]) else 1.0
        result = self._commander.set_mode(ORBIT)
        if result == Result.ACCEPTED:
            self._navigator.orbit = Orbit(*place, radius_m, speed_m_s)
        return result

    def _mission_start(self, _: Command) -> Result:
        """Start the mission; this command arms, too."""
        if not self._plans.feasible:
            text = "Mission start denied! No valid mission"
            self._announcer.alert(text, "commander_mission_start_denied_no_mission")
            return Result.DENIED
        result = self._commander.set_mode(MISSION)
        return self._commander.arm(BY_MISSION) if result == Result.ACCEPTED else result

    def _set_home(self, command: Command) -> Result:
        if command.p[0] != 1 or self._state.stage < Stage.HOME_SET:
            return Result.DENIED
        self._state.set_home()
        return Result.ACCEPTED

    def _set_message_interval(self, command: Command) -> Result:
        name, interval_us = self._telemetry.name_of(_int(command.p[0])), command.p[1]
        if name is None or not math.isfinite(interval_us):
            return Result.FAILED
        if interval_us < 0:
            interval_ms = 0
        elif interval_us == 0:
            hz = BACK_TO_HZ.get(name, 0.0)
            interval_ms = round(1000 / hz) if hz else self._streams.default_ms(name)
        else:
            interval_ms = max(1, round(interval_us / 1000))
        self._streams.ask(name, interval_ms, self._clock.now_us)
        return Result.ACCEPTED

    def _get_message_interval(self, command: Command) -> Result:
        self._telemetry.report_interval(_int(command.p[0]))
        return Result.ACCEPTED

    def _request_message(self, command: Command) -> Result:
        if _int(command.p[0]) == _AVAILABLE_MODES:
            return self._send_available_modes(_int(command.p[1]))
        name = self._telemetry.name_of(_int(command.p[0]))
        return Result.ACCEPTED if name is not None and self._telemetry.report(name) else Result.DENIED

    def _send_available_modes(self, index: int) -> Result:
        """Send one mode, or all for index 0. Modes with a standard mode have no name."""
        if not 0 <= index <= len(AVAILABLE):
            return Result.DENIED
        for number, mode in enumerate(AVAILABLE, 1):
            if index in (0, number):
                self._outbox.send(
                    "AVAILABLE_MODES",
                    number_modes=len(AVAILABLE),
                    mode_index=number,
                    standard_mode=mode.standard,
                    custom_mode=mode.custom,
                    properties=mode.properties,
                    mode_name=mode.name.encode("ascii"),
                )
        return Result.ACCEPTED

    def _reboot(self, command: Command) -> Result:
        """Refuse to reboot, as PX4 does in a simulation; 0 stands for doing nothing."""
        return Result.ACCEPTED if command.p[0] == 0 else Result.DENIED

    def _legacy_request(self, name: str) -> Callable[[Command], Result]:
        """Return the handler of a command from before REQUEST_MESSAGE."""
        return lambda _: Result.ACCEPTED if self._telemetry.report(name) else Result.DENIED


def _int(value: float) -> int:
    """Return a value as an integer, with 0 for NaN and infinity."""
    return int(value) if math.isfinite(value) else 0
