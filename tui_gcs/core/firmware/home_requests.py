"""Requests HOME_POSITION from vehicles in the air without a known home: they could not be returned."""

import math

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink import commands as c
from tui_gcs.core.uplink.commands import CommandService

ASK_AGAIN_S, ASK_SELDOM_S, FREQUENT_ASKS = 2.0, 20.0, 5
"""Seconds between requests to a vehicle that has not answered; after `FREQUENT_ASKS` of them the longer time."""


class HomeRequests:
    """Repeats the request until an answer comes.

    A station that finds vehicles in the air did not see where they took off.
    """

    def __init__(self, command_encoder: CommandEncoder, commands: CommandService, clock: Clock) -> None:
        self._encoder, self._commands, self._clock = command_encoder, commands, clock
        self._asked: dict[int, tuple[float, int]] = {}
        """When it was requested last, and how often, by vehicle."""

    def tick(self, vehicle: Vehicle) -> None:
        """Request it from one vehicle when that is due."""
        state, now = vehicle.telemetry, self._clock.now()
        if state.home_m is not None or not state.airborne or not vehicle.identity.identified:
            return
        if vehicle.path.high_latency or not self._encoder.is_ours(vehicle):
            return
        asked_s, times = self._asked.get(vehicle.id, (-math.inf, 0))
        if now - asked_s >= (ASK_AGAIN_S if times < FREQUENT_ASKS else ASK_SELDOM_S):
            self._asked[vehicle.id] = (now, times + 1)
            self._commands.question(vehicle.id, c.CMD_REQUEST_MESSAGE)
            self._encoder.ask(vehicle.id, c.CMD_REQUEST_MESSAGE, c.HOME_POSITION)

    def forget(self, vehicle: Vehicle) -> None:
        """The vehicle rebooted, or is another one."""
        self._asked.pop(vehicle.id, None)
