"""Progress through a stored mission, item by item, the same for both autopilots.

How a vehicle moves, and what it reports meanwhile, is each autopilot's own.
"""

import math
from abc import ABC, abstractmethod
from typing import ClassVar

from sitl.common import missions
from sitl.common.missions import Item
from sitl.common.platform import Part, Platform
from sitl.physics.point_masses import Point

LAST_NAVIGATION = 95
"""Commands above this number take no time."""
# MAV_CMD (common.xml).
CHANGE_SPEED, DELAY = 178, 93
NEVER_US = 1 << 62


class MissionFlight(Part, ABC):
    """Flies the items of `plans.mission` one after the other."""

    FIRST: ClassVar[int] = 0
    """The first item that is flown: ArduPilot's item 0 is home."""

    def __init__(self, platform: Platform, *, radius_m: float) -> None:
        super().__init__(platform)
        self.radius_m = radius_m
        """A place within this distance is reached."""
        self.running = False
        self.complete = False
        self._place: Point | None = None
        self._leave_us = NEVER_US
        self._jumps: dict[int, int] = {}

    @abstractmethod
    def changed(self) -> None:
        """Take note of another mission, or of another current item."""

    @abstractmethod
    def go(self, place_m: Point) -> None:
        """Fly to the place of an item."""

    @abstractmethod
    def climb(self, height_m: float) -> None:
        """Take off, or climb where the vehicle is."""

    @abstractmethod
    def land(self) -> None:
        """Land where the vehicle is."""

    @abstractmethod
    def come_home(self) -> None:
        """Fly home and land there; the mode stays the same."""

    @abstractmethod
    def change_speed(self, speed_m_s: float) -> None:
        """Fly with another speed from now on (DO_CHANGE_SPEED)."""

    def begun(self, item: Item) -> None:
        """Report that an item that moves the vehicle has begun; PX4 does not."""

    def reached(self, *, last: bool) -> None:
        """Report that the place of the current item was reached; `last` also for an item with a delay."""
        self._outbox.send("MISSION_ITEM_REACHED", seq=self._plans.seq)

    def passed(self) -> None:
        """Take note that the current item, which takes no time, was carried out; ArduPilot reports nothing of it."""

    def finished(self) -> None:
        """Act on the end of the mission; ArduPilot stays at the last place."""

    def start(self) -> None:
        """Begin, or continue with the item where it stopped; a finished mission begins again."""
        plans = self._plans
        if self.complete or not self.FIRST <= plans.seq < len(plans.mission):
            plans.seq = self.FIRST
            self._jumps.clear()
        self.running, self.complete = True, False
        self._run()

    def stop(self) -> None:
        """Stop because another mode is in force; the item is kept."""
        self.running = False

    def jump(self, seq: int) -> None:
        """Continue with another item; a mission that does not run begins with it."""
        self._plans.seq = max(seq, self.FIRST)
        self.complete = False
        if self.running:
            self._run()

    def tick(self) -> None:
        """Go on to the next item if this one is done."""
        if not self.running:
            return
        if self._place is not None and self._leave_us == NEVER_US and self._is_near(self._place):
            self._arrive()
        if self._clock.now_us >= self._leave_us:
            self._next()

    def _is_near(self, place: Point) -> bool:
        x, y, z = self._body.seen_m()
        return math.hypot(place[0] - x, place[1] - y) < self.radius_m and abs(place[2] - z) < self.radius_m

    def _item(self) -> Item:
        return self._plans.mission[self._plans.seq]

    def _arrive(self) -> None:
        item = self._item()
        if item.command == missions.LAND:
            self._place = None
            self.land()
            return
        # Stations send NaN for a parameter that they leave open.
        waits = item.p1 if item.command in (missions.WAYPOINT, missions.LOITER_TIME) and math.isfinite(item.p1) else 0.0
        self.reached(last=waits > 0.0 or self._is_last())
        self._leave_us = self._clock.now_us + round(waits * 1e6)
        if item.command == missions.LOITER_UNLIMITED:
            self._place = None
            self._leave_us = NEVER_US

    def _is_last(self) -> bool:
        later = self._plans.mission[self._plans.seq + 1 :]
        return not any(item.command <= LAST_NAVIGATION for item in later)

    def _next(self) -> None:
        self._plans.seq += 1
        self._run()

    def _run(self) -> None:
        """Do the items that take no time, and begin the next one that does."""
        plans = self._plans
        self._place, self._leave_us = None, NEVER_US
        # A mission of nothing but jumps and speeds must not loop for ever.
        for _ in range(len(plans.mission) + 1):
            if plans.seq >= len(plans.mission):
                self._finish()
                return
            item = self._item()
            if item.command <= LAST_NAVIGATION:
                self._begin(item)
                return
            if item.command == missions.DO_JUMP:
                if not self._jumped(item):
                    plans.seq += 1
                continue
            if item.command == CHANGE_SPEED:
                self.change_speed(item.p2)
            self.passed()
            plans.seq += 1
        self._finish()

    def _jumped(self, item: Item) -> bool:
        seq, target = self._plans.seq, int(item.p1)
        done = self._jumps.get(seq, 0)
        # A jump beyond the mission is skipped; a negative count repeats for ever.
        if not self.FIRST <= target < len(self._plans.mission) or (item.p2 >= 0 and done >= item.p2):
            return False
        self._jumps[seq] = done + 1
        self._plans.seq = target
        return True

    def _begin(self, item: Item) -> None:
        place = self._place_of(item)
        self.begun(item)
        if item.command == missions.TAKEOFF:
            x, y, _ = self._body.seen_m()
            self._place = (x, y, place[2])
            self.climb(place[2])
        elif item.command == missions.LAND and (item.x or item.y):
            self._place = (place[0], place[1], self._body.seen_m()[2])
            self.go(self._place)
        elif item.command == missions.LAND:
            self.land()
        elif item.command == missions.RETURN:
            self.come_home()
        elif item.command == DELAY:
            self._leave_us = self._clock.now_us + round(max(item.p1, 0.0) * 1e6)
        else:
            self._place = place
            self.go(place)

    def _place_of(self, item: Item) -> Point:
        """Return an item's place; without latitude and longitude it is here. Heights above terrain count as AMSL."""
        x, y, _ = self._body.seen_m()
        if item.x or item.y:
            x, y = self._body.to_local(item.lat_deg, item.lon_deg)
        home_z = self._state.home_m[2]
        return x, y, item.z + (home_z if item.relative else -self._spec.ground_amsl_m)

    def _finish(self) -> None:
        self._plans.seq = max(len(self._plans.mission) - 1, 0)
        self.running, self.complete = False, True
        self.finished()
