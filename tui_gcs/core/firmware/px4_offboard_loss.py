"""What PX4 does when the set-points of OFFBOARD stop: COM_OBL_RC_ACT, read from each vehicle before it may start.

Hold, Return and the pilot's modes that sink slowly (PX4's default is one of them) are shown before the start, and the
start confirmation accepts them. Falling, landing where it is, terminating and disarming in the air are refused.
"""

import math
import struct
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink import commands as c
from tui_gcs.core.uplink.commands import CommandService

PARAMETER = "COM_OBL_RC_ACT"
TYPE_INT32 = 6
"""MAV_PARAM_TYPE_INT32; PX4 sends its bytes in the float (PARAM_ENCODE_BYTEWISE)."""
# Without ever having had a pilot's sticks 1.16.1 sinks in Position mode: of four that lost their station one landed
# and disarmed, the others were sinking when they were sent home. With sticks at arming, and in 1.17 alpha, it
# returns. In a patrol of eight one sank at 0.6 to 0.9 m/s past another that held on the layer below, 2 to 3 m
# beside it. In Return all below RTL_RETURN_ALT climb to that one height.
ACTIONS = {
    0: "Position mode, without a pilot SINKS through the layers below",
    1: "Altitude mode, without a pilot SINKS through the layers below",
    2: "Manual mode, without a pilot FALLS",
    3: "RTL, at a height of its own",
    4: "lands where it is",
    5: "Hold",
    6: "TERMINATES the flight",
    7: "DISARMS in the air",
}
"""PX4's parameter reference; what 0 and 5 end in was measured."""
DANGEROUS = frozenset({2, 4, 6, 7})
"""Actions with which a vehicle must not fly by set-points."""
ASK_AGAIN_S, ASK_SELDOM_S, FREQUENT_ASKS = 2.0, 20.0, 5
"""Seconds between requests to a vehicle that has not answered; after `FREQUENT_ASKS` of them the longer time."""


class OffboardLoss:
    """Reads and remembers the parameter of every PX4 vehicle, and requests HOME_POSITION where home is not known."""

    def __init__(self, command_encoder: CommandEncoder, commands: CommandService, clock: Clock) -> None:
        self._encoder = command_encoder
        self._commands = commands
        self._clock = clock
        self._action: dict[int, int] = {}
        self._asked: dict[int, tuple[float, int]] = {}
        """When each was asked last, and how often."""

    def tick(self, vehicles: list[Vehicle]) -> None:
        """Request what is not known yet; seldom from vehicles that never answer."""
        now = self._clock.now()
        for vehicle in vehicles:
            unknown = vehicle.id not in self._action or vehicle.telemetry.home_m is None
            if (
                not unknown
                or not vehicle.identity.identified
                or vehicle.path.high_latency
                or not self._encoder.is_ours(vehicle)
            ):
                continue
            asked_s, times = self._asked.get(vehicle.id, (-math.inf, 0))
            if now - asked_s < (ASK_AGAIN_S if times < FREQUENT_ASKS else ASK_SELDOM_S):
                continue
            self._asked[vehicle.id] = (now, times + 1)
            if vehicle.id not in self._action:
                self._encoder.read_parameter(vehicle.id, PARAMETER)
            if vehicle.telemetry.home_m is None and not vehicle.telemetry.airborne:  # then: see `HomeRequests`
                self._commands.question(vehicle.id, c.CMD_REQUEST_MESSAGE)
                self._encoder.ask(vehicle.id, c.CMD_REQUEST_MESSAGE, c.HOME_POSITION)

    def hear(self, vehicle: Vehicle, fields: dict[str, Any]) -> None:
        """A PARAM_VALUE came: an answer, or a change that PX4 reports unasked."""
        if fields["param_id"] == PARAMETER and fields["param_type"] == TYPE_INT32:
            self._action[vehicle.id] = int(struct.unpack("<i", struct.pack("<f", fields["param_value"]))[0])

    def forget(self, vehicle: Vehicle) -> None:
        """The vehicle rebooted, or is another one."""
        self._action.pop(vehicle.id, None)
        self._asked.pop(vehicle.id, None)

    def problem(self, vehicle: Vehicle) -> str:
        """Why it must not fly by set-points, or ""."""
        action = self._action.get(vehicle.id)
        if action is None:
            return f"{PARAMETER} is not read yet: what it does without set-points is not known"
        if action in DANGEROUS or action not in ACTIONS:
            does = f"it {ACTIONS[action]}" if action in ACTIONS else "its behaviour is not known"
            return f"{PARAMETER} = {action}: without set-points {does}; set it to 5 (Hold) or 3 (RTL)"
        return ""

    def text(self, vehicle: Vehicle) -> str:
        """What it does when the set-points stop, in words."""
        action = self._action.get(vehicle.id)
        word = "unknown, not read yet" if action is None else ACTIONS.get(action, f"unknown action {action}")
        return f"after 1-2 s without set-points: {word} ({PARAMETER})"
