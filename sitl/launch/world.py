"""Intruders, and the cameras with which the vehicles of a fleet find them; both from a seed.

An intruder flies straight from its start to its goal and stays there. One that a vehicle comes close to turns round,
flies back to its start and disappears. Each flying vehicle looks around a few times a second, and reports what it finds
by CAMERA_TRACKING_GEO_STATUS from a camera component of its own.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sitl.common.autopilot import Autopilot
from sitl.links.wire import Encoder
from sitl.physics.quantities import Array

CAMERA = 100
"""MAV_COMP_ID_CAMERA."""
# MAV_TYPE, MAV_AUTOPILOT and MAV_STATE of the camera's heartbeat.
TYPE_CAMERA, AUTOPILOT_INVALID, STATE_ACTIVE = 30, 8, 4
TRACKING_ACTIVE = 1
MET_M = 20.0
"""An intruder that is observed from this distance is countered: it turns round (docs/planning.md C3)."""
HEIGHT_SIGMA_M = 3.0
"""Standard deviation of reported heights."""


@dataclass(frozen=True)
class IntruderSpec:
    """One intruder: its start, its goal, its speed, and when it begins."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    goal_lat_deg: float
    goal_lon_deg: float
    speed_m_s: float
    begin_s: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError for numbers that are not a flight."""
        numbers = (self.lat_deg, self.lon_deg, self.alt_amsl_m, self.goal_lat_deg, self.goal_lon_deg, self.begin_s)
        if not all(map(math.isfinite, numbers)) or not 0.0 < self.speed_m_s <= 100.0:
            raise ValueError("an intruder needs finite places and a speed of up to 100 m/s")


@dataclass(frozen=True)
class SensorSpec:
    """The camera of every vehicle."""

    range_m: float = 60.0
    rate_hz: float = 5.0
    probability: float = 0.9
    """Probability of finding an intruder within range, at each look."""
    false_per_min: float = 0.0
    """False alarms of each vehicle per minute."""
    sigma_m: float = 2.0
    """Standard deviation of the places that it reports."""

    def __post_init__(self) -> None:
        """Raise ValueError for numbers that are not a camera."""
        numbers = (self.range_m, self.rate_hz, self.false_per_min, self.sigma_m)
        if not all(math.isfinite(n) and n >= 0.0 for n in numbers) or not 0.0 <= self.probability <= 1.0:
            raise ValueError("a sensor needs range, rate, false alarms and sigma of 0 or more, and a probability")
        if not 0.1 <= self.rate_hz <= 20.0:
            raise ValueError(f"a sensor looks 0.1 to 20 times a second, not {self.rate_hz:g}")


@dataclass(frozen=True)
class WorldSpec:
    """The intruders of a run, and the camera that every vehicle has, if any."""

    intruders: tuple[IntruderSpec, ...] = ()
    sensor: SensorSpec | None = None


class World:
    """Intruders and cameras of one fleet: `step` moves the intruders and makes the vehicles report."""

    def __init__(self, spec: WorldSpec, pilots: Sequence[Autopilot], seed: int) -> None:
        self._spec = spec
        self._pilots = pilots
        # A generator of its own: sensors must not change the draws of the fleet, nor of the weather.
        self._rng = np.random.default_rng((seed, 2))
        self._look_s = 0.0
        self._beat_s = 0.0
        self._encoders = [Encoder(pilot.platform.spec.system_id, CAMERA) for pilot in pilots]
        origins = pilots[0].platform.body.masses.origins
        self._zero_deg = np.array((origins.lat_deg[0], origins.lon_deg[0]))
        self._m_per_deg = np.array((origins.m_per_deg_lat[0], origins.m_per_deg_lon[0]))
        self._start = np.array([self._enu(i.lat_deg, i.lon_deg) for i in spec.intruders]).reshape(-1, 2)
        self._goal = np.array([self._enu(i.goal_lat_deg, i.goal_lon_deg) for i in spec.intruders]).reshape(-1, 2)
        self._speed: Array = np.array([i.speed_m_s for i in spec.intruders])
        self._begin_s: Array = np.array([i.begin_s for i in spec.intruders])
        self._alt_amsl_m = [i.alt_amsl_m for i in spec.intruders]
        self.position_m: Array = self._start.copy()
        """(k, 2) places of the intruders, metres east and north of the first vehicle's start place."""
        self.velocity_m_s: Array = np.zeros_like(self._start)
        self.present = np.zeros(len(spec.intruders), dtype=bool)
        self.met_s: Array = np.full(len(spec.intruders), np.nan)
        """(k,) when a vehicle came close to each intruder; NaN before."""
        self._gone = np.zeros(len(spec.intruders), dtype=bool)

    @property
    def met(self) -> list[bool]:
        """Whether a vehicle came close to each intruder."""
        return [not math.isnan(met_s) for met_s in self.met_s.tolist()]

    def places_deg(self) -> list[tuple[float, float]]:
        """Return latitude and longitude of every intruder."""
        found = self._zero_deg + self.position_m[:, ::-1] / self._m_per_deg
        return [(lat_deg, lon_deg) for lat_deg, lon_deg in found.tolist()]

    def step(self, now_s: float, dt_s: float) -> None:
        """Advance by `dt_s` to `now_s`."""
        places = self._vehicle_places()
        self._fly(now_s, dt_s, places)
        if self._spec.sensor is None:
            return
        if now_s >= self._beat_s:
            self._beat_s = now_s + 1.0
            for index in range(len(self._pilots)):
                self._send(
                    index, "HEARTBEAT", type=TYPE_CAMERA, autopilot=AUTOPILOT_INVALID, system_status=STATE_ACTIVE
                )
        if now_s >= self._look_s:
            self._look_s = now_s + 1.0 / self._spec.sensor.rate_hz
            self._look(self._spec.sensor, places)

    def _vehicle_places(self) -> Array:
        """Return the (n, 2) places of vehicles in the air; NaN for the others."""
        places = np.full((len(self._pilots), 2), np.nan)
        masses = self._pilots[0].platform.body.masses
        for index, pilot in enumerate(self._pilots):
            if not pilot.platform.state.landed:
                x, y, _ = masses.position_m[index].tolist()
                places[index] = self._enu(*pilot.platform.body.to_geodetic(x, y))
        return places

    def _fly(self, now_s: float, dt_s: float, places: Array) -> None:
        for k in range(len(self._speed)):
            if self._gone[k] or now_s < self._begin_s[k]:
                self.present[k] = False
                continue
            self.present[k] = True
            fleeing = not np.isnan(self.met_s[k])
            way = (self._start[k] if fleeing else self._goal[k]) - self.position_m[k]
            left_m = float(np.hypot(*way))
            step_m = min(self._speed[k] * dt_s, left_m)
            self.velocity_m_s[k] = way / left_m * self._speed[k] if left_m > 1e-6 else 0.0
            self.position_m[k] += self.velocity_m_s[k] * (step_m / self._speed[k])
            if fleeing and left_m < 1.0:
                self._gone[k], self.present[k] = True, False
            elif not fleeing and np.nanmin(np.append(self._away_m(places, k), np.inf)) <= MET_M:
                self.met_s[k] = now_s

    def _away_m(self, places: Array, k: int) -> Array:
        gap = places - self.position_m[k]
        away: Array = np.hypot(gap[:, 0], gap[:, 1])
        return away

    def _look(self, sensor: SensorSpec, places: Array) -> None:
        # Drawn for all vehicles and intruders, in range or not: a vehicle elsewhere does not change the luck of the
        # others.
        found = self._rng.random((len(places), len(self._speed))) < sensor.probability
        false = self._rng.random(len(places)) < sensor.false_per_min / 60.0 / sensor.rate_hz
        for index in np.flatnonzero(np.isfinite(places[:, 0])).tolist():
            for k in np.flatnonzero(self.present & found[index]).tolist():
                if np.hypot(*(self.position_m[k] - places[index])) <= sensor.range_m:
                    self._report(index, sensor, self.position_m[k], self._alt_amsl_m[k])
            if false[index]:
                angle, share = self._rng.random(2) * (2.0 * math.pi, 1.0)
                away = sensor.range_m * math.sqrt(share) * np.array((math.cos(angle), math.sin(angle)))
                pilot = self._pilots[index]
                height_m = pilot.platform.body.true_height_m + pilot.platform.spec.ground_amsl_m
                self._report(index, sensor, places[index] + away, height_m)

    def _report(self, index: int, sensor: SensorSpec, place_m: Array, alt_amsl_m: float) -> None:
        east, north = (place_m + self._rng.normal(size=2) * sensor.sigma_m).tolist()
        lat_deg, lon_deg = (self._zero_deg + np.array((north, east)) / self._m_per_deg).tolist()
        unknown = dict.fromkeys(("vel_n", "vel_e", "vel_d", "vel_acc", "dist", "hdg", "hdg_acc"), math.nan)
        self._send(
            index,
            "CAMERA_TRACKING_GEO_STATUS",
            tracking_status=TRACKING_ACTIVE,
            lat=round(lat_deg * 1e7),
            lon=round(lon_deg * 1e7),
            alt=alt_amsl_m + float(self._rng.normal()) * HEIGHT_SIGMA_M,
            h_acc=sensor.sigma_m,
            v_acc=HEIGHT_SIGMA_M,
            **unknown,
        )

    def _send(self, index: int, name: str, **fields: Any) -> None:
        pilot = self._pilots[index]
        outbox, now_us = pilot.platform.outbox, pilot.platform.clock.now_us
        if not (outbox.silent or pilot.dead):
            outbox.datagrams.append(outbox.signer.sign(self._encoders[index].frame(name, fields), now_us))

    def _enu(self, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        north, east = ((np.array((lat_deg, lon_deg)) - self._zero_deg) * self._m_per_deg).tolist()
        return east, north
