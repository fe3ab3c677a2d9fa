"""The check of a vehicle's terrain data before a mission with heights above the ground is sent.

Measured on a real ArduCopter without terrain data: it accepts such a target without complaint and sinks into the ground
at 1.5 m/s (docs/autopilots.md "Dangerous things first"). Only the ground under the vehicle is asked for, not the
ground along the mission.
"""

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.commands import CMD_REQUEST_MESSAGE
from tui_gcs.core.services.context import ServiceContext

TERRAIN_REPORT = 136
TRIES, GAP_S = 4, 0.8
NO_DATA = "heights are above the ground, and it has no terrain data: it would sink into the ground"
NO_ANSWER = "heights are above the ground, and it did not say whether it has terrain data"


class TerrainCheck:
    """Requests TERRAIN_REPORT until one has arrived."""

    def __init__(self, context: ServiceContext) -> None:
        """Prepare the check; `tick` sends the requests."""
        self._context = context
        self._began_s = self._next_s = context.clock.now()
        self._tries = 0
        self.answer: str | None = None
        """"" if the vehicle has terrain data, else why the mission must not be sent; None before it has answered."""

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat the request, or take the answer."""
        if vehicle.silent_s(TERRAIN_REPORT, now) < now - self._began_s:
            message = self._context.fleet.newest(vehicle, TERRAIN_REPORT)
            # Only an existing grid (spacing > 0) that is completely loaded (nothing pending) counts.
            if message is not None and not message.fields["pending"]:
                self.answer = "" if message.fields["spacing"] > 0 else NO_DATA
                return
        if now < self._next_s:
            return
        if self._tries == TRIES:
            self.answer = NO_ANSWER
            return
        self._tries, self._next_s = self._tries + 1, now + GAP_S
        self._context.commands.question(vehicle.id, CMD_REQUEST_MESSAGE)
        self._context.request_message(vehicle.id, TERRAIN_REPORT, copy=self._tries - 1)
