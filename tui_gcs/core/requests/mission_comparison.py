"""Compares missions before vehicles fly them: with each other, and with all that is in the air.

Two real ArduCopters on one mission met at 0 m, and nothing had warned at the start. Missions that begin together are
compared in space and time. What is in the air already is compared in space only, because it is not known to the second
where it will be: missions that are flown, whoever began them, planners' tours, and vehicles that stand or fly to a
place. Only missions that were read or put on board are known, so those that are not are read first. In flight
`flight.mission_separation` watches all.
"""

import math
from collections.abc import Callable, Collection, Iterable, Iterator

import numpy as np

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flights import TakenOut
from tui_gcs.core.missions.mission_conflicts import (
    ComparablePath,
    collision_between,
    comparable,
    comparable_loop,
    conflict_between,
)
from tui_gcs.core.missions.patrol_crossings import patrols
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.missions.timed_path import GROUND_HEIGHT_M, HomePosition, timed_path
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import Freshness, Phase
from tui_gcs.core.requests.handler import MissionsMeetError
from tui_gcs.core.requests.homes import home_amsl_m
from tui_gcs.core.requests.tasks import Task
from tui_gcs.core.station.assembly import StationParts
from tui_gcs.core.uplink.jobs import Job

ON_TOUR = (Phase.TAKEOFF, Phase.FLYING, Phase.HOLDING)
"""Phases in which a vehicle flies its planner's tour, or will when the start or the hold is over."""
SAME_S = 1.0
"""A path is made anew after this time: in flight it begins where the vehicle is."""


class MissionComparison:
    """Judges missions that are about to be flown or put on board."""

    def __init__(self, parts: StationParts) -> None:
        """Compare what this station knows of its vehicles."""
        self._parts = parts
        self._paths: dict[tuple[int, int, int], tuple[tuple[PlanItem, ...], ComparablePath | None]] = {}
        """Paths that were made within `SAME_S`, by vehicle, first item and identity of the items, which are kept, too:
        of a request that names 100 vehicles each is compared with 99."""
        self._apart: dict[frozenset[int], tuple[ComparablePath, ComparablePath]] = {}
        """Pairs of paths, by identity, that were found to be apart if they begin together; kept, so that no other path
        gets the identity of one of them."""
        self._made_s = -math.inf

    def begin(
        self,
        vehicle: Vehicle,
        starts: tuple[int, ...],
        task: Task,
        then: Callable[[str], None],
        *,
        first: int | None = None,
    ) -> str:
        """Compare the mission of `vehicle` and call `then` with a remark if it may be flown; returns "".

        Missions that are not known are read first; the task then ends with the reason why it is not begun.

        Args:
            vehicle: The vehicle that is about to fly what it holds.
            starts: The vehicles that begin together with it.
            task: The task of the request.
            then: Sends the order.
            first: The index of the item that it will fly to first; None: the one that it would go on with.

        Raises:
            MissionsMeetError: the mission meets others.
        """
        unread = [v for v in (vehicle, *self._on_missions(vehicle.id)) if self._may_read(v)]
        if self._is_alone(vehicle, starts) or not unread:
            if why := self.conflict(vehicle, starts, first=first):
                raise MissionsMeetError(why)
            then(self.remark(vehicle, starts))
            return ""
        left = {each.id for each in unread}

        def read(job: Job) -> None:
            left.discard(job.vehicle)
            if left or task.over or not task.begin_next_part():
                return
            if why := self.conflict(vehicle, starts, first=first):
                task.end(str(MissionsMeetError(why)))
            else:
                then(self.remark(vehicle, starts))

        missions = self._parts.services.missions
        jobs = [missions.download(each.id, PlanKind.MISSION, read) for each in unread]
        if not task.over and not jobs[0].over:
            task.follow(jobs[0], self._parts.comms.jobs)
        return ""

    def conflict(self, vehicle: Vehicle, starts: tuple[int, ...] = (), *, first: int | None = None) -> str:
        """Why its mission must not be flown together with those of `starts`, and with what is in the air; or ""."""
        if first is not None:
            return self._conflict(vehicle, self._held_path(vehicle, first), starts)
        # An autopilot goes on with its present item, or begins anew (MIS_RESTART).
        return self._conflict(vehicle, self._held_path(vehicle, self._current(vehicle)), starts) or self._conflict(
            vehicle, self._held_path(vehicle, 0), starts, anew=True
        )

    def conflict_of_upload(
        self, vehicle: Vehicle, plan: Plan, others: Iterable[int], replaced: Collection[int] = ()
    ) -> str:
        """Why `plan` should not be put on `vehicle`, if `others` get it, too, and all begin together; or "".

        On the ground, what vehicles of `replaced` hold does not count: they get other missions at the same time.
        """
        own = self._path(vehicle, plan.items, 0)
        if own is None:
            return ""
        fleet = self._parts.picture.fleet.vehicles
        for other in others:
            known = fleet.get(other)
            path = self._path(known, plan.items, 0) if known is not None and other != vehicle.id else None
            if known is not None and path is not None and (text := self._together(vehicle, known, own, path)):
                return text
        new = {*others, *replaced}
        on_ground = tuple(v.id for v in fleet.values() if v.id not in new and not v.telemetry.airborne)
        return self._conflict(vehicle, own, on_ground, anew=True)

    def remark(self, vehicle: Vehicle, starts: tuple[int, ...] = ()) -> str:
        """Which missions are not known, and so were not compared; "" if none, or if nothing else flies."""
        if self._is_alone(vehicle, starts):
            return ""
        if not self._is_known(vehicle):
            return "not compared with others: its mission was not read"
        others = [*self._on_missions(vehicle.id), *(v for v in map(self._vehicle, starts) if v is not None)]
        return _unread(v.id for v in others if v.id != vehicle.id and not self._is_known(v))

    def unread_words(self, but: tuple[int, ...]) -> str:
        """Which vehicles, beside those of `but`, hold missions that are not known; "" if none."""
        state = self._parts.services.missions.state
        others = (v for v in self._parts.picture.fleet.vehicles.values() if v.id not in but and state(v.id).total)
        return _unread(v.id for v in others if not self._is_known(v))

    def _conflict(
        self, vehicle: Vehicle, own: ComparablePath | None, starts: tuple[int, ...], *, anew: bool = False
    ) -> str:
        """Compare the path `own` with the missions of `starts`, if `anew` from their first items, and with others."""
        if own is None:
            return ""
        for number in sorted({*starts} - {vehicle.id}):
            other = self._vehicle(number)
            path = self._held_path(other, 0 if anew else self._current(other)) if other is not None else None
            if other is not None and path is not None and (text := self._together(vehicle, other, own, path)):
                return text
        for number, path, what in self._in_the_air(vehicle.id, starts):
            met = self._met(vehicle.id, number, own, path)
            if met is not None:
                return f"its way comes within {met:.0f} m of {what.format(vehicles_words([number]))}"
        return ""

    def _together(self, vehicle: Vehicle, other: Vehicle, own: ComparablePath, path: ComparablePath) -> str:
        limits = self._parts.flight.guard.limits
        pair = frozenset({id(own), id(path)})
        if pair in self._apart:
            return ""
        met = collision_between(
            vehicle.id, other.id, own, path, limits.separation_horizontal_m, limits.separation_vertical_m
        )
        if met is None:
            self._apart[pair] = own, path
            return ""
        return f"it would come within {met.horizontal_m:.0f} m of vehicle {other.id} after {met.first_s:.0f} s"

    def _met(self, one: int, other: int, own: ComparablePath, path: ComparablePath) -> float | None:
        """The least horizontal distance, metres, if two paths come too close at any times."""
        limits = self._parts.flight.guard.limits
        met = conflict_between(one, other, own, path, limits.separation_horizontal_m, limits.separation_vertical_m)
        return met.horizontal_m if met is not None else None

    def _in_the_air(self, but: int, starts: tuple[int, ...]) -> Iterator[tuple[int, ComparablePath, str]]:
        """Vehicle, path and words of all other vehicles in the air, missions first; "{}" stands for the vehicle."""
        flights, now = self._parts.flight.flights, self._parts.records.clock.now()
        on_missions = self._on_missions(but)
        missions = {v.id for v in on_missions}
        for vehicle in on_missions:
            path = self._held_path(vehicle, self._current(vehicle)) if vehicle.id not in starts else None
            if path is not None:
                yield vehicle.id, path, "that of {}, which is on its mission"
        on_tour = {
            f.vehicle: (f.team, f.layer_m)
            for f in flights.in_phase(*ON_TOUR)
            if not f.stays and f.vehicle not in missions
        }
        drawn = {name: team.annotations for name, team in self._parts.active.team_controllers.items()}
        tours = patrols(on_tour, drawn)
        for vehicle in self._parts.picture.fleet.in_order():
            if vehicle.id in (but, *starts, *missions) or not vehicle.telemetry.airborne:
                continue
            if vehicle.freshness(now) is Freshness.LOST:
                continue
            if vehicle.id in tours:
                for loop in tours[vehicle.id].loops:
                    yield vehicle.id, loop, f"the tour of {{}} for team {tours[vehicle.id].team}"
            elif (place := self._standing(vehicle)) is not None:
                yield vehicle.id, place, "{}, which is in the air there"

    def _standing(self, vehicle: Vehicle) -> ComparablePath | None:
        """From where the vehicle is to where it was ordered to; None on the ground."""
        here = vehicle.telemetry.position_m
        if not vehicle.telemetry.has_position() or here[2] < GROUND_HEIGHT_M:
            return None
        flight = self._parts.flight.flights.get(vehicle.id)
        goal = flight.goal[0] if flight is not None and flight.phase is Phase.BY_HAND else here
        goal = goal if all(map(math.isfinite, goal)) else here
        return comparable_loop(np.array([here[:2], goal[:2]]), here[2])

    def _on_missions(self, but: int) -> list[Vehicle]:
        """Other vehicles in the air that fly missions, also missions that another station began."""
        flights, now = self._parts.flight.flights, self._parts.records.clock.now()
        sent = {f.vehicle for f in flights.in_phase(Phase.TAKEN_OUT) if f.step is TakenOut.ON_BOARD} | flights.sent
        return [
            vehicle
            for vehicle in self._parts.picture.fleet.in_order()
            if vehicle.id != but
            and vehicle.telemetry.airborne
            and vehicle.freshness(now) is not Freshness.LOST
            and (vehicle.id in sent or self._parts.comms.firmware.of(vehicle).flies_mission(vehicle))
        ]

    def _is_alone(self, vehicle: Vehicle, starts: tuple[int, ...]) -> bool:
        """Whether nothing else begins or is in the air."""
        others = (v for v in self._parts.picture.fleet.vehicles.values() if v.id != vehicle.id)
        return not any(v.telemetry.airborne or v.id in starts for v in others)

    def _vehicle(self, number: int) -> Vehicle | None:
        return self._parts.picture.fleet.vehicles.get(number)

    def _is_known(self, vehicle: Vehicle) -> bool:
        return self._parts.services.missions.state(vehicle.id).held[PlanKind.MISSION].known

    def _may_read(self, vehicle: Vehicle) -> bool:
        """Whether its mission is not known, and it can be asked for it."""
        state, now = self._parts.services.missions.state(vehicle.id), self._parts.records.clock.now()
        heard = vehicle.freshness(now) is Freshness.OK and not vehicle.path.high_latency
        return heard and state.total != 0 and not self._is_known(vehicle)

    def _current(self, vehicle: Vehicle) -> int:
        return self._parts.services.missions.state(vehicle.id).current or 0

    def _held_path(self, vehicle: Vehicle, first: int) -> ComparablePath | None:
        """The mission that it holds, from where it is now to item `first` and on; None if it is not known."""
        held = self._parts.services.missions.state(vehicle.id).held[PlanKind.MISSION]
        return self._path(vehicle, held.plan.items, first) if held.known and held.plan is not None else None

    def _path(self, vehicle: Vehicle, items: tuple[PlanItem, ...], first: int) -> ComparablePath | None:
        """These items as the vehicle would fly them from where it is now; None without a position."""
        now, key = self._parts.records.clock.now(), (vehicle.id, first, id(items))
        if not self._made_s <= now < self._made_s + SAME_S:
            self._paths, self._apart, self._made_s = {}, {}, now
        if key not in self._paths:
            self._paths[key] = items, self._make_path(vehicle, items, first)
        return self._paths[key][1]

    def _make_path(self, vehicle: Vehicle, items: tuple[PlanItem, ...], first: int) -> ComparablePath | None:
        amsl_m = home_amsl_m(self._parts, vehicle)
        if not vehicle.telemetry.has_position() or not math.isfinite(amsl_m):
            return None
        east_m, north_m, _ = vehicle.telemetry.position_m
        home_m = self._parts.flight.flights.home_m(vehicle) or (east_m, north_m, 0.0)
        limits = self._parts.flight.guard.limits_of(vehicle.id)
        performance = Performance(speed_m_s=limits.speed_m_s, accel_m_s2=limits.accel_m_s2)
        path = timed_path(
            items,
            HomePosition(home_m[:2], amsl_m),
            self._parts.picture.fleet.frame,
            performance,
            start_m=(east_m, north_m, vehicle.telemetry.alt_rel_m),
            first=first,
        )
        return None if path.is_empty else comparable(path)


def _unread(vehicles: Iterable[int]) -> str:
    unread = sorted(set(vehicles))
    return f"not compared with {vehicles_words(unread)}: mission not read" if unread else ""
