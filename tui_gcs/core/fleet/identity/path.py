"""A path to a vehicle: one source, that is one address on one link, that brings frames with its system id."""

import math
from dataclasses import dataclass, field
from enum import StrEnum

from tui_gcs.core.fleet.identity.boot_clock import BootClock
from tui_gcs.core.fleet.identity.path_correlation import PathCorrelation
from tui_gcs.core.mavlink.sources import Slot, Source, Stream

# Message ids. HIGH_LATENCY2 takes the place of all others on satellite links (docs/autopilots.md C9).
HEARTBEAT, GLOBAL_POSITION_INT, HIGH_LATENCY2 = 0, 33, 235


class PathState(StrEnum):
    """Whether a path may be used for its vehicle."""

    USED = "used"
    """The path leads to this vehicle: its frames count, and commands may be sent over it."""
    CANDIDATE = "asked for its identity"
    """Another link brings frames with this id; whether it is the same vehicle is being asked."""
    CONFLICT = "conflict"
    """The source is another vehicle with the same id, or a forger: its frames are not used, and nothing is sent there.
    """


@dataclass(eq=False, slots=True)
class Path:
    """A path to one vehicle, with what is known of it for judging whether it may be used."""

    source: Source
    state: PathState
    since_s: float
    """When its first frame came, station time."""
    streams: list[Stream] = field(default_factory=list)
    """Senders behind this source that use the vehicle's system id."""
    autopilot_stream: Stream | None = None
    """The stream of the vehicle's autopilot over this path; None before its first frame."""
    slots: dict[int, Slot] = field(default_factory=dict)
    """Newest frame per message id, of the autopilot."""
    boot_clock: BootClock = field(default_factory=BootClock)
    """The vehicle's boot clock as it arrives over this path."""
    uid: str = ""
    """Hardware id that AUTOPILOT_VERSION reported over this path; "" if unknown."""
    version_requests: int = 0
    """How many times AUTOPILOT_VERSION was requested over this path while it was not accepted."""
    next_request_s: float = -math.inf
    """When AUTOPILOT_VERSION is requested next, station time."""
    answered: bool = False
    """AUTOPILOT_VERSION came over this path while it was not accepted."""
    heartbeats_s: list[float] = field(default_factory=list)
    """When the newest heartbeats came while it was not accepted."""
    replayed: int | None = None
    """Number of the vehicle's heartbeat that came over it last, in `HeartbeatHistory`; None before the first."""
    replays: bool = False
    """Its last heartbeat was one that the vehicle had sent before, in order: somebody replays."""
    correlation: PathCorrelation | None = None
    """Comparison of its positions with the vehicle's; None before the first, and once it is accepted."""
    contradicts_since_s: float = math.inf
    """Since when it has contradicted what is known of the vehicle; infinite while it does not."""
    repeated_frames: int = 0
    """How many signed frames came that another path had brought just before."""
    matching_positions: int = 0
    """How many positions came that are bit for bit those of an accepted path, boot time included."""
    proven_s: float = -math.inf
    """When a good signature last came while it was not accepted."""
    displaced: bool = False
    """Another address on its link took over while this one was silent; it is used again once it is heard."""
    apart_checks: int = 0
    """In how many checks in a row its positions were far from those of the path in use."""
    ahead_checks: int = 0
    """In how many checks in a row it was fresher than the path in use."""
    up_way_dead: bool = False
    """The vehicle is heard over it, and nothing that is sent over it arrives (`services/up_ways.py` finds that): it is
    not used while there is another one."""

    @property
    def last_heard_s(self) -> float:
        """When the autopilot was last heard over this path.

        Companions, cameras and modems do not count: they may outlive it.
        """
        return self.autopilot_stream.last_heard_s if self.autopilot_stream is not None else -math.inf

    @property
    def position(self) -> Slot | None:
        """The newest GLOBAL_POSITION_INT that came over this path; None if none did."""
        return self.slots.get(GLOBAL_POSITION_INT)

    @property
    def high_latency(self) -> bool:
        """Whether HIGH_LATENCY2 comes over this path and no HEARTBEAT: a satellite link, silent most of the time."""
        return HIGH_LATENCY2 in self.slots and HEARTBEAT not in self.slots

    def boot_offset_s(self, since_s: float = -math.inf) -> float:
        """Return station time minus boot clock of the newest position; NaN if none came this way since `since_s`."""
        slot = self.slots.get(HIGH_LATENCY2 if self.high_latency else GLOBAL_POSITION_INT)
        if slot is None or not slot.raw or slot.t_s < since_s:
            return math.nan
        return slot.t_s - float(slot.values()[0]) / 1e3
