"""One vehicle as this station knows it: identity, newest telemetry, how old each part is."""

import math
from dataclasses import dataclass, field

from tui_gcs.core.links import Address
from tui_gcs.core.messages import Freshness, Vec3

NAN = math.nan
UNKNOWN_POSITION: Vec3 = (NAN, NAN, NAN)

STALE_S = 3.0
"""No position for this long: stale (architecture.md)."""
LOST_S = 3.5
"""No frame at all for this long: LOST (architecture.md; QGC VehicleLinkManager uses the same)."""

LANDED_ON_GROUND = 1
"""MAV_LANDED_STATE_ON_GROUND in EXTENDED_SYS_STATE.landed_state."""


@dataclass
class Vehicle:
    """Mutable telemetry of one system id. Times are the station's monotonic seconds."""

    id: int
    link: str
    address: Address
    autopilot: int
    type: int
    component: int = 1
    custom_mode: int = 0
    armed: bool = False
    system_status: int = 0
    heard_s: float = -math.inf
    heartbeat_s: float = -math.inf
    position_s: float = -math.inf
    lat_deg: float = NAN
    lon_deg: float = NAN
    alt_rel_m: float = NAN
    alt_amsl_m: float = NAN
    position_m: Vec3 = UNKNOWN_POSITION
    velocity_m_s: Vec3 = (NAN, NAN, NAN)
    heading_deg: float = NAN
    boot_ms: int = 0
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
    frames: int = 0
    lost_frames: int = 0
    message_s: dict[int, float] = field(default_factory=dict)
    """When each message id last came."""
    last_seq: dict[int, int] = field(default_factory=dict)
    """Newest sequence number per component."""
    recent_reasons: list[tuple[float, str]] = field(default_factory=list)
    """(time, text) of the newest status texts that may explain a refusal."""
    suspect_jumps: int = 0
    """How many positions in a row are far from the last used one and near each other."""
    suspect_m: Vec3 = UNKNOWN_POSITION
    """The newest of these."""
    reboots: int = 0
    home_m: Vec3 | None = None
    """Where the autopilot says home is (HOME_POSITION), ENU."""

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
    def loss_pct(self) -> float:
        """Share of frames that never came, 0…100."""
        total = self.frames + self.lost_frames
        return 100.0 * self.lost_frames / total if total else 0.0

    def has_position(self) -> bool:
        """Whether a valid position was ever received."""
        return not math.isnan(self.position_m[0])

    def freshness(self, now: float) -> Freshness:
        """OK, STALE or LOST at time `now`."""
        if now - self.heard_s > LOST_S:
            return Freshness.LOST
        if now - self.position_s > STALE_S:
            return Freshness.STALE
        return Freshness.OK

    def silent_s(self, message: int, now: float) -> float:
        """Time since message id `message` last came from its autopilot."""
        return now - self.message_s.get(message, -math.inf)

    def count_sequence(self, component: int, seq: int) -> None:
        """Loss statistics; a gap above 128 counts as reordering, not as loss."""
        last = self.last_seq.get(component)
        self.frames += 1
        if last is not None:
            gap = (seq - last - 1) % 256
            if gap >= 128:
                return
            self.lost_frames += gap
        if last is not None or len(self.last_seq) < 16:
            self.last_seq[component] = seq

    def reasons_since(self, t_s: float) -> list[str]:
        """Warning texts this vehicle sent since `t_s`, oldest first, each once."""
        return list(dict.fromkeys(text for when, text in self.recent_reasons if when >= t_s))
