"""Flying a stored mission item by item, the same for both autopilots; how they move and what they say is theirs."""

import math
from typing import Protocol

from sitl.common import missions
from sitl.common.autopilot import Autopilot
from sitl.common.missions import Item

Point = tuple[float, float, float]

LAST_NAVIGATION = 95
"""Commands above this are done at once, on the way."""
CHANGE_SPEED, DELAY = 178, 93
NEVER_US = 1 << 62


class Mover(Protocol):
    """The autopilot as a mission moves it and speaks through it."""

    def go(self, place_m: Point) -> None:
        """Fly there."""

    def climb(self, height_m: float) -> None:
        """Take off, or climb on the spot."""

    def land(self) -> None:
        """Land here."""

    def come_home(self) -> None:
        """Return and land."""

    def change_speed(self, speed_m_s: float) -> None:
        """From now on."""

    def begun(self, seq: int, item: Item) -> None:
        """An item that moves it has begun."""

    def reached(self, seq: int, item: Item, *, last: bool) -> None:
        """Its place was reached."""

    def finished(self) -> None:
        """There is no item left."""


class MissionFlight:
    """Progress through `plans.mission`."""

    def __init__(self, ap: Autopilot, mover: Mover, *, first: int, radius_m: float) -> None:
        self.ap = ap
        self.mover = mover
        self.first = first
        """The first item that is flown: ArduPilot's item 0 is home."""
        self.radius_m = radius_m
        self.running = False
        self.complete = False
        self._place: Point | None = None
        self._leave_us = NEVER_US
        self._jumps: dict[int, int] = {}

    def start(self) -> None:
        """Begin, or go on with the item where it stopped; a finished mission begins anew."""
        plans = self.ap.plans
        if self.complete or not self.first <= plans.seq < len(plans.mission):
            plans.seq = self.first
            self._jumps.clear()
        self.running, self.complete = True, False
        self._run()

    def stop(self) -> None:
        """Another mode is in force; the item is kept."""
        self.running = False

    def jump(self, seq: int) -> None:
        """Go on with another item."""
        self.ap.plans.seq = max(seq, self.first)
        self.complete = False
        if self.running:
            self._run()

    def tick(self) -> None:
        """Look whether the item is done."""
        if not self.running:
            return
        if self._place is not None and self._leave_us == NEVER_US and self._near(self._place):
            self._arrive()
        if self.ap.now_us >= self._leave_us:
            self._next()

    def _near(self, place: Point) -> bool:
        x, y, z = self.ap.vehicles.seen(self.ap.index)
        return math.hypot(place[0] - x, place[1] - y) < self.radius_m and abs(place[2] - z) < self.radius_m

    def _item(self) -> Item:
        return self.ap.plans.mission[self.ap.plans.seq]

    def _arrive(self) -> None:
        item, seq = self._item(), self.ap.plans.seq
        if item.command == missions.LAND:
            self._place = None
            self.mover.land()
            return
        waits = item.p1 if item.command in (missions.WAYPOINT, missions.LOITER_TIME) and math.isfinite(item.p1) else 0.0
        self.mover.reached(seq, item, last=waits > 0.0 or self._is_last())
        self._leave_us = self.ap.now_us + round(waits * 1e6)
        if item.command == missions.LOITER_UNLIMITED:
            self._place = None
            self._leave_us = NEVER_US

    def _is_last(self) -> bool:
        later = self.ap.plans.mission[self.ap.plans.seq + 1 :]
        return not any(item.command <= LAST_NAVIGATION for item in later)

    def _next(self) -> None:
        self.ap.plans.seq += 1
        self._run()

    def _run(self) -> None:
        """Do what needs no time, begin the next item that does."""
        plans = self.ap.plans
        self._place, self._leave_us = None, NEVER_US
        for _ in range(len(plans.mission) + 1):
            if plans.seq >= len(plans.mission):
                self._finish()
                return
            item = self._item()
            if item.command <= LAST_NAVIGATION:
                self._begin(item)
                return
            if item.command == CHANGE_SPEED:
                self.mover.change_speed(item.p2)
            if item.command != missions.DO_JUMP or not self._jumped(item):
                plans.seq += 1
        self._finish()

    def _jumped(self, item: Item) -> bool:
        seq, target = self.ap.plans.seq, int(item.p1)
        done = self._jumps.get(seq, 0)
        if not self.first <= target < len(self.ap.plans.mission) or (item.p2 >= 0 and done >= item.p2):
            return False
        self._jumps[seq] = done + 1
        self.ap.plans.seq = target
        return True

    def _begin(self, item: Item) -> None:
        place = self.place_of(item)
        self.mover.begun(self.ap.plans.seq, item)
        if item.command == missions.TAKEOFF:
            x, y, _ = self.ap.vehicles.seen(self.ap.index)
            self._place = (x, y, place[2])
            self.mover.climb(place[2])
        elif item.command == missions.LAND and (item.x or item.y):
            self._place = (place[0], place[1], self.ap.vehicles.seen(self.ap.index)[2])
            self.mover.go(self._place)
        elif item.command == missions.LAND:
            self.mover.land()
        elif item.command == missions.RETURN:
            self.mover.come_home()
        elif item.command == DELAY:
            self._leave_us = self.ap.now_us + round(max(item.p1, 0.0) * 1e6)
        else:
            self._place = place
            self.mover.go(place)

    def place_of(self, item: Item) -> Point:
        """In the vehicle's frame; without a latitude and longitude it is here. Heights above terrain count as AMSL."""
        x, y, _ = self.ap.vehicles.seen(self.ap.index)
        if item.x or item.y:
            x, y = self.ap.vehicles.to_local(self.ap.index, item.lat_deg, item.lon_deg)
        return x, y, item.z + (self.ap.home_m[2] if item.relative else -self.ap.spec.ground_amsl_m)

    def _finish(self) -> None:
        self.ap.plans.seq = max(len(self.ap.plans.mission) - 1, 0)
        self.running, self.complete = False, True
        self.mover.finished()
