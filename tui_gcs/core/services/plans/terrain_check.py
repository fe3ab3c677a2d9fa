"""Does a vehicle know the ground under it? Asked before a mission with heights above the ground is sent.

Measured on a real ArduCopter without terrain data: it takes such a target without a word and sinks at 1.5 m/s into the
ground (docs/autopilots.md "Dangerous things first"). What it knows of the ground elsewhere is not asked.
"""

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.uplink.actions import MavCommand

REQUEST_MESSAGE, TERRAIN_REPORT = 512, 136
TRIES, GAP_S = 4, 0.8
NO_DATA = "heights are above the ground, and it has no terrain data: it would sink into the ground"
NO_WORD = "heights are above the ground, and it did not say whether it has terrain data"


class TerrainCheck:
    """Asks for a TERRAIN_REPORT until one came."""

    def __init__(self, context: ServiceContext) -> None:
        """`tick` asks."""
        self._context = context
        self._began_s = self._next_s = context.clock.now()
        self._tries = 0
        self.answer: str | None = None
        """"" if it knows the ground, else why such a mission must not be sent; None: it did not answer yet."""

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Ask again, or take the answer. Only a grid that is there counts (spacing), wholly read (pending)."""
        if vehicle.silent_s(TERRAIN_REPORT, now) < now - self._began_s:
            message = self._context.fleet.newest(vehicle, TERRAIN_REPORT)
            if message is not None and not message.fields["pending"]:
                self.answer = "" if message.fields["spacing"] > 0 else NO_DATA
                return
        if now < self._next_s:
            return
        if self._tries == TRIES:
            self.answer = NO_WORD
            return
        self._tries, self._next_s = self._tries + 1, now + GAP_S
        self._context.commands.question(vehicle.id, REQUEST_MESSAGE)
        fields = MavCommand(REQUEST_MESSAGE, (TERRAIN_REPORT,)).fields(self._tries - 1)
        self._context.uplink.ask(vehicle.id, "COMMAND_LONG", **fields)
