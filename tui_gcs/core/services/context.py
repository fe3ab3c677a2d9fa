"""What every MAVLink service is made of: whom it hears, how it speaks, whose turn it is, what time it is."""

from dataclasses import dataclass, field
from pathlib import Path

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.uplink.commands import CommandService
from tui_gcs.core.uplink.jobs import JobQueue
from tui_gcs.core.uplink.uplink import Uplink

SLOW_BYTES_PER_S = 10_000
"""Less is a telemetry radio, or as bad."""


@dataclass(frozen=True)
class ServiceContext:
    """The parts of a station that services use."""

    fleet: VehicleRegistry
    """`fleet.on_message(name, listener)` hears vehicles' autopilots."""
    uplink: Uplink
    """`ask` for questions, `action` for what changes a vehicle, `transfer` for the parts of a begun action."""
    commands: CommandService
    jobs: JobQueue
    clock: Clock
    events: EventLog
    own_system: int
    """Our system id: who else is answered is not our business."""
    specs: dict[str, LinkSpec] = field(default_factory=dict)
    """All links by name: which of them are slow."""
    folder: Path | None = None
    """Where downloads and caches are kept (0700); None: nothing is written."""

    def is_slow(self, link: str) -> bool:
        """Whether transfers over that link must be modest: a telemetry radio, or less than 10 kB/s."""
        spec = self.specs.get(link)
        return spec is not None and (
            spec.scheme == "serial" or (spec.bytes_per_s or SLOW_BYTES_PER_S) < SLOW_BYTES_PER_S
        )

    def is_for_us(self, fields: dict[str, int]) -> bool:
        """Whether a message with targets is meant for this station (or for everybody)."""
        return fields.get("target_system", 0) in (0, self.own_system)
