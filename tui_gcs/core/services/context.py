"""The parts of a station that every MAVLink service needs."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import StopReason
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink.commands import CMD_REQUEST_MESSAGE, CMD_SET_MESSAGE_INTERVAL
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass, VehicleAction
from tui_gcs.core.uplink.commands import CommandService
from tui_gcs.core.uplink.jobs import JobQueue
from tui_gcs.core.uplink.uplink import Uplink

SLOW_BYTES_PER_S = 10_000
"""A link with less is a telemetry radio, or as slow as one."""


ActionDone = Callable[[VehicleAction, Outcome, str], None]


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

    def forget_with(self, forget: Callable[[Vehicle], None], *, reboot: bool = True) -> None:
        """Call `forget` for vehicles that are gone or replaced by another one, and with `reboot` for rebooted ones."""
        self.fleet.on_gone(forget)
        self.fleet.paths.on_replace.append(forget)
        if reboot:
            self.fleet.paths.on_reboot.append(forget)

    def request_message(self, vehicle_id: int, message: int, *params: float, copy: int = 0, **fields: int) -> None:
        """Send MAV_CMD_REQUEST_MESSAGE. `params` are those of the message, `fields` replace fields of COMMAND_LONG."""
        order = MavCommand(CMD_REQUEST_MESSAGE, (message, *params))
        self.uplink.ask(vehicle_id, order.message, **order.fields(copy) | fields)

    def set_interval(
        self, vehicle_id: int, name: str, message: int, interval_us: float, on_done: ActionDone | None = None
    ) -> None:
        """Have a vehicle send a message every `interval_us` (-1: never, 0: as by default), until it acknowledges."""
        order = MavCommand(CMD_SET_MESSAGE_INTERVAL, (message, interval_us))
        action = VehicleAction(
            vehicle_id,
            name,
            RetryClass.SET,
            send=lambda copy: self.uplink.ask(vehicle_id, order.message, **order.fields(copy)),
            confirmed=lambda _: action.acked_s is not None,
            command=order.command,
            on_done=on_done,
            housekeeping=True,
        )
        self.commands.submit(action)

    def submit_order(
        self,
        vehicle_id: int,
        name: str,
        order: MavCommand,
        on_done: ActionDone | None = None,
        *,
        confirmed: Callable[[], bool] = lambda: False,
        stop: StopReason | None = None,
    ) -> None:
        """Send a command until the vehicle acknowledges it, or `confirmed` is true; with `stop` over every path."""
        action = VehicleAction(
            vehicle_id,
            name,
            RetryClass.SET,
            send=lambda copy: self.uplink.action(vehicle_id, action.as_order(), order.message, **order.fields(copy)),
            confirmed=lambda _: action.acked_s is not None or confirmed(),
            command=order.command,
            on_done=on_done,
            stop=stop,
        )
        self.commands.submit(action)
