"""Requests about single vehicles in flight: arming, manual flight, following, missions on board."""

import math
from collections.abc import Callable
from functools import partial

from tui_gcs.core.base.text import clean
from tui_gcs.core.firmware.base import may_be_flying
from tui_gcs.core.firmware.command_encoder import Done
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flights import TakenOut
from tui_gcs.core.flight.steering import MIN_HOVER_M
from tui_gcs.core.guard.permission import StopReason
from tui_gcs.core.mavlink.commands import CMD_ARM_DISARM
from tui_gcs.core.protocol import flight as f
from tui_gcs.core.protocol.base import Vec3
from tui_gcs.core.requests.context import RequestContext
from tui_gcs.core.requests.handler import VehicleAct, named
from tui_gcs.core.requests.mission_comparison import MissionComparison
from tui_gcs.core.requests.tasks import Task
from tui_gcs.core.requests.vehicle_requests import ARMED
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass, VehicleAction

FORCE = 21196
"""Value of param2 of MAV_CMD_COMPONENT_ARM_DISARM that disarms in the air too."""
MAX_REASON_CELLS = 80
NUDGE_OVER = "does something else meanwhile: begin the nudge anew"


class FlightRequests:
    """Begins requests about vehicles in flight; fleet frames and events show how each goes on."""

    def __init__(self, context: RequestContext, comparison: MissionComparison) -> None:
        self._context, self._parts, self._comparison = context, context.parts, comparison
        self.acts: dict[type, VehicleAct] = {
            f.Arm: VehicleAct(self._arm, named("arm")),
            f.Disarm: VehicleAct(self._disarm, named("disarm")),
            f.KillMotors: VehicleAct(self._kill, named("KILL MOTORS")),
            f.TakeOff: VehicleAct(self._take_off, lambda r: f"take off to {r.alt_m:g} m"),
            f.GoTo: VehicleAct(self._go_to, _go_to_words),
            f.CircleFlight: VehicleAct(self._circle, _circle_words),
            f.LimitSpeed: VehicleAct(self._limit_speed, lambda r: f"speed {r.speed_m_s:g} m/s"),
            f.Nudge: VehicleAct(self._nudge, named("nudge")),
            f.Follow: VehicleAct(self._follow, lambda r: f"follow vehicle {r.leader}"),
            f.OnBoardMission: VehicleAct(self._on_board, lambda r: f"mission {r.act}"),
        }

    def _arm(self, vehicle: Vehicle, request: f.Arm, task: Task) -> str:
        """Set the mode in which this station flies it first, then arm."""
        if vehicle.telemetry.armed:
            return ARMED
        if why := self._context.readiness.why_not_lift(vehicle):
            return why
        self._prepared(vehicle, task, lambda: self._submit_arm(vehicle, task, lambda: task.end(text="armed")))
        return ""

    def _disarm(self, vehicle: Vehicle, request: f.Disarm, task: Task) -> str:
        if not vehicle.telemetry.armed:
            return "it is not armed"
        if may_be_flying(vehicle):
            return "it is in the air: land it first"
        action = self._parts.comms.firmware.of(vehicle).disarm(vehicle)
        action.on_done = self._ends(task, "disarmed")
        self._submit(action, task)
        return ""

    def _kill(self, vehicle: Vehicle, request: f.KillMotors, task: Task) -> str:
        """Stop the motors as a start-class order, which is never repeated later; done when it is not armed any more."""
        if len(request.vehicles) != 1:
            return "the motors of one vehicle at a time"
        if not request.reason.strip():
            return "say why"
        if not vehicle.telemetry.armed:
            return "it is not armed"
        task.what = f"{task.what}: {clean(request.reason, MAX_REASON_CELLS)}"
        self._parts.comms.commands.cancel(vehicle.id)
        order = MavCommand(CMD_ARM_DISARM, (0, FORCE))
        done = self._ends(task, "motors stopped")
        # Steering must end first: a guard's veto, a mode change or a lost link would end the order.
        if self._parts.flight.manual_control.steers(vehicle):
            done = partial(self._let_go_ended, vehicle, task, "motors stopped")
            self._parts.flight.manual_control.release(vehicle, TakenOut.MOTORS_STOPPED)
        action = self._parts.comms.command_encoder.action(
            vehicle.id, "disarm", RetryClass.START, order, lambda v: not v.telemetry.armed, done
        )
        action.stop = StopReason("disarm", task.who)
        self._submit(action, task)
        return ""

    def _take_off(self, vehicle: Vehicle, request: f.TakeOff, task: Task) -> str:
        parts = self._parts
        if not MIN_HOVER_M <= request.alt_m <= parts.flight.guard.area.alt_max_m:
            return f"{request.alt_m:g} m: {MIN_HOVER_M:g} to {parts.flight.guard.area.alt_max_m:g} m are allowed"
        readiness = self._context.readiness
        if why := readiness.why_not_lift(vehicle) or readiness.too_close(request.vehicles).get(vehicle.id):
            return why
        if why := parts.flight.manual_control.begin_take_off(vehicle, request.alt_m):
            return why

        def lift() -> None:
            done = self._ends(
                task, f"climbs to {request.alt_m:g} m", lambda: parts.flight.manual_control.on_lifted(vehicle)
            )
            self._submit(parts.comms.firmware.of(vehicle).take_off(vehicle, request.alt_m, done), task)

        self._prepared(
            vehicle, task, lambda: lift() if vehicle.telemetry.armed else self._submit_arm(vehicle, task, lift)
        )
        return ""

    def _go_to(self, vehicle: Vehicle, request: f.GoTo, task: Task) -> str:
        if len(request.points_m) != len(request.vehicles):
            return "name a place for each vehicle"
        point = request.points_m[request.vehicles.index(vehicle.id)]
        return self._began(task, self._parts.flight.manual_control.go_to(vehicle, point, request), "on its way")

    def _circle(self, vehicle: Vehicle, request: f.CircleFlight, task: Task) -> str:
        return self._began(task, self._parts.flight.manual_control.circle(vehicle, request), "on its way to the circle")

    def _nudge(self, vehicle: Vehicle, request: f.Nudge, task: Task) -> str:
        """Begin only with a nudge of zero: an arrow still held down ends no hold and takes no vehicle from a pilot."""
        # A key that is still held down must not end a hold, nor take a vehicle from a pilot.
        if any(request.velocity_m_s) and not self._parts.flight.manual_control.is_nudged(vehicle):
            return NUDGE_OVER
        return self._began(task, self._parts.flight.manual_control.nudge(vehicle, request, task.who), "moves")

    def _follow(self, vehicle: Vehicle, request: f.Follow, task: Task) -> str:
        if len(request.vehicles) > 1 and not all(map(math.isnan, request.offset_m[:2])):
            return "several keep the places they have: no offset"
        why = self._parts.flight.follow_control.begin(vehicle, request.leader, request.offset_m)
        return self._began(task, why, f"follows vehicle {request.leader}")

    def _began(self, task: Task, why: str, text: str) -> str:
        """End the task, or return why not: the guard checks the course at the next tick and reports a veto itself."""
        if not why:
            task.end(text=text)
        return why

    def _limit_speed(self, vehicle: Vehicle, request: f.LimitSpeed, task: Task) -> str:
        """Limit the speed of a course of ours, or else of a mission on board."""
        parts = self._parts
        if parts.flight.manual_control.steers(vehicle):
            why = parts.flight.manual_control.limit_speed(vehicle, request.speed_m_s)
            return self._began(task, why, f"at most {request.speed_m_s:g} m/s")
        # From here on it flies a mission on board, whose speed is its autopilot's; a planner's vehicle flies on as its
        # planner says.
        limit = parts.flight.guard.limits_of(vehicle.id).speed_m_s
        if not (math.isfinite(request.speed_m_s) and 0.1 <= request.speed_m_s <= limit):
            return f"{request.speed_m_s:g} m/s: 0.1 to {limit:g} are allowed"
        done = self._ends(task, f"at most {request.speed_m_s:g} m/s")
        action = parts.comms.firmware.of(vehicle).change_speed(vehicle, request.speed_m_s)
        action.on_done = done
        self._submit(action, task)
        return ""

    def _on_board(self, vehicle: Vehicle, request: f.OnBoardMission, task: Task) -> str:
        parts = self._parts
        firmware = parts.comms.firmware.of(vehicle)
        if why := firmware.why_not(vehicle):
            return why
        if not vehicle.telemetry.airborne:
            return "is not in the air: take off first"
        if parts.services.missions.state(vehicle.id).total == 0:
            return "holds no mission: upload one first"
        begin = partial(self._begin_mission, vehicle, request, task)
        if request.sure:
            begin("")
            return ""
        return self._comparison.begin(vehicle, request.vehicles, task, begin)

    def _begin_mission(self, vehicle: Vehicle, request: f.OnBoardMission, task: Task, remark: str) -> None:
        parts = self._parts
        firmware = parts.comms.firmware.of(vehicle)
        parts.comms.commands.cancel(vehicle.id)
        action = firmware.mission_start(vehicle) if request.act == "start" else firmware.mission_continue(vehicle)
        text = "; ".join(filter(None, ("flies its mission", remark)))
        action.on_done = partial(self._let_go_ended, vehicle, task, text)
        if parts.flight.flights.get(vehicle.id) is None:
            parts.flight.courses.watch_mission(vehicle.id)
        parts.flight.manual_control.release(vehicle, TakenOut.ON_BOARD)
        self._submit(action, task)

    def _let_go_ended(
        self, vehicle: Vehicle, task: Task, text: str, action: VehicleAction, outcome: Outcome, why: str
    ) -> None:
        """Hold a vehicle that was released for an order and did not take it."""
        if outcome is Outcome.CONFIRMED:
            task.end(text=text)
            return
        is_ours = outcome is not Outcome.SUPERSEDED  # by another order, which says what it does now
        if is_ours:
            # Nothing steers it any more, and its last set-point may have been a velocity: it would fly on.
            self._parts.flight.executive.hold((vehicle.id,), by=task.who)
        task.end("it is held: " * is_ours + ": ".join(part for part in (outcome.value, why) if part))

    def _prepared(self, vehicle: Vehicle, task: Task, then: Callable[[], None]) -> None:
        """Set the mode in which this station flies it where it has another, then call `then`."""
        firmware = self._parts.comms.firmware.of(vehicle)
        if firmware.is_prepared(vehicle):
            then()
        else:
            self._submit(firmware.prepare(vehicle, self._goes_on(vehicle, task, then)), task)

    def _submit_arm(self, vehicle: Vehicle, task: Task, then: Callable[[], None]) -> None:
        firmware = self._parts.comms.firmware.of(vehicle)
        self._context.checklist.lifted(task.who, vehicle.id)
        self._submit(firmware.arm(vehicle, self._goes_on(vehicle, task, then)), task)

    def _goes_on(self, vehicle: Vehicle, task: Task, then: Callable[[], None]) -> Done:
        def done(action: VehicleAction, outcome: Outcome, why: str) -> None:
            if outcome is Outcome.CONFIRMED:
                then()
            else:
                self._failed(vehicle, task, outcome, why)

        return done

    def _failed(self, vehicle: Vehicle, task: Task, outcome: Outcome, why: str) -> None:
        task.end(": ".join(part for part in (outcome.value, why) if part))
        self._parts.flight.executive.give_up_manual_take_off(vehicle)

    def _ends(self, task: Task, text: str, then: Callable[[], None] = lambda: None) -> Done:
        def done(action: VehicleAction, outcome: Outcome, why: str) -> None:
            if outcome is Outcome.CONFIRMED:
                then()
                task.end(text=text)
            else:
                vehicle = self._parts.picture.fleet.vehicles.get(action.vehicle)
                if vehicle is not None:
                    self._failed(vehicle, task, outcome, why)

        return done

    def _submit(self, action: VehicleAction, task: Task) -> None:
        task.stop = lambda: self._parts.comms.commands.cancel(action.vehicle, action.name)
        action.by = task.who
        self._parts.comms.commands.submit(action)


def _go_to_words(request: f.GoTo) -> str:
    places = dict.fromkeys(_place(point, from_home=request.from_home) for point in request.points_m[:8])
    return f"go to {', '.join(places)}"


def _circle_words(request: f.CircleFlight) -> str:
    x, y, _ = request.centre_m
    return f"orbit round ({x:.0f}, {y:.0f}), radius {request.radius_m:g} m"


def _place(point_m: Vec3, *, from_home: bool) -> str:
    """A place in metres; coordinates that were not given are left out."""
    x, y, z = point_m
    height = "" if math.isnan(z) else f"{z:.0f} m above home"
    if math.isnan(x) or math.isnan(y):
        return height or "where it is"
    ground = f"({x:.0f}, {y:.0f}) from its home" if from_home else f"({x:.0f}, {y:.0f})"
    return f"{ground}, {height}" if height else ground
