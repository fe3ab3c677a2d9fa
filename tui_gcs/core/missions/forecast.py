"""The forecast of a draft: path and times of every vehicle, conflicts and findings, computed once for each edit."""

from collections.abc import Iterator
from itertools import combinations, product

from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.missions.draft import Items, MissionDraft, VehicleDraft
from tui_gcs.core.missions.mission_conflicts import ComparablePath, Conflict, comparable, conflict_between, worst_first
from tui_gcs.core.missions.mission_findings import MissionFinding, MissionSite, battery_left_pct, findings
from tui_gcs.core.missions.patrol_crossings import PatrolTours
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.missions.planned_vehicles import PlannedVehicle
from tui_gcs.core.missions.timed_path import EMPTY_PATH, HomePosition, TimedPath, timed_path
from tui_gcs.core.scenario.model import Limits, Round

UNKNOWN_VEHICLE = PlannedVehicle(HomePosition())
Near = tuple[float, float]
"""The required separation, horizontal and vertical, in metres."""
Compared = tuple[TimedPath, TimedPath, Near, Conflict | None]


class Forecast:
    """Caches paths, findings and conflicts of each vehicle.

    Items are compared by identity, because drafts share unchanged items.
    """

    def __init__(self) -> None:
        self.draft = MissionDraft()
        self.vehicles: dict[int, PlannedVehicle] = {}
        self.performance = Performance()
        self.frame = LocalFrame(Origin(0.0, 0.0, 0.0))
        self.current: Round | None = None
        self.limits = Limits()
        self.elevation: Elevation | None = None
        """The heights of the ground, where the operator gave a terrain file."""
        self._paths: dict[int, tuple[Items, HomePosition, Performance, LocalFrame, TimedPath]] = {}
        self._found: dict[int, tuple[VehicleDraft, TimedPath, MissionSite, list[MissionFinding]]] = {}
        self._prepared: dict[int, tuple[TimedPath, ComparablePath]] = {}
        self._pairs: dict[tuple[int, int], Compared] = {}
        self._met: list[Conflict] = []
        self.patrols: dict[int, PatrolTours] = {}
        """The tours of vehicles that fly for a planner. A vehicle with a mission in the draft is left out."""
        self._crossed: dict[tuple[int, int], tuple[TimedPath, PatrolTours, Near, Conflict | None]] = {}

    def vehicle(self, vehicle: int) -> PlannedVehicle:
        """The planning data of a vehicle."""
        return self.vehicles.get(vehicle, UNKNOWN_VEHICLE)

    def path(self, vehicle: int) -> TimedPath:
        """The path of its mission."""
        items, home = self.draft.of(vehicle).mission, self.vehicle(vehicle).home
        if not items:
            return EMPTY_PATH
        known = self._paths.get(vehicle)
        if known is not None and known[0] is items and known[1:4] == (home, self.performance, self.frame):
            return known[4]
        path = timed_path(items, home, self.frame, self.performance)
        self._paths[vehicle] = (items, home, self.performance, self.frame, path)
        return path

    def site(self, vehicle: int) -> MissionSite:
        """The surroundings that its mission is checked against."""
        planned = self.vehicle(vehicle)
        home_deg = self.frame.to_geodetic(*planned.home.place_m)
        battery_pct, autopilot = planned.battery_pct, planned.autopilot
        return MissionSite(self.frame, self.current, self.performance, battery_pct, autopilot, home_deg, self.elevation)

    def battery_left_pct(self, vehicle: int) -> float:
        """The battery that is left after its mission, percent."""
        return battery_left_pct(self.path(vehicle), self.site(vehicle))

    def findings(self, vehicle: int) -> list[MissionFinding]:
        """The findings about its plans."""
        draft, path, site = self.draft.of(vehicle), self.path(vehicle), self.site(vehicle)
        known = self._found.get(vehicle)
        if known is not None and known[0] is draft and known[1] is path and known[2] == site:
            return known[3]
        found = findings(draft, path, site)
        self._found[vehicle] = (draft, path, site, found)
        return found

    @property
    def conflicts(self) -> list[Conflict]:
        """The conflicts found by the last `compare_paths`."""
        return self._met

    def compare_paths(self) -> bool:
        """Look for conflicts between all paths; returns whether they changed."""
        before = self._met
        for _ in self.comparing():
            pass
        return before != self._met

    def comparing(self) -> Iterator[None]:
        """The same as an iterator, which can be left after each pair; `conflicts` are new after the last one."""
        paths = {vehicle: path for vehicle in self.draft.vehicles if not (path := self.path(vehicle)).is_empty}
        near = (self.limits.separation_horizontal_m, self.limits.separation_vertical_m)
        pairs: dict[tuple[int, int], Compared] = {}
        for a, b in combinations(sorted(paths), 2):
            known = self._pairs.get((a, b))
            # By identity: a path is computed anew only after an edit.
            if known is None or known[0] is not paths[a] or known[1] is not paths[b] or known[2] != near:
                conflict = conflict_between(a, b, self._prepare(a, paths[a]), self._prepare(b, paths[b]), *near)
                known = self._pairs[a, b] = (paths[a], paths[b], near, conflict)
                yield
            pairs[a, b] = known
        crossed: dict[tuple[int, int], tuple[TimedPath, PatrolTours, Near, Conflict | None]] = {}
        # A vehicle with a mission is assumed to fly that, and not its team's tour.
        patrols = [(v, patrol) for v, patrol in self.patrols.items() if v not in paths]
        for a, (b, patrol) in product(sorted(paths), patrols):
            seen = self._crossed.get((a, b))
            if seen is None or seen[0] is not paths[a] or seen[1] is not patrol or seen[2] != near:
                seen = self._crossed[a, b] = (paths[a], patrol, near, self._crossing(a, b, paths[a], patrol, near))
                yield
            crossed[a, b] = seen
        self._pairs, self._crossed = pairs, crossed
        self._prepared = {vehicle: each for vehicle, each in self._prepared.items() if vehicle in paths}
        self._met = worst_first(pair[3] for pair in (*pairs.values(), *crossed.values()))

    def _crossing(self, vehicle: int, other: int, path: TimedPath, patrol: PatrolTours, near: Near) -> Conflict | None:
        """Return where a mission comes too near to a tour."""
        mine = self._prepare(vehicle, path)
        found = (conflict_between(vehicle, other, mine, loop, *near) for loop in patrol.loops)
        return next((conflict for conflict in found if conflict is not None), None)

    def _prepare(self, vehicle: int, path: TimedPath) -> ComparablePath:
        known = self._prepared.get(vehicle)
        if known is None or known[0] is not path:
            known = self._prepared[vehicle] = (path, comparable(path))
        return known[1]
