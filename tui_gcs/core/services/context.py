"""What every MAVLink service is made of: whom it hears, how it speaks, whose turn it is, what time it is."""

from dataclasses import dataclass

from tui_gcs.core.clock import Clock
from tui_gcs.core.door import Door
from tui_gcs.core.events import EventLog
from tui_gcs.core.fleet import Fleet
from tui_gcs.core.services.command import CommandService
from tui_gcs.core.services.jobs import JobDesk


@dataclass(frozen=True)
class Context:
    """The parts of a station that services use."""

    fleet: Fleet
    """`fleet.on_message(name, listener)` hears vehicles' autopilots."""
    door: Door
    """`ask` for questions, `action` for what changes a vehicle, `transfer` for the parts of a begun action."""
    commands: CommandService
    jobs: JobDesk
    clock: Clock
    events: EventLog
    own_system: int
    """Our system id: who else is answered is not our business."""

    def is_for_us(self, fields: dict[str, int]) -> bool:
        """Whether a message with targets is meant for this station (or for everybody)."""
        return fields.get("target_system", 0) in (0, self.own_system)
