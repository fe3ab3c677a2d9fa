"""Arming, refusals, guided flight, hold, return, landing: motors turn and vehicles fly."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.report import check
from tui_gcs.core.course import Trajectory
from tui_gcs.core.firmware.base import Firmware
from tui_gcs.core.messages import Vec3
from tui_gcs.core.services.order import Action, Order, Outcome, Retry
from tui_gcs.core.tracking import Led, Tracking
from tui_gcs.core.vehicle import Vehicle

READY_S = 90.0
HEIGHT_M = 12.0
GOTO_M, GOTO_SPEED_M_S = 30.0, 5.0
TRACK_DT_S = 0.25
CIRCLE_R_M, CIRCLE_SPEED_M_S = 30.0, 5.0
CIRCLE_ERROR_M, CIRCLE_LAG_S = 2.0, 0.5
"""What the patrol needs of every autopilot (the issue)."""
SPEED_SHARE = 0.25
"""PX4 holds 81 to 86 % of a velocity without a position (px4.md and measured), ArduCopter 101 %."""
STOP_WAY_M = 30.0
"""From 8 m/s both autopilots measured stop within 20 m (ardupilot.md, "Sticks")."""
REBOOT = 246


class Pilot:
    """Commands one vehicle through the station, and waits for what becomes of it."""

    def __init__(self, field: Field, system: int) -> None:
        """Nothing is sent."""
        self.field, self.system = field, system
        self.ended: list[tuple[Outcome, str]] = []

    @property
    def vehicle(self) -> Vehicle:
        """As the station sees it."""
        return self.field.vehicle(self.system)

    @property
    def firmware(self) -> Firmware:
        """How it is spoken to."""
        return self.field.station.firmware.of(self.vehicle)

    def done(self, action: Action, outcome: Outcome, why: str) -> None:
        """An order ended."""
        self.ended.append((outcome, why))

    def order(self, action: Action | None, limit_s: float = 20.0) -> tuple[Outcome, str, float]:
        """Submit an order and wait for its end: (outcome, why, time it took)."""
        if action is None:
            return Outcome.CONFIRMED, "", 0.0
        self.ended.clear()
        if action.on_done is None:
            action.on_done = self.done
        self.field.station.commands.submit(action)
        took_s = self.field.until(lambda: bool(self.ended), limit_s, f"{action.name}: an end")
        return *self.ended[-1], took_s

    def must(self, action: Action | None, limit_s: float = 20.0) -> float:
        """Submit an order that has to be confirmed; how long it took.

        Raises:
            Failed: It was not.
        """
        outcome, why, took_s = self.order(action, limit_s)
        if outcome is not Outcome.CONFIRMED:
            raise Failed(f"{action.name if action else ''}: {outcome.value} ({why})")
        return took_s

    def armed(self) -> float:
        """Make ready, prepare and arm; the time from the arming order to the armed heartbeat."""
        v = self.vehicle
        if v.armed:
            self.down()
        self.field.until(
            lambda: not self.firmware.start_problem(v), READY_S, lambda: f"its start ({self.firmware.start_problem(v)})"
        )
        self.must(self.firmware.prepare(v, self.done))
        self.field.until(lambda: self.firmware.is_prepared(v), 5.0, "its mode")
        health = self.field.station.services.health
        settled_s = self.field.clock.now() + 2.0  # what it said of itself in the mode before does not count
        self.field.until(lambda: self.field.clock.now() > settled_s and health.of(v).ready, READY_S, self.why_not_ready)
        return self.must(self.firmware.arm(v, self.done))

    @property
    def why_not_ready(self) -> str:
        """What is wrong with it, in words."""
        return "ready to arm: " + "; ".join(
            p.text for p in self.field.station.services.health.of(self.vehicle).problems
        )

    def up(self, height_m: float = HEIGHT_M) -> float:
        """Arm and climb to a height; the time of the climb."""
        self.armed()
        v = self.vehicle
        self.must(self.firmware.take_off(v, height_m, self.done))
        return self.field.until(lambda: abs(v.alt_rel_m - height_m) < 1.0, 60.0, f"{height_m:g} m reached")

    def down(self) -> float:
        """Land where it is; the time until it is disarmed."""
        v = self.vehicle
        if not v.armed:
            return 0.0
        self.field.station.commands.cancel(v.id)
        self.must(self.firmware.land(v))
        return self.field.until(lambda: not v.armed, 90.0, "landed and disarmed")

    def follow(self, at: Callable[[float], tuple[Vec3, Vec3]], seconds: float) -> Iterator[tuple[float, Vec3, float]]:
        """Steer along a moving reference as the station steers a patrol, with the lead it learns in flight.

        Yields (time since the begin, where the plan wants it, how late it is), once per new position.
        """
        times = np.arange(0.0, seconds + 10.0, TRACK_DT_S)
        samples = [at(float(t)) for t in times]
        began_s = self.field.clock.now()
        points, velocities = (np.array(column, dtype=float) for column in zip(*samples, strict=True))
        course = Trajectory(began_s, TRACK_DT_S, points, velocities)
        tracking = Tracking(self.firmware.lead)
        next_s, looked_s = began_s, 0.0
        while (now := self.field.clock.now()) - began_s < seconds:
            if now >= next_s - 1e-9:
                next_s += self.firmware.setpoint_gap_s
                tracking.look(course, self.vehicle)
                led = Led(course, tracking.lead)
                self.firmware.follow(self.vehicle, *led.at(now), led.push(now))
            if self.vehicle.position_s > looked_s and self.vehicle.position_s > began_s:
                looked_s = self.vehicle.position_s
                yield looked_s - began_s, course.at(looked_s)[0], tracking.lag_s
            self.field.pump(False)


@contextmanager
def flying(field: Field, system: int) -> Iterator[Pilot]:
    """A vehicle at `HEIGHT_M`, landed again whatever happens."""
    pilot = Pilot(field, system)
    pilot.up()
    try:
        yield pilot
    finally:
        pilot.firmware.release(pilot.vehicle)
        pilot.down()


@check("arm and disarm")
def arm(field: Field, vehicle: int) -> str:
    """It becomes ready, arms, and disarms on the ground."""
    pilot = Pilot(field, vehicle)
    armed_s = pilot.armed()
    disarmed_s = pilot.must(pilot.firmware.disarm(pilot.vehicle))
    return f"armed {armed_s:.2f} s after the order, disarmed {disarmed_s:.2f} s after"


@check("refusal: take-off on the ground, disarmed")
def take_off_disarmed(field: Field, vehicle: int) -> str:
    """Taking off without arming never counts as done, and it stays on the ground."""
    pilot = Pilot(field, vehicle)
    v = pilot.vehicle
    outcome, why, took_s = pilot.order(pilot.firmware.take_off(v, HEIGHT_M, pilot.done), 30.0)
    if outcome is Outcome.CONFIRMED or v.armed:
        raise Failed(f"take-off while disarmed: {outcome.value}, armed: {v.armed}")
    pilot.must(pilot.firmware.prepare(v, pilot.done))
    return f"{outcome.value} ({why or 'it says nothing'}) after {took_s:.1f} s"


@check("take-off, hover, land")
def take_off(field: Field, vehicle: int) -> str:
    """To 12 m above home, hold there within a metre, down and disarmed by itself."""
    pilot = Pilot(field, vehicle)
    climb_s = pilot.up()
    v = pilot.vehicle
    heights = []
    for _ in range(25):
        field.run(0.2)
        heights.append(v.alt_rel_m)
    down_s = pilot.down()
    off_m = max(abs(h - HEIGHT_M) for h in heights)
    if off_m > 1.5:
        raise Failed(f"hovers {off_m:.1f} m off its height")
    return f"{HEIGHT_M:g} m in {climb_s:.1f} s, hovers within {off_m:.2f} m, down and disarmed in {down_s:.1f} s"


@check("go to a place, its height and speed")
def go_to(field: Field, vehicle: int) -> str:
    """30 m east and 5 m up: arrives within 1 m, no faster than asked."""
    with flying(field, vehicle) as pilot:
        v = pilot.vehicle
        x, y, z = v.position_m
        target = (x + GOTO_M, y, z + 5.0)
        if (engage := pilot.firmware.engage(v)) is not None:
            pilot.must(engage)
        pilot.firmware.go_to(v, target, GOTO_SPEED_M_S, anew=True)
        fastest = [0.0]

        def there() -> bool:
            fastest[0] = max(fastest[0], v.ground_speed_m_s)
            return math.dist(v.position_m, target) < 1.0 and v.ground_speed_m_s < 0.5

        took_s = field.until(there, 60.0, f"within 1 m of a place {GOTO_M:g} m away")
        if fastest[0] > GOTO_SPEED_M_S * 1.3:
            raise Failed(f"{fastest[0]:.1f} m/s, asked for {GOTO_SPEED_M_S:g} m/s")
        return f"arrived after {took_s:.1f} s, fastest {fastest[0]:.1f} m/s"


@check("velocity, and its end")
def velocity(field: Field, vehicle: int) -> str:
    """3 m/s north for 8 s; then we say nothing more, as a dead station would, and it must not fly on so."""
    with flying(field, vehicle) as pilot:
        v = pilot.vehicle
        mean_m_s = sum(speeds := list(_fly_north(pilot, 3.0, 8.0))) / len(speeds)
        if abs(mean_m_s - 3.0) > SPEED_SHARE * 3.0:
            raise Failed(f"{mean_m_s:.2f} m/s, asked for 3 m/s")
        mode = v.custom_mode
        field.run(10.0, muted=True)
        word = field.station.services.modes.name(v)
        if v.ground_speed_m_s > 1.0 and v.custom_mode == mode:
            raise Failed(f"10 s after the last word it still flies {v.ground_speed_m_s:.1f} m/s in {word}")
        return f"{mean_m_s:.2f} m/s; 10 s after the last word: {word}, {v.ground_speed_m_s:.1f} m/s"


def _fly_north(pilot: Pilot, speed_m_s: float, seconds: float) -> Iterator[float]:
    """Fly north; the speed of the second half of the time."""
    clock, v = pilot.field.clock, pilot.vehicle
    if (engage := pilot.firmware.engage(v)) is not None:
        pilot.must(engage)
    began_s = next_s = clock.now()
    while (now := clock.now()) - began_s < seconds:
        if now >= next_s - 1e-9:
            next_s += pilot.firmware.setpoint_gap_s
            pilot.firmware.fly(v, (0.0, speed_m_s, 0.0))
            if now - began_s > seconds / 2.0:
                yield v.ground_speed_m_s
        pilot.field.pump(False)


@check("hold while it flies fast")
def hold(field: Field, vehicle: int) -> str:
    """Told to hold in the middle of a leg it stops and stays."""
    with flying(field, vehicle) as pilot:
        v = pilot.vehicle
        x, y, z = v.position_m
        if (engage := pilot.firmware.engage(v)) is not None:
            pilot.must(engage)
        pilot.firmware.go_to(v, (x, y + 80.0, z), 8.0, anew=True)
        field.until(lambda: v.ground_speed_m_s > 4.0, 20.0, "4 m/s")
        steering = field.station.steering
        where = [v.position_m]
        stop_s = pilot.must(pilot.firmware.hold(v, lambda: steering.stop_place(v)), 20.0)
        way_m = math.dist(where[0], v.position_m)
        if way_m > STOP_WAY_M:
            raise Failed(f"flew on for {way_m:.0f} m and {stop_s:.1f} s")
        place = v.position_m
        field.run(5.0)
        drift_m = math.dist(place, v.position_m)
        if drift_m > 2.0:
            raise Failed(f"moved {drift_m:.1f} m in 5 s of holding")
        return f"stopped after {stop_s:.1f} s and {way_m:.1f} m, moved {drift_m:.2f} m in 5 s"


@check("patrol: a moving reference on a circle")
def circle(field: Field, vehicle: int) -> str:
    """Slots of a patrol move: within 2 m and 0.5 s of the plan on a circle of 30 m at 5 m/s."""
    with flying(field, vehicle) as pilot:
        x, y, z = pilot.vehicle.position_m
        rate = CIRCLE_SPEED_M_S / CIRCLE_R_M

        def at(t: float) -> tuple[Vec3, Vec3]:
            a = rate * t
            point = (x + CIRCLE_R_M * math.sin(a), y + CIRCLE_R_M * (1 - math.cos(a)), z)
            return point, (CIRCLE_SPEED_M_S * math.cos(a), CIRCLE_SPEED_M_S * math.sin(a), 0.0)

        lap_s = 2.0 * math.pi / rate
        radial, lag = [], []
        for t, _, late_s in pilot.follow(at, 2.0 * lap_s):
            if t > lap_s:  # the first lap is for learning: a patrol goes round for minutes
                vx, vy, _ = pilot.vehicle.position_m
                radial.append(math.hypot(vx - x, vy - y - CIRCLE_R_M) - CIRCLE_R_M)
                lag.append(late_s)
        pilot.must(pilot.firmware.hold(pilot.vehicle, lambda: pilot.vehicle.position_m), 20.0)
        off_m, late_s = max(map(abs, radial)), sum(lag) / len(lag)
        text = f"radial {sum(radial) / len(radial):+.2f} m, at most {off_m:.2f} m; lag {late_s:+.2f} s"
        if off_m > CIRCLE_ERROR_M or abs(late_s) > CIRCLE_LAG_S:
            raise Failed(text)
        return text


@check("return to launch")
def rtl(field: Field, vehicle: int) -> str:
    """From 30 m away: back over home, down, disarmed, within 3 m of where it started."""
    pilot = Pilot(field, vehicle)
    pilot.up()
    v = pilot.vehicle
    home = v.position_m
    if (engage := pilot.firmware.engage(v)) is not None:
        pilot.must(engage)
    pilot.firmware.go_to(v, (home[0] + 30.0, home[1], home[2]), 8.0, anew=True)
    field.until(lambda: v.position_m[0] > home[0] + 25.0, 40.0, "25 m away")
    pilot.firmware.release(v)
    began_s = field.clock.now()
    pilot.must(pilot.firmware.rtl(v))
    field.until(lambda: not v.armed, 180.0, "back, landed and disarmed")
    away_m = math.dist(v.position_m[:2], home[:2])
    if away_m > 3.0:
        raise Failed(f"landed {away_m:.1f} m from where it started")
    return f"disarmed {field.clock.now() - began_s:.0f} s after the order, {away_m:.1f} m from where it started"


@check("two vehicles at once", fleet=True)
def together(field: Field, vehicle: int) -> str:
    """All vehicles take off and land together, each at its own height."""
    if len(field.ids) < 2:
        raise NotApplicable("there is only one vehicle")
    pilots = [Pilot(field, system) for system in field.ids[:8]]
    for pilot in pilots:
        pilot.armed()
        pilot.must(pilot.firmware.take_off(pilot.vehicle, HEIGHT_M + 3.0 * pilots.index(pilot), pilot.done))
    heights = {p.system: HEIGHT_M + 3.0 * i for i, p in enumerate(pilots)}

    def all_up() -> bool:
        return all(abs(p.vehicle.alt_rel_m - heights[p.system]) < 1.0 for p in pilots)

    up_s = field.until(all_up, 90.0, "all at their heights")
    for pilot in pilots:
        field.station.commands.submit(pilot.firmware.land(pilot.vehicle))
    down_s = field.until(lambda: not any(p.vehicle.armed for p in pilots), 120.0, "all landed and disarmed")
    return f"{len(pilots)} vehicles up in {up_s:.0f} s, down in {down_s:.0f} s"


@check("our heartbeats stop in flight")
def silence(field: Field, vehicle: int) -> str:
    """12 s without a word from us: what it does then, and that the station finds it again."""
    with flying(field, vehicle) as pilot:
        v = pilot.vehicle
        mode, place = v.custom_mode, v.position_m
        field.run(12.0, muted=True)
        word = field.station.services.modes.name(v)
        moved_m = math.dist(place, v.position_m)
        field.run(2.0)
        changed = f"changed to {word}" if v.custom_mode != mode else f"stays in {word}"
        return f"{changed}, moved {moved_m:.1f} m; afterwards it lands when told"


@check("reboot on the ground")
def reboot(field: Field, vehicle: int) -> str:
    """It is told to reboot: the station sees it, and asks for everything anew."""
    pilot = Pilot(field, vehicle)
    v = pilot.vehicle
    if v.armed:
        pilot.down()
    reboots: list[Vehicle] = []
    field.station.fleet.paths.on_reboot.append(reboots.append)
    began_s = field.clock.now()
    order = Order(REBOOT, (1.0,))
    action = field.station.speech.action(v.id, "reboot", Retry.START, order, lambda _: bool(reboots))
    outcome, why, _ = pilot.order(action, 30.0)
    if outcome is Outcome.REFUSED:
        field.station.fleet.paths.on_reboot.remove(reboots.append)
        raise NotApplicable(f"it refuses to reboot: {why}")
    field.until(lambda: any(r.id == v.id for r in reboots), 30.0, "a reboot is seen")
    field.station.fleet.paths.on_reboot.remove(reboots.append)
    seen_s = field.clock.now() - began_s
    before = v.path.slots[33].count if 33 in v.path.slots else 0
    field.until(lambda: 33 in v.path.slots and v.path.slots[33].count > before + 20, 60.0, "positions come again")
    return f"seen after {seen_s:.1f} s, positions again after {field.clock.now() - began_s:.1f} s"
