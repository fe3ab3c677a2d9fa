"""A path to a vehicle: one source, that is one address on one link, that brings frames with its system id."""

import math
from dataclasses import dataclass, field
from enum import StrEnum

from tui_gcs.core.fleet.identity.boot_clock import BootClock
from tui_gcs.core.fleet.identity.path_correlation import PathCorrelation
from tui_gcs.core.mavlink.sources import Slot, Source, Stream

HEARTBEAT, GLOBAL_POSITION_INT, HIGH_LATENCY2 = 0, 33, 235


class PathState(StrEnum):
    """What a way to a vehicle is good for."""

    USED = "used"
    """It is this vehicle: its frames count, and commands may go there."""
    CANDIDATE = "asked who it is"
    """Another link brings frames with this id; whether it is the same vehicle is not known yet."""
    CONFLICT = "conflict"
    """Somebody else with the same id, or a forger: nothing from there is used, and nothing is sent there."""


@dataclass(eq=False, slots=True)
class Path:
    """One way to a vehicle: a source that brings frames with its system id."""

    source: Source
    state: PathState
    since_s: float
    streams: list[Stream] = field(default_factory=list)
    autopilot_stream: Stream | None = None
    """What its autopilot's component sends this way; None before anything came."""
    slots: dict[int, Slot] = field(default_factory=dict)
    """Newest frame per message id, of the autopilot's component."""
    boot_clock: BootClock = field(default_factory=BootClock)
    uid: str = ""
    """Hardware id that was answered over this path."""
    version_requests: int = 0
    next_request_s: float = -math.inf
    answered: bool = False
    """AUTOPILOT_VERSION came over this path while it was asked who it is."""
    heartbeats_s: list[float] = field(default_factory=list)
    """Newest heartbeats while it was not accepted."""
    correlation: PathCorrelation | None = None
    """Its positions compared with the vehicle's, while it was not accepted."""
    contradicts_since_s: float = math.inf
    """Since when what comes this way contradicts what is known of the vehicle."""
    repeated_frames: int = 0
    """Signed frames that another path had brought just before."""
    matching_positions: int = 0
    """Positions that an accepted path brought bit for bit, boot time included."""
    proven_s: float = -math.inf
    """When a good signature last came this way while it was not accepted."""
    displaced: bool = False
    """Another address on its link has taken over while this one was silent; it is used again when it speaks."""
    apart_checks: int = 0
    """How many looks in a row found its positions far from those of the path in use."""
    ahead_checks: int = 0
    """How many looks in a row found this path's news newer than those of the path in use."""

    @property
    def heard_s(self) -> float:
        """When its autopilot was last heard this way: a companion, a camera or a modem may outlive it."""
        return self.autopilot_stream.heard_s if self.autopilot_stream is not None else -math.inf

    @property
    def position(self) -> Slot | None:
        """The newest GLOBAL_POSITION_INT that came over this path; None if none did."""
        return self.slots.get(GLOBAL_POSITION_INT)

    @property
    def high_latency(self) -> bool:
        """Only HIGH_LATENCY2 comes this way: a satellite link, silent most of the time."""
        return HIGH_LATENCY2 in self.slots and HEARTBEAT not in self.slots

    def boot_offset_s(self, since_s: float = -math.inf) -> float:
        """Station time minus the vehicle's boot clock in its newest position; NaN if none came this way `since_s`."""
        slot = self.slots.get(HIGH_LATENCY2 if self.high_latency else GLOBAL_POSITION_INT)
        if slot is None or not slot.raw or slot.t_s < since_s:
            return math.nan
        return slot.t_s - float(slot.values()[0]) / 1e3
