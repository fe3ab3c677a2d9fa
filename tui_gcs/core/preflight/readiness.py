"""Which vehicles may be started or lifted now, and why not: the reasons that can never be overridden.

Every reason belongs to a check of `core/protocol/preflight.py`, so that the list before a start and the refusal of one
agree. Reasons come in groups: those of one group count together; groups after the first one that blocks are only for
the list.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flights import Flight
from tui_gcs.core.protocol.common import Freshness, Phase, VehicleResult
from tui_gcs.core.scenario.model import Round, Scenario, band_m
from tui_gcs.core.station.assembly import StationParts

GPS_3D = 3
"""The value of GPS_FIX_TYPE_3D_FIX in MAVLink."""
MIN_BATTERY_PCT = 20.0
"""Below this no vehicle starts; an unknown battery (NaN) does not count as empty."""
MIN_ABOVE_RETURN_PCT = 5.0
"""Nor does one that would be sent home for its charge as soon as it is up."""
CHECK_OF = {"position": "gps", "battery": "battery", "battery-low": "battery", "health": "arming"}
"""The check to which a vehicle's own health problem belongs, by the concern of the problem."""


@dataclass(frozen=True)
class Reason:
    """One thing about one vehicle, which blocks a start or is only to be known."""

    check: str
    text: str
    blocks: bool = True


Group = tuple[Reason, ...]


class Readiness:
    """Finds the reasons against a start at the moment of the call; it changes nothing."""

    def __init__(self, parts: StationParts) -> None:
        self._parts = parts

    def why_not_start(self, vehicle_id: int) -> str:
        """Why this vehicle cannot start now; "" if it can."""
        return _first(self.groups(vehicle_id))

    def why_not_lift(self, vehicle: Vehicle) -> str:
        """Why this vehicle cannot leave the ground now for manual flight; "" if it can."""
        flight = self._parts.flight.flights.get(vehicle.id)
        if flight is None:
            return "in no team, or without a take-off place"
        if why := _first(self._led(vehicle)):
            return why
        return f"busy: {flight.phase}" if flight.phase is not Phase.GROUND else _first(self._ready(vehicle))

    def of_start(self, vehicles: tuple[int, ...]) -> tuple[VehicleResult, ...]:
        """For vehicles that are to start together: which may start, and why the others may not."""
        return self._together(VehicleResult(v, ok=not (why := self.why_not_start(v)), text=why) for v in vehicles)

    def beside(self, vehicles: tuple[int, ...]) -> tuple[VehicleResult, ...]:
        """For vehicles of which each may start alone: which may start together, and why the others may not."""
        return self._together(VehicleResult(v, ok=True, text="") for v in vehicles)

    def _together(self, results: Iterable[VehicleResult]) -> tuple[VehicleResult, ...]:
        apart = _too_close(self._parts, list(results))
        return tuple(_on_slopes(self._parts, _sharing_layers(self._parts, apart)))

    def too_close(self, vehicles: tuple[int, ...]) -> dict[int, str]:
        """Vehicles of these that must not leave the ground beside the others, each with the reason."""
        known = [v for v in vehicles if v in self._parts.picture.fleet.vehicles]
        results = _too_close(self._parts, [VehicleResult(vehicle=v, ok=True, text="") for v in known])
        return {result.vehicle: result.text for result in results if not result.ok}

    def groups(self, vehicle_id: int) -> Iterator[Group]:
        """All reasons about a vehicle that is to start now; if it is not heard, or not ours, only that."""
        parts = self._parts
        vehicle = parts.picture.fleet.vehicles.get(vehicle_id)
        flight = parts.flight.flights.get(vehicle_id)
        if vehicle is None:
            yield _one("heard", "never heard")
            return
        if flight is None:
            yield _one("heard", "in no team, or without a take-off place")
            return
        unled = next(self._led(vehicle), None)
        if unled:
            yield unled
            return
        if vehicle.telemetry.armed or flight.phase is not Phase.GROUND:
            yield _one("arming", "already armed" if vehicle.telemetry.armed else f"busy: {flight.phase}")
        if problem := layer_problem(parts.active.scenario, parts.active.round, flight, flight.team):
            yield _one("place", problem)
        controller = parts.active.team_controllers.get(flight.team)
        if controller is None or controller.planner.error:
            yield _one("planner", f"its planner cannot plan: {controller.planner.error if controller else 'none'}")
        yield from self._ready(vehicle)

    def _led(self, vehicle: Vehicle) -> Iterator[Group]:
        """The reasons why this station cannot command the vehicle."""
        parts = self._parts
        now = parts.records.clock.now()
        if vehicle.freshness(now) is not Freshness.OK:
            yield _one("heard", f"{vehicle.freshness(now)}: last heard {now - vehicle.last_heard_s:.0f} s ago")
        if unsupported := parts.comms.firmware.of(vehicle).why_not(vehicle):
            yield _one("heard", unsupported)
        # SIM and LIVE never mix: a real vehicle that strays into a simulation must not be armed.
        if not parts.comms.uplink.is_ours(vehicle):
            yield _one("ids", "not one of our simulated vehicles: this station is SIM")
        if vehicle.why_not_commanded:
            yield _one("ids", vehicle.why_not_commanded)
        # A satellite link brings HIGH_LATENCY2 every few seconds at best, and takes no stream of set-points.
        if parts.comms.links[vehicle.link].spec.high_latency:
            yield _one("heard", "heard over a high-latency link: commands only, no planner can steer it")

    def _ready(self, vehicle: Vehicle) -> Iterator[Group]:
        """The reasons why it should not leave the ground: its own checks, battery, position, place."""
        parts = self._parts
        if problem := parts.comms.firmware.of(vehicle).start_problem(vehicle):
            yield _one("arming", problem)
        # NaN compares as False: an unknown battery blocks no start.
        least_pct = max(MIN_BATTERY_PCT, parts.active.scenario.battery.return_pct + MIN_ABOVE_RETURN_PCT)
        if vehicle.telemetry.battery_pct < least_pct:
            text = f"battery {vehicle.telemetry.battery_pct:.0f} %, at least {least_pct:.0f} % to start"
            yield _one("battery", text)
        if vehicle.telemetry.gps_fix < GPS_3D:
            yield _one("gps", f"no 3-D position fix (fix type {vehicle.telemetry.gps_fix})")
        if not parts.flight.guard.inside(vehicle.telemetry.position_m):
            away_m = parts.flight.guard.outside_m(vehicle.telemetry.position_m)
            yield _one("place", f"{away_m:.0f} m outside the operating area of {parts.active.round.name}")
        problems = parts.services.health.of(vehicle).problems
        yield tuple(Reason(CHECK_OF[problem.about], problem.text, problem.blocks) for problem in problems)


def layer_problem(scenario: Scenario, round_: Round, flight: Flight, team_name: str) -> str:
    """Why a vehicle's layer does not fit the zone of its team in this round; "" if it does."""
    team = next((t for t in scenario.teams if t.name == team_name), None)
    zone = next((z for z in round_.zones if team is not None and z.name == team.zone), None)
    if zone is None:
        return ""
    low, high = band_m(zone, round_.area)
    if low <= flight.layer_m <= high:
        return ""
    return f"its layer {flight.layer_m:g} m is outside {low:g}-{high:g} m, the band of zone {zone.name}"


def _one(check: str, text: str) -> Group:
    return (Reason(check, text),)


def _first(groups: Iterator[Group]) -> str:
    """The texts of the first group that blocks; "" if none does."""
    for group in groups:
        if blocking := [reason.text for reason in group if reason.blocks]:
            return "; ".join(blocking)
    return ""


def _too_close(parts: StationParts, results: list[VehicleResult]) -> list[VehicleResult]:
    """Refuse vehicles that stand too near to each other, or to the place or home of a vehicle in the air."""
    limit = parts.active.scenario.limits.separation_horizontal_m
    vehicles = parts.picture.fleet.vehicles
    starters = {r.vehicle for r in results if r.ok}
    places = [(v, vehicles[v].telemetry.position_m[:2]) for v in starters]
    for flight in parts.flight.flights:
        if flight.phase is not Phase.GROUND and flight.vehicle not in starters:
            # It lands at its home: what stands there would be under it.
            places += [(flight.vehicle, home[:2]) for home in [flight.home_m] if home is not None]
            places += [(v.id, v.telemetry.position_m[:2]) for v in [vehicles.get(flight.vehicle)] if v is not None]
    checked = []
    for result in results:
        here = vehicles[result.vehicle].telemetry.position_m[:2] if result.ok else (math.nan, math.nan)
        near = [v for v, place in places if v != result.vehicle and math.dist(here, place) < limit]
        text = f"stands closer than {limit:.0f} m to vehicle {near[0]}" if near else ""
        checked.append(VehicleResult(vehicle=result.vehicle, ok=False, text=text) if near else result)
    return checked


def _sharing_layers(parts: StationParts, results: list[VehicleResult]) -> list[VehicleResult]:
    """Refuse vehicles that would meet others on one layer: from where they stand their ways may cross.

    A scenario lets vehicles share a layer only if they never come near each other; that holds for its own places.
    """
    flights, fleet = list(parts.flight.flights), parts.picture.fleet.vehicles
    starters = {r.vehicle for r in results if r.ok}
    flying = {f.vehicle for f in flights if f.phase is not Phase.GROUND}
    layers_m = np.array([flight.layer_m for flight in flights])
    close = np.abs(layers_m[:, None] - layers_m[None, :]) < parts.active.scenario.limits.separation_vertical_m - 1e-9
    np.fill_diagonal(close, val=False)
    if not close.any():
        return results
    close &= parts.flight.flights.conflicts(fleet)
    met: dict[int, int] = {}
    for i, j in np.argwhere(close).tolist():
        if flights[i].vehicle in starters and flights[j].vehicle in starters | flying:
            met.setdefault(flights[i].vehicle, flights[j].vehicle)
    return [
        VehicleResult(
            vehicle=r.vehicle,
            ok=False,
            text=f"from where it stands it may meet vehicle {met[r.vehicle]} on the same layer: carry it to its place",
        )
        if r.ok and r.vehicle in met
        else r
        for r in results
    ]


def _on_slopes(parts: StationParts, results: list[VehicleResult]) -> list[VehicleResult]:
    """Refuse vehicles with homes at different heights: a layer is a height above each vehicle's own home."""
    vehicles = parts.picture.fleet.vehicles
    flying = [f.vehicle for f in parts.flight.flights if f.phase is not Phase.GROUND]
    ids = {r.vehicle for r in results if r.ok} | {v for v in flying if v in vehicles}
    heights = {v: vehicles[v].telemetry.alt_amsl_m - vehicles[v].telemetry.alt_rel_m for v in ids}
    known = sorted(h for h in heights.values() if math.isfinite(h))
    limit = parts.active.scenario.limits.home_spread_m
    if not known or known[-1] - known[0] <= limit:
        return results
    # The median: one wrong home must not make all the others look wrong.
    middle = known[len(known) // 2]
    text = f"homes differ by {known[-1] - known[0]:.1f} m in height, limits.home_spread_m is {limit:g}"
    return [
        VehicleResult(vehicle=r.vehicle, ok=False, text=f"{text}; its own is {heights[r.vehicle] - middle:+.1f} m")
        if r.ok
        else r
        for r in results
    ]
