"""A vehicle as the station knows it: its paths, and records of its identity, telemetry and integrity.

One `Vehicle` exists per network and MAVLink system id. `fleet.VehicleRegistry` makes and removes it; `TelemetryDecoder`
fills the telemetry record, `PathSelector` and `SigningRegistry` the identity record. All times are the station's
monotonic seconds: a vehicle's own clock is never compared with them.
"""

import math
import struct
from dataclasses import dataclass, field
from enum import StrEnum

from tui_gcs.core.fleet.identity.duplicate_filter import DuplicateFilter
from tui_gcs.core.fleet.identity.heartbeat_history import HeartbeatHistory
from tui_gcs.core.fleet.identity.path import Path, PathState
from tui_gcs.core.mavlink.failsafe_texts import failsafe_words
from tui_gcs.core.mavlink.mode_names import mode_name
from tui_gcs.core.mavlink.sources import Address, Source
from tui_gcs.core.protocol.common import Freshness, Vec3

NAN = math.nan
UNKNOWN_POSITION: Vec3 = (NAN, NAN, NAN)

STALE_AFTER_S = 3.0
"""A vehicle without a new position for this long is stale (docs/architecture.md)."""
LOST_AFTER_S = 3.5
"""A vehicle without a frame of its autopilot for this long is LOST: see `Vehicle.freshness`. QGroundControl's
VehicleLinkManager uses the same."""
HIGH_LATENCY_LOST_AFTER_S = 120.0
"""A vehicle that is heard by HIGH_LATENCY2 only is stale or LOST after this time instead (PX4's COM_HLDL_LOSS_T)."""

LANDED_ON_GROUND = 1
"""MAV_LANDED_STATE_ON_GROUND in EXTENDED_SYS_STATE.landed_state."""
SIGNATURE_VALID_S = 3.0
"""Stops also go to an address that brought good signatures within this time, since the path in use may be a relay."""
IDS_PER_NETWORK = 1000
"""Vehicles of the station's n-th further network are numbered from n times this; the first network keeps MAVLink's
system ids."""


class Signing(StrEnum):
    """What the signatures on a vehicle's frames prove."""

    UNSIGNED = "unsigned"
    NOT_VERIFIED = "signed, not verified"
    """The frames are signed with the zero key, as PX4 does while signing is off: that proves nothing."""
    OURS = "signed by us"
    """The frames are signed with the key that we hold for this vehicle."""
    UNKNOWN_KEY = "unknown key"


# The payload of GLOBAL_POSITION_INT, which is read in place (common.xml); 10 bytes of header come before it.
POSITION_BYTES = 28
POSITION_AT = slice(10, 10 + POSITION_BYTES)
"""Where the payload of GLOBAL_POSITION_INT lies in a version 2 frame."""
_POSITION = struct.Struct("<IiiiihhhH")


def position_frame(position: tuple[int, ...]) -> bytes:
    """Return a version 2 frame, header zeroed, with these values of GLOBAL_POSITION_INT in wire order; b"" for none."""
    return bytes(POSITION_AT.start) + _POSITION.pack(*position) if position else b""


@dataclass(eq=False, slots=True)
class VehicleIdentity:
    """What is known of which vehicle it is, and whether that is proven."""

    first_heard_s: float = 0.0
    """When it was first heard, station time."""
    confirmed: bool = False
    """It sent more than one heartbeat, which anyone on an unsigned network could have forged."""
    uid: str = ""
    """Hardware id of AUTOPILOT_VERSION (uid2, else uid) as hex; "" if unknown."""
    uid_reported_s: float = -math.inf
    """When `uid` was last reported, station time."""
    identified: bool = False
    """AUTOPILOT_VERSION was received since it booted."""
    firmware_token: str = ""
    """First 8 bytes of AUTOPILOT_VERSION.flight_custom_version as hex; our simulator proves itself with it."""
    version_requested_s: float = -math.inf
    """When AUTOPILOT_VERSION was last requested over any path. The ACK of that request belongs to no command."""
    signing: Signing = Signing.UNSIGNED
    keyed: bool = False
    """We hold a signing key for it: only frames signed with it are believed, and all we send is signed."""
    blocked: str = ""
    """Why it must not be commanded (stops excepted), e.g. "several vehicles use id 3"; "" if it may be."""
    blocked_in_flight: bool = False
    """The block holds in the air, too, because what we send could reach another vehicle."""
    blocked_s: float = -math.inf
    """When the newest evidence for the block came, station time."""
    untrusted: str = ""
    """Why none of its frames prove its identity, so that it is not commanded; "" if they do or need not."""
    moved: str = ""
    """It is heard from a new address and has not been identified there; "" if that is not so."""
    watched: bool = False
    """The boot time of each of its positions is checked on arrival, because two vehicles may share its system id."""


@dataclass(eq=False, slots=True)
class VehicleTelemetry:
    """The newest values that its autopilot reported, checked by `TelemetryDecoder`. Times are station time."""

    custom_mode: int = 0
    armed: bool = False
    """True also while the reported bit flickers: a vehicle that might be armed is treated as armed."""
    system_status: int = 0
    """MAV_STATE of the newest heartbeat."""
    heartbeat_s: float = -math.inf
    """When its autopilot last sent HEARTBEAT."""
    high_latency_s: float = -math.inf
    """When HIGH_LATENCY2 last came."""
    position_s: float = -math.inf
    """When the newest position that is in use arrived."""
    position_raw: bytes = b""
    """The newest good GLOBAL_POSITION_INT as a version 2 frame; b"" before the first. `fix` decodes it."""
    _fix: tuple[int, ...] = ()
    _fix_of: bytes = b""
    position_m: Vec3 = UNKNOWN_POSITION
    """ENU metres in the scenario's frame; the height is above its home."""
    home_m: Vec3 | None = None
    """Its home by HOME_POSITION, ENU metres; None until `home_check` accepts one."""
    home_amsl_m: float = NAN
    """Height of `home_m` above mean sea level, metres; NaN when unknown."""
    gps_fix: int = 0
    """GPS_FIX_TYPE."""
    satellites: int = -1
    """Satellites visible; -1 when unknown."""
    battery_pct: float = NAN
    """Charge left, 0…100; NaN when unknown."""
    battery_v: float = NAN
    """Battery voltage; NaN when unknown."""
    has_battery_status: bool = False
    """BATTERY_STATUS was received: it replaces the battery fields of SYS_STATUS."""
    prearm_ok: bool = False
    """SYS_STATUS reports the pre-arm check as passed."""
    landed_state: int = 0
    """MAV_LANDED_STATE."""

    @property
    def alt_rel_m(self) -> float:
        """Height above its home, metres; NaN when unknown."""
        return self.position_m[2]

    @property
    def on_ground(self) -> bool:
        """Whether it is disarmed or reports that it has landed."""
        return not self.armed or self.landed_state == LANDED_ON_GROUND

    @property
    def airborne(self) -> bool:
        """Whether it is armed and either more than 2 m up or reported in the air."""
        return self.armed and (self.alt_rel_m > 2.0 or self.landed_state in (2, 3, 4))

    @property
    def ground_speed_m_s(self) -> float:
        """Horizontal speed, NaN when unknown."""
        return math.hypot(self.velocity_m_s[0], self.velocity_m_s[1])

    @property
    def fix(self) -> tuple[int, ...]:
        """The newest good position: values of GLOBAL_POSITION_INT in wire order and scaling; () before the first.

        It is decoded on access, because positions arrive more often than they are read.
        """
        raw = self.position_raw
        if raw is not self._fix_of:
            self._fix, self._fix_of = _POSITION.unpack_from(raw, POSITION_AT.start) if raw else (), raw
        return self._fix

    @fix.setter
    def fix(self, values: tuple[int, ...]) -> None:
        self.position_raw = position_frame(values)

    @property
    def lat_deg(self) -> float:
        """Latitude of the newest position, degrees; NaN when unknown."""
        return fix[1] / 1e7 if (fix := self.fix) else NAN

    @property
    def lon_deg(self) -> float:
        """Longitude of the newest position, degrees; NaN when unknown."""
        return fix[2] / 1e7 if (fix := self.fix) else NAN

    @property
    def alt_amsl_m(self) -> float:
        """Height above mean sea level, metres; NaN when unknown."""
        return fix[3] / 1e3 if (fix := self.fix) else NAN

    @property
    def velocity_m_s(self) -> Vec3:
        """Velocity east, north, up in m/s; NaN when unknown. MAVLink sends north, east, down in cm/s."""
        fix = self.fix
        if not fix:
            return UNKNOWN_POSITION
        _, _, _, _, _, vx, vy, vz, _ = fix
        return (vy / 100, vx / 100, -vz / 100)

    @property
    def heading_deg(self) -> float:
        """Direction of its nose, degrees clockwise from north; NaN when unknown."""
        return fix[8] / 100 if (fix := self.fix) and fix[8] <= 36000 else NAN

    def has_position(self) -> bool:
        """Return whether a valid position was ever received."""
        return not math.isnan(self.position_m[0])

    def forget_boot(self) -> None:
        """Reset what a reboot, or another vehicle with the same id, makes void (docs/threats.md B.6-103)."""
        self.prearm_ok, self.landed_state = False, 0
        self.home_m, self.home_amsl_m = None, NAN
        self.has_battery_status, self.battery_pct, self.battery_v = False, NAN, NAN
        self.gps_fix, self.satellites = 0, -1


@dataclass(eq=False, slots=True)
class VehicleIntegrity:
    """How far the reported telemetry can be relied on."""

    position_error_m: float = NAN
    """Horizontal accuracy that its GPS reports (h_acc, else HDOP times 2.5 m), metres; NaN when unknown."""
    suspect_jumps: int = 0
    """How many positions in a row were far from the last used one and near each other."""
    suspect_m: Vec3 = UNKNOWN_POSITION
    """The newest of these, ENU metres."""
    armed_bit: bool = False
    """The armed bit of the newest heartbeat; `VehicleTelemetry.armed` is what the station acts on."""
    flickers_s: list[float] = field(default_factory=list)
    """When the armed bit changed lately, station time."""
    reboots: int = 0
    """Reboots that were noticed since it was first heard."""

    def forget_boot(self) -> None:
        """Reset what a reboot, or another vehicle with the same id, makes void (docs/threats.md B.6-103)."""
        self.position_error_m, self.flickers_s, self.suspect_jumps = NAN, [], 0


@dataclass(eq=False, slots=True)
class Vehicle:
    """One vehicle: where it is heard, and records of its identity, telemetry and integrity."""

    id: int
    """Station-wide number: MAVLink's system id, plus `IDS_PER_NETWORK` for each network before its own."""
    system: int
    """MAVLink system id."""
    network: str
    path: Path
    """The path in use: telemetry is read from it, and commands are sent to it."""
    autopilot: int
    """MAV_AUTOPILOT."""
    type: int
    """MAV_TYPE."""
    component: int = 1
    """Component id of its autopilot."""
    paths: list[Path] = field(default_factory=list)
    """All paths, the one in use included."""
    identity: VehicleIdentity = field(default_factory=VehicleIdentity)
    telemetry: VehicleTelemetry = field(default_factory=VehicleTelemetry)
    integrity: VehicleIntegrity = field(default_factory=VehicleIntegrity)
    loss_pct: float = 0.0
    """Share of frames lost on the path in use, 0…100; measured once a second."""
    heartbeats: HeartbeatHistory = field(default_factory=HeartbeatHistory)
    """What its autopilot has sent, to tell a replay from a second vehicle."""
    duplicate_filter: DuplicateFilter | None = None
    """The duplicate filter; None while frames can come over one path only."""
    recent_reasons: list[tuple[float, str]] = field(default_factory=list)
    """(station time, text) of the newest status texts that may explain a refusal."""
    set_up: set[str] = field(default_factory=set)
    """Set-up procedures under way on it, e.g. "compass calibration"."""
    reboot_first: str = ""
    """What was set up since it booted and holds only from the next boot on; "" if nothing was."""
    rate_overrides: set[int] = field(default_factory=set)
    """Ids of messages at a rate that a service has set for a while: the telemetry rates leave them alone."""

    @property
    def last_heard_s(self) -> float:
        """When its autopilot was last heard over any accepted path."""
        # Nearly every vehicle has one path, and this is read for every vehicle at each tick.
        if len(self.paths) == 1:
            pilot = self.path.autopilot_stream
            return pilot.last_heard_s if pilot is not None else -math.inf
        return max(path.last_heard_s for path in self.paths if path.state is PathState.USED)

    @property
    def mode_name(self) -> str:
        """The pilot's word for the mode that it is in, e.g. "GUIDED", by our tables: the same in a whole fleet."""
        return mode_name(self.autopilot, self.type, self.telemetry.custom_mode)

    @property
    def link(self) -> str:
        """Name of the link in use."""
        return self.path.source.link

    @property
    def address(self) -> Address:
        """The address that frames for this vehicle are sent to."""
        return self.path.source.address

    def lost_after_s(self, now: float) -> float:
        """Return the silence in seconds after which it is LOST: longer while it also reports over a satellite."""
        # One HIGH_LATENCY2 among the normal streams of a path does not make that path a satellite link.
        distant = self.telemetry.high_latency_s - self.telemetry.heartbeat_s > LOST_AFTER_S or any(
            path.high_latency for path in self.paths
        )
        return (
            HIGH_LATENCY_LOST_AFTER_S
            if distant and now - self.telemetry.high_latency_s < HIGH_LATENCY_LOST_AFTER_S
            else LOST_AFTER_S
        )

    @property
    def why_not_commanded(self) -> str:
        """Why it must not be commanded now, stops excepted; "" if it may be."""
        if self.identity.blocked and (self.identity.blocked_in_flight or not self.telemetry.airborne):
            return self.identity.blocked
        return self.identity.untrusted or self.identity.moved

    @property
    def identity_problem(self) -> str:
        """What is wrong with its identity, and what that means for commands; "" if nothing is."""
        if self.why_not_commanded:
            return f"NOT COMMANDED: {self.why_not_commanded}"
        blocked = self.identity.blocked
        return f"{blocked}; this one is flown on" if blocked else ""

    @property
    def why_not_started(self) -> str:
        """Why it must not be started now, whatever it reports; "" if it may be: a set-up or a reboot is due."""
        if self.set_up:
            return f"{', '.join(sorted(self.set_up))} is under way"
        return f"{self.reboot_first}: reboot it before it flies" if self.reboot_first else ""

    def used_paths(self) -> list[Path]:
        """Return the accepted paths."""
        return [path for path in self.paths if path.state is PathState.USED]

    def stop_paths(self, now: float) -> list[Path]:
        """Return the paths that a stop is sent over: all accepted ones, and those with good signatures of late."""
        return [path for path in self.paths if path.state is PathState.USED or now - path.proven_s < SIGNATURE_VALID_S]

    def uses(self, source: Source) -> bool:
        """Return whether `source` is one of its accepted paths."""
        return any(path.source is source and path.state is PathState.USED for path in self.paths)

    def path_of(self, source: Source) -> Path | None:
        """Return its path over `source`, accepted or not; None if there is none."""
        return next((path for path in self.paths if path.source is source), None)

    def freshness(self, now: float) -> Freshness:
        """Return OK, STALE or LOST at station time `now`: the one place that decides whether a vehicle is lost.

        LOST: no frame of its autopilot for `lost_after_s`, over any accepted path. STALE: no position for 3 s, or 120 s
        while it reports by HIGH_LATENCY2.
        """
        silent_s = now - self.last_heard_s
        if silent_s > LOST_AFTER_S and silent_s > self.lost_after_s(now):
            return Freshness.LOST
        if now - self.telemetry.position_s > (
            HIGH_LATENCY_LOST_AFTER_S if self.telemetry.high_latency_s > self.telemetry.heartbeat_s else STALE_AFTER_S
        ):
            return Freshness.STALE
        return Freshness.OK

    def forget_boot(self) -> None:
        """Reset what a reboot, or another vehicle with the same id, makes void (docs/threats.md B.6-103)."""
        self.identity.identified, self.identity.firmware_token = False, ""
        self.telemetry.forget_boot()
        self.integrity.forget_boot()
        self.recent_reasons = []
        self.set_up, self.reboot_first = set(), ""

    def silent_s(self, message: int, now: float) -> float:
        """Return the seconds since its autopilot sent message id `message` over the path in use; infinite if never."""
        slot = self.path.slots.get(message)
        return now - slot.t_s if slot is not None else math.inf

    def reasons_since(self, t_s: float) -> list[str]:
        """Return the warning texts that it sent since station time `t_s`, oldest first, each once."""
        return list(dict.fromkeys(text for when, text in self.recent_reasons if when >= t_s))

    def failsafe_words(self, t_s: float) -> str:
        """Return its own words for the failsafe it reported since station time `t_s`; "" if it reported none."""
        return failsafe_words(self.reasons_since(t_s))
