"""The points of interest of a mission: kept, closed when a vehicle has seen them or time is up, and reported."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.flight.executive import Executive
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.protocol.common import EventClass, Phase, RunPhase
from tui_gcs.core.protocol.points import MAX_POINT_NAME, MAX_POINTS, NewPoint, PointOfInterest
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.scenario.model import Scenario

MAX_AWAY_M = 100_000.0
"""A place farther from the origin than this is taken for a mistake in typing."""


class PointTable:
    """All points of one station, in the order in which they were added."""

    def __init__(self, services: FlightServices, scenario: Scenario, executive: Executive) -> None:
        self.scenario = scenario
        """The present scenario; `ActiveScenario` sets it here when it changes."""
        self._services, self._executive = services, executive
        self._points: dict[str, PointOfInterest] = {}
        self._begun = False
        """Whether the scenario's own points were added: their time runs from the first round on."""

    def all(self) -> tuple[PointOfInterest, ...]:
        """Return all points, also those that are closed."""
        return tuple(self._points.values())

    def open(self) -> tuple[PointOfInterest, ...]:
        """Return the points that planners are to visit."""
        return tuple(point for point in self._points.values() if point.state == "open")

    def add(self, new: Iterable[NewPoint]) -> tuple[str, str]:
        """Add all points; return (why none was added or "", their names in words)."""
        points, names = list(new), list[str]()
        if problem := self._problem(points):
            return problem, ""
        now = self._services.clock.now()
        for point in points:
            name = point.name or self._free_name()
            self._make_room()
            self._points[name] = PointOfInterest(
                name, point.place_m, point.priority, point.team, now, now + point.within_s
            )
            names.append(name)
        return "", ", ".join(names)

    def _problem(self, points: list[NewPoint]) -> str:
        if not points:
            return "no point is named"
        if len(self.open()) + len(points) > MAX_POINTS:
            return f"{len(self.open())} points are open, at most {MAX_POINTS} can be"
        named = [point.name for point in points if point.name]
        teams = {team.name for team in self.scenario.teams}
        for point in points:
            if point.name and (clean(point.name, MAX_POINT_NAME) != point.name or not point.name.strip()):
                return f"{clean(point.name, MAX_POINT_NAME)}: a name is 1 to {MAX_POINT_NAME} printable characters"
            if point.name in self._points or named.count(point.name) > 1:
                return f"there is a point {point.name} already"
            if not all(math.isfinite(v) and abs(v) <= MAX_AWAY_M for v in point.place_m):
                return f"point {point.name}: its place is not within {MAX_AWAY_M / 1000.0:g} km of the origin"
            if not (0.0 < point.priority <= 1e6 and point.within_s > 0.0):
                return f"point {point.name}: priority and time must be above 0"
            if point.team and point.team not in teams:
                return f"point {point.name}: there is no team {clean(point.team, MAX_POINT_NAME)}"
        return ""

    def _free_name(self) -> str:
        return next(name for n in range(1, 2 * MAX_POINTS + 2) if (name := f"point {n}") not in self._points)

    def _make_room(self) -> None:
        """Forget the oldest closed points beyond what a status can hold."""
        closed = [name for name, point in self._points.items() if point.state != "open"]
        for name in closed[: max(0, len(self._points) + 1 - MAX_POINTS)]:
            del self._points[name]

    def cancel(self, names: Iterable[str]) -> tuple[str, ...]:
        """Cancel these open points, or all without names; return the names of those that were."""
        wanted = set(names)
        found = tuple(point.name for point in self.open() if point.name in wanted or not wanted)
        for name in found:
            self._close(self._points[name], "cancelled", 0)
        return found

    def tick(self) -> None:
        """Add the scenario's points when the first round begins, and close those that were seen or are late."""
        if not self._begun and self._executive.run is RunPhase.RUNNING:
            self._begun = True
            asked = self.scenario.tasks
            new = [NewPoint(t.name, t.place_m, t.priority, t.deadline_s or math.inf, t.team) for t in asked]
            if new and (problem := self.add(new)[0]):
                self._report(f"the scenario's tasks are not added: {problem}", WARNING)
        points = self.open()
        if not points:
            return
        now, flying = self._services.clock.now(), self._flying()
        for point in points:
            seen_by = [
                (away_m, vehicle)
                for vehicle, team, place_m, radius_m in flying
                if point.team in ("", team) and (away_m := math.dist(place_m, point.place_m)) <= radius_m
            ]
            if seen_by:
                self._close(point, "done", min(seen_by)[1])
            elif now > point.due_s:
                self._close(point, "missed", 0)

    def _flying(self) -> list[tuple[int, str, tuple[float, float], float]]:
        """Return (vehicle, team, place, footprint radius) of vehicles that fly for their planners."""
        found = []
        for flight in self._services.flights.in_phase(Phase.FLYING):
            vehicle = self._services.fleet.vehicles.get(flight.vehicle)
            if vehicle is not None and vehicle.telemetry.has_position():
                x, y, _ = vehicle.telemetry.position_m
                radius_m = self.scenario.class_of(flight.vehicle).footprint_radius_m
                found.append((flight.vehicle, flight.team, (x, y), radius_m))
        return found

    def _close(self, point: PointOfInterest, state: str, vehicle: int) -> None:
        now = self._services.clock.now()
        self._points[point.name] = msgspec.structs.replace(point, state=state, ended_s=now, vehicle=vehicle)
        after = f"{now - point.added_s:.0f} s after it was added"
        words = {"done": f"done by vehicle {vehicle}, {after}", "missed": f"MISSED: its time is up, {after}"}
        self._report(f"task {point.name} {words.get(state, 'cancelled')}", WARNING if state == "missed" else NOTICE)

    def _report(self, text: str, severity: int) -> None:
        self._services.events.report(EventClass.MISSION, "tasks", text, severity)

    def memory(self) -> dict[str, Any]:
        """Return the points as the state file keeps them."""
        return {"begun": self._begun, "points": [msgspec.to_builtins(point) for point in self._points.values()]}

    def recall(self, held: Mapping[str, Any]) -> None:
        """Take what `memory` gave to an earlier station. Raises ValueError for anything else."""
        points = [msgspec.convert(each, PointOfInterest, strict=False) for each in held.get("points", [])]
        self._begun, self._points = bool(held.get("begun")), {point.name: point for point in points[:MAX_POINTS]}
