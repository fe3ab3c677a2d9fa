"""The executive takes the fleet from the ground to its planners and back.

Start: every vehicle climbs in its own column to its own layer; none moves sideways before all of its group are up.
Return: each flies on its layer to above its take-off place; none descends before all of its group are there, then they
land one after the other. Groups never come near each other (`scenario/vehicle_conflicts`), so none waits for another.
A hold comes first: it interrupts everything and is never queued.

The steps of a start are in `start_controller`, those of a return in `return_home`; how a vehicle gets LOST or leaves
its mode, and what it does when it is back, is in `vehicle_loss`.
"""

import math
from collections.abc import Iterator

from tui_gcs.core.firmware.base import flown_by_pilot, may_be_flying, stands_still
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import IN_THE_AIR, ArmingStep, Flight, HoldStep, KeptOrder, Lost, TakenOut
from tui_gcs.core.flight.landing_check import falls, is_down, landing_words
from tui_gcs.core.flight.return_home import ReturnController
from tui_gcs.core.flight.start_controller import StartController
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.flight.vehicle_loss import Comeback, VehicleLossController
from tui_gcs.core.guard.permission import STATION
from tui_gcs.core.motion.course import PositionTarget
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import EventClass, Freshness, Phase, Reply, RunPhase, VehicleResult
from tui_gcs.core.records.event_log import ALERT, INFO, NOTICE, WARNING

RESUME_WITHIN_S = 10.0
"""A restarted station lets vehicles go on by itself only this long; then an operator must resume them."""
HELD_BY_NAME = "was held by name"
"""Default of `Flight.stays` after a hold of named vehicles."""
RETURN, LAND, HOLD = "return", "land", "hold"
"""What a `KeptOrder` is."""


class Executive:
    """Owns the phases of all flights; every order to fly, hold, return or land passes through it."""

    def __init__(self, services: FlightServices, steering: Steering, speed_m_s: float) -> None:
        """`speed_m_s` limits flights to a place (transfer, return)."""
        self.run = RunPhase.IDLE
        self.started_s = math.nan
        """When the mission clock began; NaN before the first start."""
        self.resume_found = False
        """After a restart in a running mission: vehicles found in the air go on (the scenario's `resume = true`)."""
        self._born_s = services.clock.now()
        self._fleet, self._flights, self._firmware = services.fleet, services.flights, services.firmware
        self._commands, self._events, self._clock = services.commands, services.events, services.clock
        self._steering = steering
        self._starts = StartController(services, self._end_start)
        self.losses = VehicleLossController(services)
        self.return_control = ReturnController(services, steering, speed_m_s)

    def start(self, vehicles: tuple[int, ...]) -> None:
        """Arm and take off with these vehicles; the caller has checked that each may."""
        now = self._clock.now()
        if math.isnan(self.started_s):
            self.started_s = now
        self.run = RunPhase.STARTING
        self._flights.group_by(self._fleet.vehicles)
        for vehicle_id in vehicles:
            self._starts.begin(self._flights.by_id[vehicle_id], self._fleet.vehicles[vehicle_id])

    def hold(
        self,
        vehicles: tuple[int, ...],
        but: tuple[int, ...] = (),
        *,
        by: str = STATION,
        stays: str = HELD_BY_NAME,
        ordered: bool = True,
    ) -> tuple[VehicleResult, ...]:
        """Hold at once: these vehicles, or every vehicle of a team. A start under way is cancelled.

        Those in `but` are left out; `by` ordered it, for the journal.

        Vehicles of no team, or that cannot be commanded, are named as such in the results. Named vehicles do not go on
        when all are resumed, for the reason `stays`. With `ordered` False the station holds by itself: a vehicle that
        is flown by its own failsafe is then left to it.
        """
        now = self._clock.now()
        self.resume_found = False
        results = []
        for vehicle in self._fleet.in_order():
            flight = self._flights.get(vehicle.id)
            sent = vehicle.id in self._flights.sent and vehicle.telemetry.airborne
            concerned = sent or (
                flight is not None and (vehicle.telemetry.airborne or flight.phase is not Phase.GROUND)
            )
            left_out = vehicle.id in but or (vehicles and vehicle.id not in vehicles)
            # A named vehicle in the air that is in no team gets a result as well: that it is not ours to command.
            if left_out or not (concerned or (vehicles and vehicle.telemetry.airborne)):
                continue
            why = "is in no team: not ours to command"
            if sent and flight is None:
                results.append(self._hold_sent(vehicle, by_name=bool(vehicles), by=by))
                continue
            if flight is not None:
                why = self._firmware.of(vehicle).why_not(vehicle)
                why = why or self._why_left_to_itself(flight, vehicle, by_name=bool(vehicles))
            if flight is None or why:
                results.append(VehicleResult(vehicle=vehicle.id, ok=False, text=why))
            elif ordered or not self._firmware.of(vehicle).acts_by_itself(vehicle):
                results.append(self._enter_hold(vehicle, flight, now, ordered=ordered))
                self._commands.submit(self._steering.hold_action(vehicle, by=by, ordered=ordered))
                flight.stays = flight.stays or (stays if vehicles else "")
        if not vehicles and self.run is not RunPhase.IDLE:
            # A hold of named vehicles does not end the run of the others.
            self.run = RunPhase.HOLD
        return tuple(results)

    def _hold_sent(self, vehicle: Vehicle, *, by_name: bool, by: str) -> VehicleResult:
        """Hold a vehicle of no team that this station sent on its mission."""
        why = self._firmware.of(vehicle).why_not(vehicle) or self._why_with_pilot(vehicle, by_name=by_name)
        if why:
            return VehicleResult(vehicle=vehicle.id, ok=False, text=why)
        self._flights.sent.discard(vehicle.id)
        self._commands.cancel(vehicle.id)
        self._commands.submit(self._steering.hold_action(vehicle, by=by))
        return VehicleResult(vehicle=vehicle.id, ok=True, text="holds, is in no team")

    def may_stop_by_itself(self, vehicle: Vehicle) -> bool:
        """Whether this station holds the vehicle without an order, before it comes too close to another one.

        These are vehicles that HOLD ALL would stop and that no course of this station leads: on missions, by whatever
        station they were begun, and in motion in a mode in which set-points work. Pilots and failsafes keep their
        vehicles, and so do landings and returns.
        """
        flight, firmware = self._flights.get(vehicle.id), self._firmware.of(vehicle)
        if firmware.why_not(vehicle) or firmware.acts_by_itself(vehicle):
            return False
        if flight is None:
            sent = vehicle.id in self._flights.sent
            return sent and not self._why_with_pilot(vehicle, by_name=False)
        if self._why_left_to_itself(flight, vehicle, by_name=False):
            return False
        if flight.step is TakenOut.ON_BOARD:
            return True
        if flight.step not in (TakenOut.MODE_LEFT, TakenOut.OWN_MODE, HoldStep.FOUND):
            return False
        return not stands_still(vehicle) and (firmware.flies_mission(vehicle) or firmware.is_steerable(vehicle))

    def hold_for_separation(self, vehicle: Vehicle, stays: str) -> None:
        """Hold one vehicle before it comes too close to another; `stays` is why it does not go on with the others."""
        self.hold((vehicle.id,), stays=stays, ordered=False)

    def mode_ordered(self, vehicle: Vehicle, mode: int, stop: str = "") -> None:
        """An operator orders a mode by name; `stop` is the stop that it is, "" for other modes.

        A stop takes the vehicle from its planner at once, another mode does when its heartbeat shows it. The caller
        submits the order next.
        """
        flight, now = self._flights.get(vehicle.id), self._clock.now()
        if flight is None or flight.phase is Phase.GROUND:
            return
        if stop == HOLD or (stop and flight.phase is Phase.ARMING):
            self._enter_hold(vehicle, flight, now)
            flight.stays = flight.stays or HELD_BY_NAME
        elif stop:
            self._commands.cancel(vehicle.id)
            # In RTL it returns on a course of its own, not on its layer and to its turn.
            step = (Phase.LANDING, None) if stop == LAND else (Phase.TAKEN_OUT, TakenOut.OWN_MODE)
            flight.enter(step[0], now, step[1])
        flight.ordered_mode = mode

    def mode_refused(self, vehicle: Vehicle, mode: int) -> None:
        """A mode that was ordered was not confirmed: if the vehicle changes to it later, that is news."""
        flight = self._flights.get(vehicle.id)
        if flight is not None and flight.ordered_mode == mode:
            flight.ordered_mode = None

    def resume(self, vehicles: tuple[int, ...] = ()) -> Reply:
        """Give these vehicles, or all that hold, back to their planners; named ones also from manual control.

        Of all, those that did not fly for their team before the hold stay as they are, and are named in the results.
        """
        # A resume of all would send returning vehicles back to their planners.
        if self.run is RunPhase.RETURNING and not vehicles:
            return Reply(ok=False, text="the others are returning: resume those that hold by name")
        now = self._clock.now()
        phases = (Phase.HOLDING, Phase.BY_HAND) if vehicles else (Phase.HOLDING,)
        held = [f for f in self._flights.in_phase(*phases) if f.step is not HoldStep.START_CANCELLED]
        holding = [f for f in held if (f.vehicle in vehicles if vehicles else not f.stays)]
        text = "neither holds nor is flown by hand"
        refused = [VehicleResult(v, False, text) for v in vehicles if v not in {f.vehicle for f in holding}]
        staying = [f for f in held if f.stays and not vehicles]
        stay = [VehicleResult(f.vehicle, False, f"{f.stays}: resume it by name") for f in staying]
        if refused or not holding:
            text = "no holding vehicle flew for a planner before" if stay else "no vehicle is holding"
            return Reply(ok=False, text="not resumed" if refused else text, results=tuple(refused or stay))
        self.resume_found = False
        for flight in holding:
            self._commands.cancel(flight.vehicle, "hold")
            self._give_to_planner(flight, now)
        self.run = RunPhase.STARTING
        resumed = [VehicleResult(vehicle=f.vehicle, ok=True, text="resumes") for f in holding]
        text = f"resume: {vehicles_words(f.vehicle for f in holding)}"
        return Reply(ok=True, text=text, results=tuple(sorted([*resumed, *stay], key=lambda r: r.vehicle)))

    def go_home(
        self, vehicles: tuple[int, ...], but: tuple[int, ...] = (), *, by: str = STATION
    ) -> tuple[VehicleResult, ...]:
        """Return and land: these, or every vehicle of a team in the air. A start under way is cancelled.

        Those in `but` are left out; `by` ordered it, for the journal.
        """
        now = self._clock.now()
        self.resume_found = False
        results = []
        for flight, vehicle in self._selected(vehicles, but):
            if why := self._firmware.of(vehicle).why_not(vehicle):
                results.append(VehicleResult(vehicle=vehicle.id, ok=False, text=why))
            elif flight.phase is Phase.ARMING:
                results.append(self._hold_one(vehicle, flight, now, by=by))
            elif why := self._why_not_yet(flight, vehicle, RETURN):
                results.append(self._keep(flight, KeptOrder(RETURN, by, bool(vehicles), why)))
            else:
                results.append(self._return_one(flight, vehicle, bool(vehicles), now, by))
        if results and not vehicles:
            self.run = RunPhase.RETURNING
        return tuple(results)

    def land(
        self, vehicles: tuple[int, ...], but: tuple[int, ...] = (), *, by: str = STATION
    ) -> tuple[VehicleResult, ...]:
        """Land in place: these, or every vehicle of a team in the air. A start under way is cancelled.

        Those in `but` are left out; `by` ordered it, for the journal.
        """
        now = self._clock.now()
        self.resume_found = False
        results = []
        for flight, vehicle in self._selected(vehicles, but):
            if why := self._firmware.of(vehicle).why_not(vehicle):
                results.append(VehicleResult(vehicle=vehicle.id, ok=False, text=why))
            elif why := self._why_not_yet(flight, vehicle, LAND):
                results.append(self._keep(flight, KeptOrder(LAND, by, bool(vehicles), why)))
            else:
                results.append(self._land_one(flight, vehicle, bool(vehicles), now, by))
        if results and not vehicles and self.run is not RunPhase.IDLE:
            self.run = RunPhase.RETURNING
        return tuple(results)

    def _land_one(self, flight: Flight, vehicle: Vehicle, by_name: bool, now: float, by: str) -> VehicleResult:
        if why := self._why_left_to_itself(flight, vehicle, by_name=by_name):
            return VehicleResult(vehicle=vehicle.id, ok=False, text=why)
        if not may_be_flying(vehicle):
            if flight.phase is Phase.ARMING:
                return self._hold_one(vehicle, flight, now, by=by)
            return VehicleResult(vehicle=vehicle.id, ok=False, text="is not in the air")
        self._commands.cancel(vehicle.id)
        flight.enter(Phase.LANDING, now)
        landing = self._firmware.of(vehicle).land(vehicle)
        landing.by = by
        self._commands.submit(landing)
        return VehicleResult(vehicle=vehicle.id, ok=True, text="lands where it is")

    def _why_not_yet(self, flight: Flight, vehicle: Vehicle, what: str) -> str:
        """What keeps a vehicle in the air from being returned or landed now, and may pass; or ""."""
        if not vehicle.telemetry.airborne:
            return ""
        # Another vehicle may use this id: a return or a landing could reach that one.
        if what != HOLD and (why := vehicle.why_not_commanded):
            return f"{why}: only hold is sent"
        return "has no home" if what == RETURN and self._flights.home_m(vehicle) is None else ""

    def _keep(self, flight: Flight, order: KeptOrder) -> VehicleResult:
        flight.kept = order
        return VehicleResult(flight.vehicle, False, f"{order.why}; the {order.what} is kept until it can be done")

    def _carry_out_kept(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        """Carry out an order that waited, when nothing is in its way any more."""
        order = flight.kept
        if order is None or self._why_not_yet(flight, vehicle, order.what):
            return
        # Of one that was just heard again, or for the first time, it is not known yet whether it is in the air.
        fresh = vehicle.freshness(now) is Freshness.OK and vehicle.telemetry.airborne
        if isinstance(flight.step, Lost) and not fresh:
            return
        flight.kept = None
        carry_out = {RETURN: self._return_one, LAND: self._land_one}.get(order.what, self._hold_as_kept)
        result = carry_out(flight, vehicle, order.by_name, now, order.by)
        text = f"{order.what} that {order.by} ordered before: {result.text}"
        self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, NOTICE if result.ok else WARNING)

    def _hold_as_kept(self, flight: Flight, vehicle: Vehicle, by_name: bool, now: float, by: str) -> VehicleResult:
        """Carry out a hold that an earlier run of this station was still repeating when it was killed."""
        if why := self._firmware.of(vehicle).why_not(vehicle) or self._why_left_to_itself(
            flight, vehicle, by_name=by_name
        ):
            return VehicleResult(vehicle=vehicle.id, ok=False, text=why)
        return self._hold_one(vehicle, flight, now, by=by)

    def _why_left_to_itself(self, flight: Flight, vehicle: Vehicle, *, by_name: bool) -> str:
        """Why an order to all vehicles leaves this one out, and one by name does not; "" if the order is for it, too.

        The person with the remote control sees the vehicle, and has taken it on purpose.
        """
        if by_name:
            return ""
        if flight.step is TakenOut.EMERGENCY:
            return "is in an emergency: left out, name it"
        return self._why_with_pilot(vehicle, by_name=by_name)

    def _why_with_pilot(self, vehicle: Vehicle, *, by_name: bool) -> str:
        """Why an order to all vehicles leaves this one to the person with the remote control; "" if nobody flies it."""
        if by_name:
            return ""
        # Of two vehicles with one id, either may report the mode.
        if vehicle.telemetry.airborne and flown_by_pilot(vehicle) and not vehicle.why_not_commanded:
            mode = vehicle.mode_name
            return f"is flown by its pilot ({mode}): left to the pilot, name it to take it over"
        return ""

    def _selected(self, vehicles: tuple[int, ...], but: tuple[int, ...]) -> Iterator[tuple[Flight, Vehicle]]:
        """The flights with these ids, or (none given) of all team vehicles off the ground, without those in `but`."""
        for flight in self._flights:
            vehicle = self._fleet.vehicles.get(flight.vehicle)
            if vehicle is None or flight.vehicle in but:
                continue
            # A station that has just begun has not taken in yet what it finds in the air.
            up = flight.phase is not Phase.GROUND or vehicle.telemetry.airborne
            if flight.vehicle in vehicles if vehicles else up:
                yield flight, vehicle

    def give_up_manual_take_off(self, vehicle: Vehicle) -> None:
        """A take-off for manual control did not come about: a vehicle that is armed is disarmed."""
        flight = self._flights.get(vehicle.id)
        if flight is None or flight.phase is not Phase.ARMING or flight.step is not ArmingStep.MANUAL:
            return
        if vehicle.telemetry.armed:
            self._hold_one(vehicle, flight, self._clock.now())
        else:
            flight.enter(Phase.GROUND, self._clock.now())

    def send_home(self, vehicle_id: int, by: str) -> str:
        """Send home a vehicle that flies for its planner, as `by` wants; why it cannot return, or "".

        The station itself also sends home one that it holds; one that an operator holds stays.
        """
        flight, vehicle = self._flights.get(vehicle_id), self._fleet.vehicles.get(vehicle_id)
        held = by == STATION and flight is not None and flight.phase is Phase.HOLDING and flight.held_by_station
        if flight is None or vehicle is None or not (held or flight.phase is Phase.FLYING):
            return "is not flying for its planner"
        if why := self._firmware.of(vehicle).why_not(vehicle) or vehicle.why_not_commanded:
            return why
        result = self.return_control.begin(flight, vehicle, self._clock.now(), by)
        return "" if result.ok else result.text

    def moved(self, vehicle: Vehicle) -> None:
        """Frames with its system id come from another address now.

        Nothing is sent until that one has identified itself.
        """
        flight = self._flights.get(vehicle.id)
        if flight is not None and flight.phase is Phase.ARMING:
            self._starts.give_up(flight, "heard from another address")
        elif flight is not None and flight.phase not in (Phase.GROUND, Phase.TAKEN_OUT):
            self.losses.take_out(flight, vehicle, Lost(flight.phase), self._clock.now())
            # Stops go on: they are sent over all paths.
            self._commands.cancel(vehicle.id, keep_stops=True)

    def rebooted(self, vehicle: Vehicle) -> None:
        """Its autopilot has rebooted: a start under way is over."""
        flight = self._flights.get(vehicle.id)
        if flight is not None and flight.phase is Phase.ARMING:
            self._starts.give_up(flight, "rebooted")

    def tick(self) -> None:
        """Move every flight on by what telemetry shows."""
        now = self._clock.now()
        # Vehicles that are heard later may have been taken over by a pilot meanwhile.
        if now - self._born_s > RESUME_WITHIN_S:
            self.resume_found = False
        for flight in self._flights:
            vehicle = self._fleet.vehicles.get(flight.vehicle)
            if vehicle is not None:
                self._follow(flight, vehicle, now)
        self.return_control.land_in_turn(now)
        self._follow_run()

    def _follow(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        self._carry_out_kept(flight, vehicle, now)
        if flight.phase is Phase.ARMING:
            if vehicle.freshness(now) is Freshness.LOST:
                text = "not started: not heard any more"
                self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, ALERT)
                self.losses.check(flight, vehicle, now)
            else:
                self._starts.follow_arming(flight, vehicle, now)
        # The heartbeat before the change of phase may still be the newest.
        elif flight.phase in IN_THE_AIR and not vehicle.telemetry.armed and now - flight.since_s > 1.0:
            self._touch_down(flight, vehicle, now)
        elif flight.phase is Phase.GROUND:
            self._find_in_the_air(flight, vehicle, now)
        elif flight.phase is Phase.TAKEN_OUT:
            self._take_back(flight, vehicle, now)
            self.losses.watch_taken_out(flight, vehicle, now)
        elif flight.phase in IN_THE_AIR:
            if self.losses.check(flight, vehicle, now):
                return
            left_ground = flight.step is HoldStep.START_CANCELLED and vehicle.telemetry.airborne
            if left_ground or (flight.step is HoldStep.TOUCHED_DOWN and not is_down(vehicle)):
                flight.step = None  # it had left the ground already: a hold like any other
            if flight.phase is Phase.TAKEOFF:
                if self._starts.follow_climb(flight, vehicle, now):
                    self._hold_without_run(now)
            elif flight.phase is Phase.RETURNING:
                self.return_control.follow(flight, vehicle, now)

    def _follow_run(self) -> None:
        """Set the run's phase by the phases of its flights."""
        if self.run is RunPhase.STARTING:
            climbing = {flight.group for flight in self._flights.in_phase(Phase.ARMING, Phase.TAKEOFF)}
            for flight in self._flights.in_phase(Phase.HOLDING):
                if flight.step is HoldStep.READY and flight.group not in climbing:
                    flight.enter(Phase.FLYING, self._clock.now())
            if not climbing:
                self.run = RunPhase.RUNNING if self._flights.in_phase(Phase.FLYING) else RunPhase.HOLD
        if self.run is not RunPhase.IDLE and not self._flights.any_in_the_air():
            self.run = RunPhase.IDLE
            self._events.report(EventClass.MISSION, "station", "all landed and disarmed", NOTICE)

    def _end_start(self, vehicle: Vehicle, flight: Flight) -> None:
        self._hold_one(vehicle, flight, self._clock.now())

    def _hold_one(self, vehicle: Vehicle, flight: Flight, now: float, *, by: str = STATION) -> VehicleResult:
        result = self._enter_hold(vehicle, flight, now)
        self._commands.submit(self._steering.hold_action(vehicle, by=by))
        return result

    def _enter_hold(self, vehicle: Vehicle, flight: Flight, now: float, *, ordered: bool = True) -> VehicleResult:
        """Cancel what the vehicle does, and change its phase; its hold is to be submitted next."""
        self._commands.cancel(vehicle.id)
        flight.stays = flight.own_activity()
        starting = flight.phase is Phase.ARMING or flight.step is HoldStep.START_CANCELLED
        landing = flight.phase is Phase.LANDING or flight.step is HoldStep.TOUCHED_DOWN
        step, text = None, "holds"
        if starting and not vehicle.telemetry.airborne:
            step, text = HoldStep.START_CANCELLED, "start cancelled"
        elif landing and is_down(vehicle):
            step, text = HoldStep.TOUCHED_DOWN, "has touched down"
        flight.enter(Phase.HOLDING, now, step)
        flight.held_by_station = not ordered
        return VehicleResult(vehicle=vehicle.id, ok=True, text=text)

    def _give_to_planner(self, flight: Flight, now: float) -> None:
        """From a hold back to the planner: up or down to its own layer, then ready."""
        vehicle = self._fleet.vehicles[flight.vehicle]
        self._engage(vehicle)
        flight.enter(Phase.TAKEOFF, now)
        x, y, _ = self._steering.stop_place(vehicle)
        flight.course = PositionTarget((x, y, flight.layer_m), self.return_control.speed_m_s)

    def _engage(self, vehicle: Vehicle) -> None:
        """Put it into the mode in which it takes set-points, if it is not there."""
        if (order := self._firmware.of(vehicle).engage(vehicle)) is not None:
            self._commands.submit(order)

    def _take_back(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        """A lost vehicle is heard again: carry out what `VehicleLossController.comeback` decides."""
        comeback = self.losses.comeback(flight, vehicle, self.run, self.resume_found)
        if comeback is None:
            return
        kept, text, severity = flight.kept, "", WARNING
        if comeback is Comeback.LANDS:
            flight.enter(Phase.LANDING, now)
        elif comeback is Comeback.RETURNS:
            self._return_one(flight, vehicle, True, now, flight.ordered_by)
        elif comeback is Comeback.RESUMES:
            self._give_to_planner(flight, now)
            self.run = RunPhase.STARTING
            text = "found in the air: goes on, as the scenario allows"
        elif comeback is Comeback.REJOINS:
            flight.enter(Phase.FLYING, now)
            text, severity = "is back in its team", NOTICE
        else:
            text = self._hold_again(flight, vehicle, comeback, now)
        if text:
            self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, severity)
        flight.kept = kept  # it was ordered after what the vehicle did before

    def _hold_again(self, flight: Flight, vehicle: Vehicle, comeback: Comeback, now: float) -> str:
        """Hold a vehicle that is back, if it can be steered, and leave one that was found as it is; the event text."""
        flight.stays = flight.own_activity()
        if comeback is Comeback.FOUND:
            flight.enter(Phase.HOLDING, now, HoldStep.FOUND)
            return "found in the air: nothing is sent to it until resume or return"
        flight.enter(Phase.HOLDING, now)
        if self._firmware.of(vehicle).is_steerable(vehicle) and not self._commands.stopping(vehicle.id):
            self._steering.hold(vehicle)
        return "is back and holds: resume to take it in again"

    def _find_in_the_air(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        """Take in a vehicle in the air that this station did not start, as one that was lost; see `_take_back`."""
        if vehicle.telemetry.airborne and vehicle.freshness(now) is Freshness.OK:
            self.remember_flying(flight)

    def remember_flying(self, flight: Flight, *, on_mission: bool = False) -> None:
        """The vehicle was in the air before this station began (it was restarted): nothing is sent to it.

        One that this station had sent on its mission is watched there as before.
        """
        now = self._clock.now()
        flight.enter(Phase.TAKEN_OUT, now, TakenOut.ON_BOARD if on_mission else Lost(None))
        self._hold_without_run(now)

    def _hold_without_run(self, now: float) -> None:
        """A vehicle is in the air without any start of this run: the run holds, to be resumed or returned."""
        if self.run is RunPhase.IDLE:
            self.run = RunPhase.HOLD
            if math.isnan(self.started_s):
                self.started_s = now

    def _touch_down(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        text, expected = landing_words(flight, vehicle)
        if falls(flight, vehicle):
            vehicle.reboot_first = f"fell from {vehicle.telemetry.alt_rel_m:.0f} m"
        self._commands.cancel(vehicle.id)
        self._firmware.of(vehicle).release(vehicle)
        flight.enter(Phase.GROUND, now)
        self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, INFO if expected else ALERT)

    def _return_one(self, flight: Flight, vehicle: Vehicle, by_name: bool, now: float, by: str) -> VehicleResult:
        if flight.phase is Phase.LANDING:
            return VehicleResult(vehicle=vehicle.id, ok=True, text="is landing already")
        if flight.phase is Phase.RETURNING and not by_name:
            return VehicleResult(vehicle=vehicle.id, ok=True, text="is returning already")
        if not by_name:
            firmware, taken_out = self._firmware.of(vehicle), flight.phase is Phase.TAKEN_OUT
            lost = taken_out and isinstance(flight.step, Lost)
            why = self._why_left_to_itself(flight, vehicle, by_name=by_name)
            if lost and not why:
                flight.step, flight.ordered_by = Lost(Phase.RETURNING), by  # see `_take_back`
                why = "is lost: returns when it is heard again"
            if taken_out and (firmware.acts_by_itself(vehicle) or firmware.is_landing(vehicle)):
                why = why or "its own failsafe or its landing brings it down: not returned"
            if why:
                return VehicleResult(vehicle=vehicle.id, ok=False, text=why)
        return self.return_control.begin(flight, vehicle, now, by)
