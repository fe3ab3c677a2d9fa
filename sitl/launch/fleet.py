"""All simulated vehicles of a run, stepped together; `SimFleet.step` is the only source of time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sitl.ardupilot.copter import ArduCopter
from sitl.common.autopilot import Autopilot, BootTiming
from sitl.common.platform import Identity
from sitl.common.vehicle_spec import AutopilotName, VehicleSpec
from sitl.launch.world import IntruderSpec, SensorSpec, World, WorldSpec
from sitl.physics.point_masses import PointMasses
from sitl.physics.quantities import Array
from sitl.physics.weather import WeatherSpec
from sitl.px4.multicopter import Px4

__all__ = ["AutopilotName", "IntruderSpec", "SensorSpec", "SimFleet", "VehicleSpec", "WeatherSpec", "WorldSpec"]

AUTOPILOTS: dict[str, type[Autopilot]] = {"ardupilot": ArduCopter, "px4": Px4}
# The proof that a vehicle is simulated travels in AUTOPILOT_VERSION.flight_custom_version, which has 8 bytes.
TOKEN_BYTES = 8
DEFAULT_VERSION = b"cef8bcef"
MIN_BOOT_S, MAX_BOOT_S = 0.5, 600.0
JITTER_US = 100_000
"""Vehicles are switched on within this time of each other, so that their heartbeats are not in step."""


class SimFleet:
    """Vehicles as MAVLink endpoints, indexed from 0. The same calls give the same bytes.

    Args:
        vehicles: The vehicles and their start places; system ids must differ.
        seed: Seed of everything random (switch-on times, board ids, weather, sensors).
        token: 16 hex digits, reported in AUTOPILOT_VERSION.flight_custom_version: proves which run made the vehicles.
        boot_s: Simulated time from power-on to readiness for arming (really 42 s in ArduCopter's GUIDED, 6 s for PX4).
        weather: Wind and GPS noise; there is neither by default.
        world: Intruders and the sensors that find them; there are none by default.

    Raises:
        ValueError: An id, a place, the token or the boot time is impossible.
    """

    def __init__(
        self,
        vehicles: Sequence[VehicleSpec],
        *,
        seed: int = 0,
        token: str = "",
        boot_s: float = 3.0,
        weather: WeatherSpec | None = None,
        world: WorldSpec | None = None,
    ) -> None:
        _check(vehicles)
        if not MIN_BOOT_S <= boot_s <= MAX_BOOT_S:
            raise ValueError(f"boot_s must be {MIN_BOOT_S:g} to {MAX_BOOT_S:g}, not {boot_s:g}")
        # Drawn in the order of the vehicles: the same seed and vehicles give the same boards and switch-on times.
        rng = np.random.default_rng(seed)
        version = _token_bytes(token)
        self.specs = tuple(vehicles)
        self._vehicles = PointMasses(vehicles, weather, seed)
        self._now_us = 0
        self._pilots: list[Autopilot] = [
            AUTOPILOTS[spec.autopilot](
                index,
                spec,
                self._vehicles,
                timing=BootTiming(round(boot_s * 1e6) - JITTER_US, int(rng.integers(JITTER_US))),
                identity=Identity(version, rng.bytes(16).hex()),
            )
            for index, spec in enumerate(vehicles)
        ]
        self.world = World(world, self._pilots, seed) if world is not None else None

    def __len__(self) -> int:
        return len(self.specs)

    @property
    def now_s(self) -> float:
        """Simulated time since the start."""
        return self._now_us / 1e6

    def step(self, dt_s: float) -> None:
        """Advance simulated time by up to 0.1 s (longer steps make autopilots late, not physics wrong)."""
        self._now_us += round(dt_s * 1e6)
        self._vehicles.step(dt_s)
        for pilot in self._pilots:
            pilot.tick(self._now_us)
        if self.world is not None:
            self.world.step(self.now_s, dt_s)

    def receive(self, index: int, data: bytes) -> None:
        """Hand one datagram to a vehicle; its answers are in the next `drain`."""
        pilot = self._pilots[index]
        if not (pilot.platform.outbox.silent or pilot.dead):
            pilot.receive(data)

    def drain(self) -> list[tuple[int, bytes]]:
        """Return the datagrams since the last call: vehicle index, and one frame each (plain text while booting)."""
        sent: list[tuple[int, bytes]] = []
        for pilot in self._pilots:
            outbox = pilot.platform.outbox
            if outbox.datagrams:
                sent.extend((pilot.index, datagram) for datagram in outbox.datagrams)
                outbox.datagrams = []
        return sent

    def silence(self, index: int) -> None:
        """Cut a vehicle's link in both directions; the vehicle flies on."""
        self._pilots[index].platform.outbox.silent = True

    def unsilence(self, index: int) -> None:
        """Restore a vehicle's link in both directions."""
        self._pilots[index].platform.outbox.silent = False

    def discharge(self, index: int, left: float) -> None:
        """Leave no more than this share (0 to 1) in a vehicle's battery."""
        self._pilots[index].discharge(left)

    def stop_draining(self, index: int) -> None:
        """Let a vehicle's battery keep its charge: from now on only `discharge` takes of it."""
        self._pilots[index].stop_draining()

    def fail_motor(self, index: int) -> None:
        """Let one motor of a vehicle fail: in the air it tumbles and falls, and its autopilot goes on trying to fly."""
        self._pilots[index].platform.body.fail_motor()

    def kill(self, index: int) -> None:
        """Let a vehicle's autopilot fail: it is silent for ever, and in the air it falls."""
        pilot = self._pilots[index]
        pilot.platform.outbox.silent = pilot.dead = True
        pilot.platform.state.armed = False
        pilot.platform.body.rest()

    def power_cycle(self, index: int) -> None:
        """Switch a vehicle off and on again; in the air it falls."""
        self._pilots[index].restart(self._now_us)

    def break_gps(self, index: int) -> None:
        """Take the GPS satellites away from a vehicle."""
        self._pilots[index].platform.state.lose_gps()

    def mend_gps(self, index: int) -> None:
        """Give the GPS satellites back to a vehicle."""
        self._pilots[index].platform.state.find_gps()

    def set_key(self, index: int, key: bytes, timestamp: int = 0) -> None:
        """Give a vehicle a signing key, as over a cable; an empty key ends signing."""
        self._pilots[index].platform.outbox.signer.take(key, timestamp)

    # What follows is the truth, for referees.

    @property
    def position_m(self) -> Array:
        """(n, 3) ENU metres about the first vehicle's start place; z is above each vehicle's own ground."""
        v, zero = self._vehicles, self._vehicles.origins
        x = (v.lon_deg - zero.lon_deg[0]) * zero.m_per_deg_lon[0]
        y = (v.lat_deg - zero.lat_deg[0]) * zero.m_per_deg_lat[0]
        return np.stack((x, y, v.position_m[:, 2]), axis=1)

    @property
    def velocity_m_s(self) -> Array:
        """(n, 3) velocities east, north and up."""
        return self._vehicles.velocity_m_s.copy()

    @property
    def lat_deg(self) -> Array:
        """(n,) true latitudes of the vehicles."""
        return self._vehicles.lat_deg

    @property
    def lon_deg(self) -> Array:
        """(n,) true longitudes of the vehicles."""
        return self._vehicles.lon_deg

    @property
    def alt_rel_m(self) -> Array:
        """(n,) heights above the ground at the start places."""
        return self._vehicles.position_m[:, 2].copy()

    @property
    def armed(self) -> NDArray[np.bool_]:
        """(n,) whether the motors are on."""
        return np.array([pilot.platform.state.armed for pilot in self._pilots], dtype=bool)

    @property
    def mode(self) -> NDArray[np.int64]:
        """(n,) modes, as in HEARTBEAT.custom_mode."""
        return np.array([pilot.platform.state.mode for pilot in self._pilots], dtype=np.int64)


def _token_bytes(token: str) -> bytes:
    if not token:
        return DEFAULT_VERSION
    try:
        raw = bytes.fromhex(token)
    except ValueError:
        raw = b""
    if len(raw) != TOKEN_BYTES:
        raise ValueError(f"token must be {2 * TOKEN_BYTES} hex digits, not {token!r}")
    return raw


def _check(vehicles: Sequence[VehicleSpec]) -> None:
    if not vehicles:
        raise ValueError("vehicles: at least one is needed")
    seen: set[int] = set()
    for spec in vehicles:
        if not 1 <= spec.system_id <= 255 or spec.system_id in seen:
            raise ValueError(f"system_id {spec.system_id}: must be 1..255 and used once")
        seen.add(spec.system_id)
        if not (abs(spec.lat_deg) < 89.0 and abs(spec.lon_deg) <= 180.0):
            raise ValueError(f"system_id {spec.system_id}: lat_deg must be within ±89, lon_deg within ±180")
        if spec.autopilot not in AUTOPILOTS:
            raise ValueError(f"system_id {spec.system_id}: autopilot must be one of {', '.join(AUTOPILOTS)}")
        if not all(np.isfinite((spec.ground_amsl_m, spec.heading_deg))):
            raise ValueError(f"system_id {spec.system_id}: ground_amsl_m and heading_deg must be finite")
