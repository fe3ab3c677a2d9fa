"""One vehicle as this station knows it: identity, ways to it, newest telemetry, how old each part is."""

import math
import struct
from dataclasses import dataclass, field
from enum import StrEnum

from tui_gcs.core.fleet.identity.duplicate_filter import Copies
from tui_gcs.core.fleet.identity.path import Path, PathState
from tui_gcs.core.mavlink.failsafe_texts import failsafe_words
from tui_gcs.core.mavlink.sources import Address, Source
from tui_gcs.core.protocol.common import Freshness, Vec3

NAN = math.nan
UNKNOWN_POSITION: Vec3 = (NAN, NAN, NAN)

STALE_S = 3.0
"""No position for this long: stale (architecture.md)."""
LOST_S = 3.5
"""No frame at all for this long: LOST (architecture.md; QGC VehicleLinkManager uses the same)."""

LANDED_ON_GROUND = 1
"""MAV_LANDED_STATE_ON_GROUND in EXTENDED_SYS_STATE.landed_state."""


HIGH_LATENCY_LOST_S = 120.0
"""The same for a vehicle that is only heard by HIGH_LATENCY2 (PX4's COM_HLDL_LOSS_T)."""
PROVEN_S = 3.0
"""Stops go to an address that brought good signatures within this time, too: the one in use may be a relay's."""
IDS_PER_NETWORK = 1000
"""Vehicles of the station's n-th further network are numbered from n times this; the first keeps MAVLink's ids."""


class Signing(StrEnum):
    """What the signatures of a vehicle's frames are worth."""

    UNSIGNED = "unsigned"
    NOT_VERIFIED = "signed, not verified"
    """With a key that proves nothing: PX4 signs with zeros when signing is off."""
    OURS = "signed by us"
    """With the key that we hold for this vehicle."""
    UNKNOWN_KEY = "unknown key"


POSITION_BYTES = 28
POSITION_AT = slice(10, 10 + POSITION_BYTES)
"""Where a version 2 frame has its GLOBAL_POSITION_INT."""
_POSITION = struct.Struct("<IiiiihhhH")


def as_frame(position: tuple[int, ...]) -> bytes:
    """Values of a GLOBAL_POSITION_INT, in wire order, where a version 2 frame would have them."""
    return bytes(POSITION_AT.start) + _POSITION.pack(*position) if position else b""


@dataclass(eq=False, slots=True)
class Vehicle:
    """Mutable telemetry of one vehicle. Times are the station's monotonic seconds."""

    id: int
    """Station-wide number: MAVLink's system id, plus `IDS_PER_NETWORK` for each network before its own."""
    system: int
    network: str
    path: Path
    """The way in use: telemetry is read from here, and what we send goes there."""
    autopilot: int
    type: int
    component: int = 1
    paths: list[Path] = field(default_factory=list)
    """All ways, the one in use included."""
    confirmed: bool = False
    """Was not just one heartbeat that anybody could have forged."""
    first_s: float = 0.0
    uid: str = ""
    """Hardware id from AUTOPILOT_VERSION (uid2, else uid) as hex; empty if unknown."""
    uid_s: float = -math.inf
    signing: Signing = Signing.UNSIGNED
    keyed: bool = False
    """We hold a signing key for it: only frames signed with it are believed, and all we send is signed."""
    blocked: str = ""
    """Why it must not be commanded (stops excepted), e.g. "two vehicles use id 3"; empty if it may."""
    blocked_in_flight: bool = False
    """The block holds in the air, too: what we send could reach another vehicle."""
    blocked_s: float = -math.inf
    """When the newest evidence for the block came."""
    untrusted: str = ""
    """Why nothing it sends proves who it is, so that it is not commanded; empty if all is well."""
    moved: str = ""
    """Heard from an address that nobody vouched for, and not known yet who it is; empty if all is well."""
    asked_s: float = -math.inf
    """When it was last asked who it is over any path; the ACK of that is nobody's."""
    watched: bool = False
    """Each of its positions is looked at as it comes: there may be two of them."""
    custom_mode: int = 0
    armed: bool = False
    system_status: int = 0
    heartbeat_s: float = -math.inf
    position_s: float = -math.inf
    position_raw: bytes = b""
    """The newest good GLOBAL_POSITION_INT, as a version 2 frame; empty before the first. `fix` are its numbers."""
    _fix: tuple[int, ...] = ()
    _fix_of: bytes = b""
    position_m: Vec3 = UNKNOWN_POSITION
    """ENU in the scenario's frame; the height is the one above its home."""
    gps_fix: int = 0
    satellites: int = -1
    battery_pct: float = NAN
    battery_v: float = NAN
    has_battery_status: bool = False
    prearm_ok: bool = False
    landed_state: int = 0
    firmware_token: str = ""
    """First 8 bytes of AUTOPILOT_VERSION.flight_custom_version as hex; our simulator proves itself with it."""
    identified: bool = False
    """AUTOPILOT_VERSION was received."""
    loss_pct: float = 0.0
    """Share of frames that never came over the path in use, 0…100; measured once a second."""
    copies: Copies | None = None
    """Frames of the last seconds, where the same may come over several paths."""
    recent_reasons: list[tuple[float, str]] = field(default_factory=list)
    """(time, text) of the newest status texts that may explain a refusal."""
    suspect_jumps: int = 0
    """How many positions in a row are far from the last used one and near each other."""
    suspect_m: Vec3 = UNKNOWN_POSITION
    """The newest of these."""
    position_error_m: float = NAN
    """What its GPS says of its accuracy (h_acc, else HDOP times 2.5 m); NaN when unknown."""
    high_latency_s: float = -math.inf
    """When HIGH_LATENCY2 last came."""
    armed_bit: bool = False
    """As the newest heartbeat had it; `armed` is what we take for true."""
    flickers_s: list[float] = field(default_factory=list)
    """When the armed bit changed lately."""
    reboots: int = 0
    set_up: set[str] = field(default_factory=set)
    """What is being set up on it now, e.g. "compass calibration"."""
    reboot_first: str = ""
    """What was set up since it booted and holds only from the next boot on; "" if nothing was."""
    lent: set[int] = field(default_factory=set)
    """Messages whose rate is somebody else's for now, and not telemetry's."""
    home_m: Vec3 | None = None
    """Where the autopilot says home is (HOME_POSITION), ENU. None until `home_check` accepts one."""
    home_amsl_m: float = NAN
    """The height of that above mean sea level; NaN when unknown."""

    @property
    def alt_rel_m(self) -> float:
        """Height above its home, NaN when unknown."""
        return self.position_m[2]

    @property
    def on_ground(self) -> bool:
        """True if landed for all we know: said so, or disarmed."""
        return not self.armed or self.landed_state == LANDED_ON_GROUND

    @property
    def airborne(self) -> bool:
        """Armed and off the ground."""
        return self.armed and (self.alt_rel_m > 2.0 or self.landed_state in (2, 3, 4))

    @property
    def ground_speed_m_s(self) -> float:
        """Horizontal speed, NaN when unknown."""
        return math.hypot(self.velocity_m_s[0], self.velocity_m_s[1])

    @property
    def heard_s(self) -> float:
        """When its autopilot was last heard, over any way that is known to be it."""
        if len(self.paths) == 1:  # nearly always, and asked often
            pilot = self.path.pilot
            return pilot.heard_s if pilot is not None else -math.inf
        return max(path.heard_s for path in self.paths if path.state is PathState.USED)

    @property
    def fix(self) -> tuple[int, ...]:
        """The newest good position in MAVLink's scaling and order; empty before the first.

        Numbers are made of it when somebody looks: it comes more often than that.
        """
        raw = self.position_raw
        if raw is not self._fix_of:
            self._fix, self._fix_of = _POSITION.unpack_from(raw, POSITION_AT.start) if raw else (), raw
        return self._fix

    @fix.setter
    def fix(self, values: tuple[int, ...]) -> None:
        self.position_raw = as_frame(values)

    @property
    def lat_deg(self) -> float:
        """Latitude of the newest position, NaN when unknown; so `lon_deg`."""
        return self.fix[1] / 1e7 if self.fix else NAN

    @property
    def lon_deg(self) -> float:
        """Longitude."""
        return self.fix[2] / 1e7 if self.fix else NAN

    @property
    def alt_amsl_m(self) -> float:
        """Height above mean sea level, NaN when unknown."""
        return self.fix[3] / 1e3 if self.fix else NAN

    @property
    def velocity_m_s(self) -> Vec3:
        """East, north, up; NaN when unknown. MAVLink has north, east, down in cm/s."""
        if not self.fix:
            return UNKNOWN_POSITION
        vx, vy, vz = self.fix[5:8]
        return (vy / 100, vx / 100, -vz / 100)

    @property
    def heading_deg(self) -> float:
        """Where its nose points, NaN when unknown."""
        return self.fix[8] / 100 if self.fix and self.fix[8] <= 36000 else NAN

    @property
    def link(self) -> str:
        """Name of the link in use."""
        return self.path.source.link

    @property
    def address(self) -> Address:
        """Where what we send to it goes."""
        return self.path.source.address

    def lost_after_s(self, now: float) -> float:
        """Silence after which it is LOST: longer while it speaks over a satellite, too.

        One HIGH_LATENCY2 among the normal streams of a way does not make it one.
        """
        distant = self.high_latency_s - self.heartbeat_s > LOST_S or any(path.high_latency for path in self.paths)
        return HIGH_LATENCY_LOST_S if distant and now - self.high_latency_s < HIGH_LATENCY_LOST_S else LOST_S

    @property
    def no_commands(self) -> str:
        """Why it must not be commanded now, stops excepted; "" if it may."""
        if self.blocked and (self.blocked_in_flight or not self.airborne):
            return self.blocked
        return self.untrusted or self.moved

    @property
    def no_start(self) -> str:
        """Why it must not be started now, whatever it says itself: it is being set up, or has to be rebooted."""
        if self.set_up:
            return f"{', '.join(sorted(self.set_up))} is under way"
        return f"{self.reboot_first}: reboot it before it flies" if self.reboot_first else ""

    def used_paths(self) -> list[Path]:
        """The ways on which it is this vehicle."""
        return [path for path in self.paths if path.state is PathState.USED]

    def stop_paths(self, now: float) -> list[Path]:
        """Where a stop goes: everywhere it is this vehicle, and where its signed frames came from just now."""
        return [path for path in self.paths if path.state is PathState.USED or now - path.proven_s < PROVEN_S]

    def uses(self, source: Source) -> bool:
        """Whether it is heard, as itself, from there."""
        return any(path.source is source and path.state is PathState.USED for path in self.paths)

    def path_of(self, source: Source) -> Path | None:
        """The path that `source` is, if it is one."""
        return next((path for path in self.paths if path.source is source), None)

    def has_position(self) -> bool:
        """Whether a valid position was ever received."""
        return not math.isnan(self.position_m[0])

    def freshness(self, now: float) -> Freshness:
        """OK, STALE or LOST at time `now`."""
        silent_s = now - self.heard_s
        if silent_s > LOST_S and silent_s > self.lost_after_s(now):
            return Freshness.LOST
        if now - self.position_s > (HIGH_LATENCY_LOST_S if self.high_latency_s > self.heartbeat_s else STALE_S):
            return Freshness.STALE
        return Freshness.OK

    def forget_boot(self) -> None:
        """It rebooted, or is another one: what was true before is not known any more (B.6-103)."""
        self.identified, self.firmware_token = False, ""
        self.prearm_ok, self.landed_state = False, 0
        self.home_m, self.home_amsl_m = None, NAN
        self.has_battery_status, self.battery_pct, self.battery_v = False, NAN, NAN
        self.gps_fix, self.satellites, self.position_error_m = 0, -1, NAN
        self.recent_reasons, self.flickers_s, self.suspect_jumps = [], [], 0
        self.set_up, self.reboot_first = set(), ""

    def silent_s(self, message: int, now: float) -> float:
        """Time since message id `message` last came from its autopilot, over the path in use."""
        slot = self.path.slots.get(message)
        return now - slot.t_s if slot is not None else math.inf

    def reasons_since(self, t_s: float) -> list[str]:
        """Warning texts this vehicle sent since `t_s`, oldest first, each once."""
        return list(dict.fromkeys(text for when, text in self.recent_reasons if when >= t_s))

    def failsafe_words(self, t_s: float) -> str:
        """Why it acts by itself, in its own words since `t_s`; "" if it said nothing of a failsafe."""
        return failsafe_words(self.reasons_since(t_s))
