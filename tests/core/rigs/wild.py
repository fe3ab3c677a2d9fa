"""Wild planners: streams of random intents, and a referee who looks at where simulated vehicles really are."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import shapely

from sitl.physics.weather import Weather as SimWeather
from sitl.physics.weather import WeatherSpec
from tests.core.rigs.rig import Rig, scenario, toml
from tui_gcs.core.flight.flights import COLUMN_M
from tui_gcs.core.geometry.zones import Circle, Role, Zone, contains, polygon_of
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Intent, Phase, Vec3
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.rehearsal.lock_step import TICK_S

NOISE_SIGMAS = 3.0
BAND_M = 1.5
"""What the guard lets a braking vehicle leave the band by: half a metre and one."""
HUGE = (math.nan, math.inf, -math.inf, 1e300, -1e9, 1e5, 0.0)


def wild_scenario(rng: np.random.Generator, vehicles: int) -> Scenario:
    """The shipped one, with no-fly zones in each of its rounds, away from the take-off places; some end at a height."""
    whole = scenario(vehicles)
    rounds = [
        msgspec.structs.replace(r, zones=r.zones + tuple(_closed(rng, i) for i in range(int(rng.integers(4)))))
        for r in whole.rounds
    ]
    return msgspec.structs.replace(whole, rounds=tuple(rounds), seed=int(rng.integers(2**31)))


def _closed(rng: np.random.Generator, number: int) -> Zone:
    place = (float(rng.uniform(110.0, 560.0)), float(rng.uniform(20.0, 380.0)))
    low, high = sorted(rng.uniform(20.0, 90.0, 2).tolist())
    heights: dict[str, float] = [{}, {"alt_max_m": low}, {"alt_min_m": high}, {"alt_min_m": low, "alt_max_m": high}][
        int(rng.integers(4))
    ]
    shape = Circle(centre_m=place, radius_m=float(rng.uniform(3.0, 40.0)))
    return Zone(name=f"closed {number}", role=Role.NO_FLY, shape=shape, **heights)


@dataclass(frozen=True)
class Weather:
    """Wind, from somewhere, and what GPS is wrong by (standard deviation)."""

    wind_m_s: float
    gps_noise_m: float


@dataclass
class Referee:
    """The worst of what really happened. Distances are beyond what is allowed; 0 or less is good."""

    flight: Rig
    weather: Weather
    outside_m: float = 0.0
    in_no_fly_m: float = 0.0
    below_band_m: float = 0.0
    separation: float = math.inf
    """Smallest distance of a pair, as the larger share of its two limits: 1 is the limit."""
    silent: set[int] = field(default_factory=set)
    """Vehicles that have been without a link: where those fly is their own doing."""
    worst: dict[str, tuple[float, str]] = field(default_factory=dict)

    def problems(self) -> list[str]:
        """What happened that must not, with when and to whom.

        Heights by GPS are as wrong as its noise makes them, and so are places: the limits are meant as measured.
        """
        noise_m = NOISE_SIGMAS * self.weather.gps_noise_m
        limits = self.flight.station.active.scenario.limits
        least = 1.0 - 2 * noise_m / min(limits.separation_horizontal_m, limits.separation_vertical_m)
        found = {
            "outside_m": self.outside_m > noise_m,
            "in_no_fly_m": self.in_no_fly_m > noise_m,
            "below_band_m": self.below_band_m > BAND_M + noise_m,
            "separation": self.separation < least,
        }
        return [f"{what} {getattr(self, what):.2f} at {self.worst[what]}" for what, bad in found.items() if bad]

    def look(self) -> None:
        """Judge this moment."""
        station, sim = self.flight.station, self.flight.sim
        x, y = station.picture.fleet.frame.to_enu(sim.lat_deg, sim.lon_deg)
        places = np.stack([x, y, sim.alt_rel_m], axis=1)
        flying = [i for i, v in enumerate(self.flight.ids) if places[i, 2] > 2.0 and v not in self.silent]
        free = [i for i in flying if not self._in_column(i, places[i])]
        area = station.active.round.area
        shape = polygon_of(area.shape)
        for i in flying:
            out = float(shape.distance(shapely.Point(places[i, :2])))
            self._note("outside_m", out, i)
            for zone in station.active.round.no_fly:
                low, high = zone.alt_min_m or -math.inf, zone.alt_max_m or math.inf
                if contains(zone.shape, places[i, :2])[0] and low < places[i, 2] < high and i in free:
                    edge = float(polygon_of(zone.shape).exterior.distance(shapely.Point(places[i, :2])))
                    self._note("in_no_fly_m", min(edge, places[i, 2] - low, high - places[i, 2]), i)
        for i in free:
            self._note("below_band_m", max(area.alt_min_m - places[i, 2], places[i, 2] - area.alt_max_m), i)
        limits = station.active.scenario.limits
        for row, i in enumerate(free):
            for j in free[row + 1 :]:
                level = math.dist(places[i, :2], places[j, :2]) / limits.separation_horizontal_m
                upright = abs(places[i, 2] - places[j, 2]) / limits.separation_vertical_m
                if max(level, upright) < self.separation:
                    self.separation = max(level, upright)
                    self.worst["separation"] = (self.flight.clock.now(), f"{i + 1} {j + 1}")

    def _in_column(self, i: int, place: np.ndarray) -> bool:
        flight = self.flight.station.flight.flights.by_id[self.flight.ids[i]]
        climbs = flight.phase is Phase.ARMING or (flight.phase is Phase.TAKEOFF and flight.course is None)
        if flight.home_m is None or not (climbs or flight.phase in (Phase.LANDING, Phase.GROUND)):
            return False
        return math.dist(place[:2], flight.home_m[:2]) <= COLUMN_M + 1.0

    def _note(self, what: str, value: float, i: int) -> None:
        if value > getattr(self, what):
            setattr(self, what, value)
            self.worst[what] = (self.flight.clock.now(), str(i + 1))


@dataclass
class Wild:
    """Random intents for one team, as often as 25 Hz."""

    flight: Rig
    rng: np.random.Generator
    team: str = "defend"
    calm: float = 0.0
    """Share of steps in which nothing new is said."""

    def speak(self) -> None:
        """A plan with an intent for a random part of everybody, wanted or not."""
        if self.rng.random() < self.calm:
            return
        names = [*self.flight.ids, 9, 77]
        chosen = self.rng.permutation(names)[: int(self.rng.integers(1, len(names) + 1))]
        self.flight.plan(*(self.intent(int(v)) for v in chosen), team=self.team)

    def intent(self, vehicle: int) -> Intent:
        """Anything."""
        kind = self.rng.choice(
            ["goto", "velocity", "trajectory", "orbit", "hold", "nonsense"], p=[0.3, 0.25, 0.25, 0.08, 0.04, 0.08]
        )
        make: Any = getattr(self, f"_{kind}")
        made: Intent = make(vehicle)
        return made

    def _place(self) -> Vec3:
        """Inside, outside, at the edge, or where somebody else is."""
        rng = self.rng
        if rng.random() < 0.4:
            x, y, z = self.flight.place(int(rng.choice(self.flight.ids)))
            x, y, z = x + rng.normal(0.0, 8.0), y + rng.normal(0.0, 8.0), z + rng.normal(0.0, 3.0)
        else:
            x, y, z = rng.uniform(-50.0, 650.0), rng.uniform(-50.0, 450.0), rng.uniform(15.0, 95.0)
        return float(x), float(y), float(z)

    def _velocity_m_s(self) -> Vec3:
        speed, angle = self.rng.uniform(0.0, 9.0), self.rng.uniform(0.0, 2 * math.pi)
        return float(speed * math.cos(angle)), float(speed * math.sin(angle)), float(self.rng.normal(0.0, 1.0))

    def _goto(self, vehicle: int) -> Intent:
        return Intent(vehicle, "goto", position_m=self._place())

    def _velocity(self, vehicle: int) -> Intent:
        return Intent(
            vehicle,
            "velocity",
            velocity_m_s=self._velocity_m_s(),
            valid_s=float(self.rng.choice([0.2, 1.0, 5.0, 30.0])),
        )

    def _orbit(self, vehicle: int) -> Intent:
        return Intent(
            vehicle, "orbit", position_m=self._place(), radius_m=float(self.rng.uniform(1.0, 80.0)), speed_m_s=6.0
        )

    def _hold(self, vehicle: int) -> Intent:
        return Intent(vehicle, "hold")

    def _trajectory(self, vehicle: int) -> Intent:
        """Straight or curved from where it is, as fast as it is or otherwise; a few with jumps in them."""
        rng, now = self.rng, self.flight.clock.now()
        known = vehicle in self.flight.ids
        here = np.array(self.flight.place(vehicle) if known else (100.0, 100.0, 40.0))
        velocity = np.array(self._velocity_m_s())
        if known and rng.random() < 0.7:
            velocity = self.flight.sim.velocity_m_s[self.flight.sim_index[vehicle]].copy()
        dt, count, turn = float(rng.choice([0.1, 0.25, 1.0])), int(rng.integers(2, 40)), rng.uniform(-0.4, 0.4)
        grow = rng.uniform(-2.5, 2.5)
        places, speeds = [here], [velocity]
        for _ in range(count - 1):
            v = speeds[-1]
            speed = max(float(np.hypot(v[0], v[1])), 1e-3)
            faster = min(max(speed + grow * dt, 0.2), 8.0) / speed
            cos, sin = math.cos(turn * dt), math.sin(turn * dt)
            new = np.array([(cos * v[0] - sin * v[1]) * faster, (sin * v[0] + cos * v[1]) * faster, v[2]])
            places.append(places[-1] + (v + new) / 2 * dt)
            speeds.append(new)
        if rng.random() < 0.1:
            places[int(rng.integers(count))] = np.array(self._place())
        if rng.random() < 0.1:
            speeds[int(rng.integers(count))] = np.array(self._velocity_m_s())
        return Intent(
            vehicle,
            "trajectory",
            t0_s=float(now - rng.choice([0.0, 0.2, -1.0])),
            dt_s=dt,
            positions_m=tuple((float(x), float(y), float(z)) for x, y, z in places),
            velocities_m_s=tuple((float(x), float(y), float(z)) for x, y, z in speeds),
        )

    def _nonsense(self, vehicle: int) -> Intent:
        rng = self.rng

        def number() -> float:
            return float(rng.choice(HUGE))

        triples = tuple((number(), number(), number()) for _ in range(int(rng.integers(0, 4))))
        return Intent(
            vehicle,
            str(rng.choice(["goto", "velocity", "trajectory", "orbit"])),
            position_m=(number(), number(), number()),
            velocity_m_s=(number(), number(), number()),
            valid_s=number(),
            speed_m_s=number(),
            radius_m=number(),
            t0_s=number(),
            dt_s=number(),
            positions_m=triples,
            velocities_m_s=triples,
        )


def run_wild(
    log_dir: Path,
    seed: int,
    seconds: float,
    autopilots: str,
    weather: Weather,
    *,
    vehicles: int = 4,
    trouble: bool = False,
) -> Referee:
    """Start a fleet, then let a wild planner steer it; `trouble`: vehicles fall silent, and rounds change."""
    rng = np.random.default_rng(seed)
    flight = Rig(wild_scenario(rng, vehicles), toml(), log_dir, autopilots=autopilots)
    try:
        flight.flying()
        angle = rng.uniform(0.0, 2 * math.pi)
        wind = (weather.wind_m_s * math.cos(angle), weather.wind_m_s * math.sin(angle))
        flight.sim._vehicles.weather = SimWeather(WeatherSpec(wind, weather.gps_noise_m), len(flight.sim), seed)
        return _go_wild(flight, rng, seconds, weather, trouble=trouble)
    finally:
        flight.close()


def _go_wild(flight: Rig, rng: np.random.Generator, seconds: float, weather: Weather, *, trouble: bool) -> Referee:
    """From one plan in many seconds to 20 plans a second; who holds is sent on again."""
    flight.planning = False
    wild, referee = Wild(flight, rng, calm=float(rng.choice([0.0, 0.5, 0.9, 0.97]))), Referee(flight, weather)
    for step in range(round(seconds / TICK_S)):
        wild.speak()
        if trouble and rng.random() < 0.0015:
            lost = int(rng.integers(len(flight.ids)))
            flight.sim.silence(lost)
            referee.silent.add(flight.ids[lost])
        if trouble and rng.random() < 0.001:
            flight.ask(m.SwitchRound(index=int(rng.integers(len(flight.scenario.rounds)))))
        if step % 20 == 0 and any(flight.phase(v) is Phase.HOLDING for v in flight.ids):
            flight.ask(m.Resume())
        flight.step()
        referee.look()
    return referee
