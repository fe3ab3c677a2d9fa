"""The parts of a station that every MAVLink service needs."""

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
"""A link with less is a telemetry radio, or as slow as one."""


@dataclass(frozen=True)
class ServiceContext:
    """The parts of a station that services use."""

    fleet: VehicleRegistry
    """`fleet.on_message(name, listener)` passes on the messages of vehicles' autopilots."""
    uplink: Uplink
    """`ask` sends requests, `action` what changes a vehicle, `transfer` the later parts of an action."""
    commands: CommandService
    jobs: JobQueue
    clock: Clock
    events: EventLog
    own_system: int
    """This station's system id: messages to other stations are ignored."""
    specs: dict[str, LinkSpec] = field(default_factory=dict)
    """All links by name."""
    folder: Path | None = None
    """The folder of downloads and caches (mode 0700); None if nothing is written."""

    def is_slow(self, link: str) -> bool:
        """Whether transfers over a link must be modest: a telemetry radio, or less than 10 kB/s."""
        spec = self.specs.get(link)
        return spec is not None and (
            spec.scheme == "serial" or (spec.bytes_per_s or SLOW_BYTES_PER_S) < SLOW_BYTES_PER_S
        )

    def is_for_us(self, fields: dict[str, int]) -> bool:
        """Whether a message is addressed to this station, or to all systems."""
        return fields.get("target_system", 0) in (0, self.own_system)
