"""Commands one vehicle through the station, and waits for what becomes of it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from tests.conformance.field import Failed, Field, NotApplicable
from tui_gcs.core.firmware.base import Firmware
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import PASS
from tui_gcs.core.motion.course import Trajectory
from tui_gcs.core.motion.lead_compensation import LeadCompensatedCourse
from tui_gcs.core.motion.tracking_error import TrackingMonitor
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass, VehicleAction

READY_S = 90.0
HEIGHT_M = 12.0
SETTLE_S = 2.0
TRACK_DT_S = 0.25


class Pilot:
    """Commands one vehicle through the station, and waits for what becomes of it."""

    def __init__(self, field: Field, system: int) -> None:
        """Nothing is sent."""
        self.field, self.system = field, system
        self.ended: list[tuple[Outcome, str]] = []
        self.height_m = HEIGHT_M + field.layer_m(system)
        """Where it flies."""

    @property
    def vehicle(self) -> Vehicle:
        """As the station sees it."""
        return self.field.vehicle(self.system)

    @property
    def firmware(self) -> Firmware:
        """How it is spoken to."""
        return self.field.station.comms.firmware.of(self.vehicle)

    @property
    def mode(self) -> str:
        """The word for the mode it is in."""
        return self.field.station.services.modes.name(self.vehicle)

    # ---------------------------------------------------------------- orders

    def done(self, action: VehicleAction, outcome: Outcome, why: str) -> None:
        """An order ended."""
        self.ended.append((outcome, why))

    def order(self, action: VehicleAction | None, limit_s: float = 20.0) -> tuple[Outcome, str, float]:
        """Submit an order and wait for its end: (outcome, why, time it took)."""
        if action is None:
            return Outcome.CONFIRMED, "", 0.0
        self.ended.clear()
        if action.on_done is None:
            action.on_done = self.done
        self.field.station.comms.commands.submit(action)
        took_s = self.field.until(lambda: bool(self.ended), limit_s, f"{action.name}: an end")
        return *self.ended[-1], took_s

    def must(self, action: VehicleAction | None, limit_s: float = 20.0) -> float:
        """Submit an order that has to be confirmed; how long it took.

        Raises:
            Failed: It was not.
        """
        outcome, why, took_s = self.order(action, limit_s)
        if outcome is not Outcome.CONFIRMED:
            raise Failed(f"{action.name if action else ''}: {outcome.value} ({why or 'no reason given'})")
        return took_s

    def asked(self, name: str, order: MavCommand) -> tuple[Outcome, str, float]:
        """Any command that is done when it is acknowledged."""
        return self.order(
            self.field.station.comms.command_encoder.action(self.system, name, RetryClass.START, order, None, self.done)
        )

    # ---------------------------------------------------------------- from the ground and back

    def ready(self) -> None:
        """On the ground, in the mode it is armed in, and ready by what it says itself."""
        v = self.vehicle
        why = self.firmware.why_not(v)
        if why:
            raise NotApplicable(f"this station does not fly it: {why}")
        if v.telemetry.armed:
            self.down()
        self.field.until(
            lambda: not self.firmware.start_problem(v), READY_S, lambda: f"its start ({self.firmware.start_problem(v)})"
        )
        self.must(self.firmware.prepare(v, self.done))
        self.field.until(lambda: self.firmware.is_prepared(v), 5.0, "its mode")
        health = self.field.station.services.health
        settled_s = self.field.clock.now() + SETTLE_S  # what it said of itself in the mode before does not count
        self.field.until(lambda: self.field.clock.now() > settled_s and health.of(v).ready, READY_S, self.why_not_ready)

    def armed(self) -> float:
        """Make ready and arm; the time from the arming order to the armed heartbeat."""
        self.ready()
        return self.must(self.firmware.arm(self.vehicle, self.done))

    def why_not_ready(self) -> str:
        """What is wrong with it, in words."""
        return "ready to arm (" + self.problems() + ")"

    def problems(self) -> str:
        """What speaks against a start now, in words; "" if nothing does."""
        v = self.vehicle
        health = self.field.station.services.health.of(v)
        found = [self.firmware.start_problem(v)] + ([] if health.ready else [p.text for p in health.problems])
        return "; ".join(filter(None, found))

    def up(self) -> float:
        """Arm and climb to its height; the time of the climb."""
        self.armed()
        v = self.vehicle
        self.must(self.firmware.take_off(v, self.height_m, self.done))
        return self.field.until(
            lambda: abs(v.telemetry.alt_rel_m - self.height_m) < 1.0, 60.0, f"{self.height_m:g} m reached"
        )

    def down(self) -> float:
        """Land where it is; the time until it is disarmed."""
        v = self.vehicle
        if not v.telemetry.armed:
            return 0.0
        self.firmware.release(v)
        self.field.station.comms.commands.cancel(v.id)
        self.must(self.firmware.land(v))
        return self.field.until(lambda: not v.telemetry.armed, 120.0, "landed and disarmed")

    # ---------------------------------------------------------------- in the air

    def engage(self) -> None:
        """Make it take what is said next."""
        self.must(self.firmware.engage(self.vehicle))

    def fly(self, velocity_m_s: Vec3, seconds: float) -> Iterator[float]:
        """Move with a velocity; gives the time since the begin, at every moment."""
        clock, v = self.field.clock, self.vehicle
        self.engage()
        began_s = next_s = clock.now()
        while (now := clock.now()) - began_s < seconds:
            if now >= next_s - 1e-9:
                next_s += self.firmware.setpoint_gap_s
                self.firmware.fly(v, velocity_m_s, PASS)
            yield now - began_s
            self.field.turns.wait()

    def follow(self, at: Callable[[float], tuple[Vec3, Vec3]], seconds: float) -> Iterator[tuple[float, Vec3, float]]:
        """Steer along a moving reference as the station steers a patrol, with the lead it learns in flight.

        Yields (time since the begin, where the plan wants it, how late it is), once per new position.
        """
        times = np.arange(0.0, seconds + 10.0, TRACK_DT_S)
        samples = [at(float(t)) for t in times]
        began_s = self.field.clock.now()
        points, velocities = (np.array(column, dtype=float) for column in zip(*samples, strict=True))
        course = Trajectory(began_s, TRACK_DT_S, points, velocities)
        tracking = TrackingMonitor(self.firmware.lead)
        next_s, looked_s = began_s, 0.0
        while (now := self.field.clock.now()) - began_s < seconds:
            if now >= next_s - 1e-9:
                next_s += self.firmware.setpoint_gap_s
                tracking.update(course, self.vehicle)
                led = LeadCompensatedCourse(course, tracking.lead)
                self.firmware.follow(self.vehicle, *led.at(now), PASS, led.feed_forward(now))
            if self.vehicle.telemetry.position_s > looked_s and self.vehicle.telemetry.position_s > began_s:
                looked_s = self.vehicle.telemetry.position_s
                yield looked_s - began_s, course.at(looked_s)[0], tracking.lag_s
            self.field.turns.wait()


@contextmanager
def flying(field: Field, system: int) -> Iterator[Pilot]:
    """A vehicle at its height. It is landed afterwards, as after every check (`tidy`), but within the check."""
    pilot = Pilot(field, system)
    pilot.up()
    yield pilot
    pilot.down()
