"""Finds everything that is wrong now with the fleet and the station, for the alarm table; it sends nothing.

Limits have a dead-band: a finding ends only when its value is clearly better. Only vehicles that fly or are armed have
findings; what keeps vehicles on the ground is in `StationStatus.not_ready`.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tui_gcs.core.alarms.alarm_table import AlarmFinding
from tui_gcs.core.alarms.causes import WHEN_ON_ITS_WAY
from tui_gcs.core.alarms.vehicle_findings import VehicleAlarmMonitor
from tui_gcs.core.firmware.base import stands_still
from tui_gcs.core.firmware.foreign_command_policy import comes_down_by
from tui_gcs.core.firmware.health import Concern, HealthProblem
from tui_gcs.core.fleet.integrity.position_jump_monitor import MIN_JUMP_M
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.fleet_monitor import error_m
from tui_gcs.core.flight.flights import Flight, HoldStep, TakenOut
from tui_gcs.core.guard.conflict_prediction import PredictedConflict, predicted_conflicts
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import Freshness, JournalEvent, Phase, RunPhase
from tui_gcs.core.records.event_log import WARNING
from tui_gcs.core.services.up_ways import HEARD_S
from tui_gcs.core.station.assembly import StationParts

OUTSIDE_M, OUTSIDE_BAND_M = 2.0, 1.5
"""Metres outside the area. A loop around a corner is no breach: `limits.geofence_margin_m` keeps it inside already."""
TRAFFIC_M, TRAFFIC_UP_M, TRAFFIC_AGE_S = 1500.0, 300.0, 15.0
"""An aircraft is reported if it is nearer than this, on the map and in height, and was received no longer ago."""
BESIDE_M, LATE_S, BESIDE_BAND = 2.0, 1.0, 0.3
"""Beside its slot's way, and early or late: good vehicles stay within 1.1 m and 0.3 s, on bad links too."""
HEALTH_ROUND_S = 1.0
"""Every flying vehicle's own checks are read once in this time, a part of the fleet at each look: they are many."""
CLOSING_GAP_S = 0.5
SETTLES_S = 5.0
"""A station that has just begun has not heard all vehicles yet, and does not know what they do."""
FAILED = ("dead", "quarantined", "late")
VEHICLES_AT_ONCE = 50
"""Vehicles that are looked at in one go: with 250 a stop waited for up to 30 ms of CPU time."""
MOVES_ACTION = "[hold_all] hold all, or take it over by radio"
"""Advice for a vehicle that was told to brake and moves all the same."""
_DOWN = {Phase.RETURNING: "return", Phase.LANDING: "land"}
_ON_ITS_WAY = {"return": "returning", "land": "landing"}
"""What a vehicle with a low battery is asked to do is being done."""


class AlarmFinder:
    """Looks through all parts of the station; what takes long is done for a part of the fleet each time."""

    def __init__(self, parts: StationParts) -> None:
        self._parts = parts
        self._monitor = VehicleAlarmMonitor(parts.alarms)
        self._next_closing_s = -math.inf
        self._meetings: list[AlarmFinding] = []
        self._settled_s = parts.records.clock.now() + SETTLES_S
        self._health: dict[int, dict[Concern, HealthProblem]] = {}
        """By vehicle, its worst problem of each concern."""
        self._next_health = 0
        self._spoke: set[str] = set()
        """Sources of events with bad news since their checks were read last, e.g. "vehicle 3": they are read next."""
        self.in_doubt: dict[int, str] = {}
        """Flying vehicles that doubt their own position or height, and their reason, as `findings` found it last."""

    def on_event(self, event: JournalEvent) -> None:
        """Read the vehicle's own checks next: its telemetry may describe the same trouble better."""
        if event.severity <= WARNING:
            self._spoke.add(event.source)

    def findings(self, gap_s: float) -> Iterator[list[AlarmFinding]]:
        """All that is wrong now, in pieces between which requests may be answered; begun every `gap_s` seconds."""
        parts = self._parts
        now = parts.records.clock.now()
        vehicles = parts.picture.fleet.in_order()
        flying = [vehicle for vehicle in vehicles if vehicle.telemetry.airborne]
        self._look_at_health(flying, gap_s)
        yield [*self._absent(), *self._silence(vehicles, now)]
        self.in_doubt = {}
        for first in range(0, len(vehicles), VEHICLES_AT_ONCE):
            few = vehicles[first : first + VEHICLES_AT_ONCE]
            yield [finding for vehicle in few for finding in self._vehicle(vehicle, now)]
        yield [*self._outside(flying), *self._close()]
        yield [*self._unreached(vehicles)]
        yield [*self._closing(now)]
        yield [*self._traffic(flying, now)]
        yield [*self._stops(), *self._kept(), *self._teams(), *self._held(), *self._machines()]

    def _absent(self) -> Iterator[AlarmFinding]:
        """Vehicles that an earlier run of this station last heard in the air, and that were never heard since."""
        # Right after a restart no vehicle has been heard yet: without the wait each restart would report all of them as
        # lost.
        if self._parts.records.clock.now() < self._settled_s:
            return
        for flight in self._parts.flight.flights:
            if flight.phase is not Phase.GROUND and flight.vehicle not in self._parts.picture.fleet.vehicles:
                yield AlarmFinding("lost", flight.vehicle)

    def _silence(self, vehicles: list[Vehicle], now: float) -> Iterator[AlarmFinding]:
        """One finding if all vehicles are silent and none of them is in flight."""
        known = [vehicle for vehicle in vehicles if vehicle.identity.confirmed]
        if not known or any(vehicle.freshness(now) is not Freshness.LOST for vehicle in known):
            return
        # Vehicles in flight are reported as lost one by one; on the ground one line for all of them is enough.
        if not any(self._in_flight(vehicle) for vehicle in known):
            count = len(known)
            yield AlarmFinding(
                "silence", "station", "the one vehicle is LOST" if count == 1 else f"all {count} are LOST"
            )

    def _unreached(self, vehicles: list[Vehicle]) -> Iterator[AlarmFinding]:
        """Vehicles that are heard over links on which nothing that is sent to them arrives."""
        now = self._parts.records.clock.now()
        for vehicle in vehicles:
            dead = self._parts.services.link_timing.dead_up_ways(vehicle)
            if not dead:
                continue
            heard = [path for path in vehicle.used_paths() if now - path.last_heard_s <= HEARD_S]
            cause = "unreached" if len(dead) == len(heard) else "up-way"
            links = sorted({path.source.link for path in dead})
            yield AlarmFinding(cause, vehicle.id, f"over {', '.join(links)}")

    def _in_flight(self, vehicle: Vehicle) -> bool:
        flight = self._parts.flight.flights.get(vehicle.id)
        return vehicle.telemetry.armed or (flight is not None and flight.phase is not Phase.GROUND)

    def _vehicle(self, vehicle: Vehicle, now: float) -> Iterator[AlarmFinding]:
        flight = self._parts.flight.flights.get(vehicle.id)
        in_flight = self._in_flight(vehicle)
        link = self._parts.comms.links.get(vehicle.link)
        # A failed link of ours is another alarm than a vehicle that went silent: the operator mends the link.
        failed = vehicle.link if link is not None and link.error and len(vehicle.used_paths()) <= 1 else ""
        does = _does(vehicle, flight)
        for finding in self._monitor.findings(vehicle, now, in_flight=in_flight, failed_link=failed):
            yield _fitting(self._with_doubt(finding), does)
        if not in_flight:
            return
        if emergency := self._parts.flight.emergencies.found.get(vehicle.id):
            yield AlarmFinding(emergency.kind, vehicle.id, emergency.text)
        if vehicle.telemetry.airborne:
            yield from (_fitting(self._with_doubt(finding), does) for finding in self._own_checks(vehicle))
            # The jump stays an alarm until it has jumped back: it may be that far from where the map shows it.
            if (off_m := math.hypot(*self._parts.picture.jump_monitor.off(vehicle.id)[:2])) > MIN_JUMP_M:
                yield AlarmFinding("position", vehicle.id, f"it jumped by {off_m:.0f} m")
            if text := self._height(vehicle.id):
                yield self._with_doubt(AlarmFinding("height", vehicle.id, text))
        # What the operator ordered is no surprise: a mission or mode, or motors that were stopped. This comes after
        # its own checks, because its words say more of a fence than those.
        ordered = (TakenOut.ON_BOARD, TakenOut.OWN_MODE, TakenOut.MOTORS_STOPPED)
        has_left = flight is not None and flight.phase is Phase.TAKEN_OUT and flight.step not in ordered
        if flight is not None and has_left and now >= self._settled_s:
            mode = vehicle.mode_name
            cause = "fence" if "fence" in flight.left_reason.lower() else "left"
            yield AlarmFinding(cause, vehicle.id, f"{mode}: {flight.left_reason}" if flight.left_reason else mode)
        elif strays := self._parts.flight.courses.found.get(vehicle.id):
            stations = self._parts.picture.fleet.other_stations.words(vehicle, now)
            action = "another station commands it: agree with that, or [hold_all] hold all" if stations else ""
            yield AlarmFinding("left", vehicle.id, f"{strays}; {stations}" if stations else strays, action)
        if flight is not None and flight.vetoed:
            # The brake takes some seconds, less than the delay of this alarm.
            moves = "" if stands_still(vehicle) else f"it does NOT hold: {MOVES_ACTION}"
            yield AlarmFinding("vetoed", vehicle.id, flight.vetoed, moves)
        if flight is not None and flight.phase is Phase.FLYING and not flight.vetoed:
            yield from self._beside(flight, vehicle, now)

    def _height(self, vehicle: int) -> str:
        """How its height may be wrong; "" if nothing suggests that."""
        if off_m := self._parts.picture.altitude_monitor.off_m(vehicle):
            return f"by its GPS it is {abs(off_m):.0f} m {'lower' if off_m > 0.0 else 'higher'} than it reports"
        up_m = self._parts.picture.jump_monitor.off(vehicle)[2]
        if abs(up_m) <= MIN_JUMP_M:
            return ""
        way, other = ("up", "lower") if up_m > 0.0 else ("down", "higher")
        return f"it jumped {way} by {abs(up_m):.0f} m: it may be so much {other} than it reports"

    def _with_doubt(self, finding: AlarmFinding) -> AlarmFinding:
        if finding.cause in ("position", "height") and isinstance(finding.subject, int):
            self.in_doubt[finding.subject] = finding.text
        return finding

    def _beside(self, flight: Flight, vehicle: Vehicle, now: float) -> Iterator[AlarmFinding]:
        """A vehicle that is not where its plan, and so every other part, believes it to be.

        A vehicle that cannot fly as fast as it is asked never gets to its slot: its planner leads it on from where it
        is.
        """
        tracking, results = flight.tracking, self._parts.active.scenario.results
        if tracking is None:
            return
        # A slow link makes every vehicle late, but by less than `LATE_S`.
        moves = math.isfinite(tracking.cross_m) and math.isfinite(tracking.lag_s)
        beside_m, late_s = (tracking.cross_m, abs(tracking.lag_s)) if moves else (0.0, 0.0)
        beside, late = beside_m / max(BESIDE_M, results.slot_error_max_m), late_s / max(LATE_S, results.slot_lag_max_s)
        if flight.joined and self._monitor.beyond("beside", vehicle, max(beside, late), 1.0, BESIDE_BAND):
            when = "late" if tracking.lag_s > 0.0 else "early"
            text = f"{beside_m:.0f} m beside its way" if beside >= late else f"{late_s:.1f} s {when}"
            yield AlarmFinding("beside", vehicle.id, text)
        elif tracking.crawls(now):
            text = f"flies {max(0.0, tracking.made_m_s):.0f} of {tracking.asked_m_s:.0f} m/s"
            yield AlarmFinding("beside", vehicle.id, text)

    def _own_checks(self, vehicle: Vehicle) -> Iterator[AlarmFinding]:
        """Problems of its own checks that would keep it on the ground."""
        charge = "" if math.isnan(vehicle.telemetry.battery_pct) else f"{vehicle.telemetry.battery_pct:.0f} %"
        for concern, problem in self._health.get(vehicle.id, {}).items():
            text = charge if charge and problem.is_charge else problem.text
            yield AlarmFinding(_CAUSES[concern], vehicle.id, text)

    def _look_at_health(self, flying: list[Vehicle], gap_s: float) -> None:
        ids = {vehicle.id for vehicle in flying}
        self._health = {i: problems for i, problems in self._health.items() if i in ids}
        due = [vehicle for vehicle in flying if f"vehicle {vehicle.id}" in self._spoke] if self._spoke else []
        self._spoke.clear()
        # Each vehicle has many checks of its own, so each look takes its share of the
        # fleet.
        for _ in range(min(len(flying), int(len(flying) * gap_s / HEALTH_ROUND_S) + 1)):
            self._next_health = (self._next_health + 1) % len(flying)
            due.append(flying[self._next_health])
        for vehicle in due:
            found = self._parts.services.health.in_flight(vehicle)
            self._health[vehicle.id] = dict(reversed(found))  # of each concern the first counts

    def _outside(self, flying: list[Vehicle]) -> Iterator[AlarmFinding]:
        placed = [vehicle for vehicle in flying if vehicle.telemetry.has_position()]
        if not placed:
            return
        # One call for the whole fleet is much cheaper than one for each vehicle.
        outside_m = self._parts.flight.guard.outside_walls_m(
            np.array([vehicle.telemetry.position_m for vehicle in placed])
        )
        for vehicle, far_m in zip(placed, outside_m.tolist(), strict=True):
            if self._monitor.beyond("outside", vehicle, far_m, OUTSIDE_M, OUTSIDE_BAND_M):
                yield AlarmFinding("outside", vehicle.id, f"by {max(1.0, far_m):.0f} m")

    def _close(self) -> Iterator[AlarmFinding]:
        nearest: dict[int, tuple[float, int]] = {}
        for (one, other), level_m in self._parts.flight.monitor.take_close().items():
            # Both get the alarm: the operator may select either of them.
            for vehicle, partner in ((one, other), (other, one)):
                nearest[vehicle] = min(nearest.get(vehicle, (level_m, partner)), (level_m, partner))
        known = self._parts.picture.fleet.vehicles
        for vehicle, (level_m, partner) in nearest.items():
            doubt_m = sum(error_m(known[each]) for each in (vehicle, partner) if each in known)
            doubt = f", known to ±{doubt_m:.0f} m only" if doubt_m > 0.0 else ""
            yield AlarmFinding("separation", vehicle, f"{level_m:.0f} m from {vehicles_words([partner])}{doubt}")

    def _closing(self, now: float) -> Iterator[AlarmFinding]:
        """Predicted conflicts, found for the whole fleet every half second and reported until the next time."""
        if now >= self._next_closing_s:
            self._next_closing_s = now + CLOSING_GAP_S
            flight = self._parts.flight
            found = sorted(predicted_conflicts(flight.steering.known(now), flight.guard.limits, now), key=_soonest)
            pairs = [(pair, a, b) for pair in found for a, b in ((pair.one, pair.other), (pair.other, pair.one))]
            # Reversed, so that of several conflicts of a vehicle the soonest stays.
            first = {vehicle: (pair, other) for pair, vehicle, other in reversed(pairs)}
            self._meetings = [
                AlarmFinding(
                    "closing", vehicle, f"{pair.level_m:.0f} m from {vehicles_words([other])} in {pair.in_s:.0f} s"
                )
                for vehicle, (pair, other) in sorted(first.items())
            ]
        yield from self._meetings

    def _traffic(self, flying: list[Vehicle], now: float) -> Iterator[AlarmFinding]:
        """Aircraft nearby. Heights count above mean sea level; an aircraft without one counts as being at ours."""
        tracks = [t for t in self._parts.services.traffic.tracks() if now - t.seen_s < TRAFFIC_AGE_S]
        placed = [vehicle for vehicle in flying if vehicle.telemetry.has_position()]
        if not tracks or not placed:
            return
        ours = np.array([(*vehicle.telemetry.position_m[:2], vehicle.telemetry.alt_amsl_m) for vehicle in placed])
        theirs = np.array([track.position_m for track in tracks])
        apart = ours[:, None, :] - theirs[None, :, :]
        level_m = np.hypot(apart[..., 0], apart[..., 1])
        # Written as "not far", so that an unknown height (NaN) counts as near.
        near = (level_m < TRAFFIC_M) & ~(np.abs(apart[..., 2]) > TRAFFIC_UP_M)
        for row, vehicle in enumerate(placed):
            if near[row].any():
                column = int(np.where(near[row], level_m[row], np.inf).argmin())
                track = tracks[column]
                name = track.callsign or f"{track.icao:06X}"
                yield AlarmFinding("traffic", vehicle.id, f"{name} at {level_m[row, column] / 1000:.1f} km")

    def _stops(self) -> Iterator[AlarmFinding]:
        for vehicle, name in self._parts.comms.commands.unconfirmed_stops():
            yield AlarmFinding("stop", vehicle, name)

    def _teams(self) -> Iterator[AlarmFinding]:
        for name, controller in self._parts.active.team_controllers.items():
            state = controller.worker_state()
            phases = {flight.phase for flight in self._parts.flight.flights if flight.team == name}
            if controller.planner.is_starved and phases & {Phase.FLYING, Phase.HOLDING}:
                yield AlarmFinding("busy", "station", "planners get no CPU time")
                continue
            # Nothing of a planner is urgent while none of its vehicles depends on it.
            if state not in FAILED or not phases & {Phase.FLYING, Phase.HOLDING}:
                continue
            if state == "quarantined":
                yield AlarmFinding("planner-failed", name, f"{controller.team.planner}: {controller.planner.error}")
            elif state == "late" and Phase.FLYING in phases:
                yield AlarmFinding("planner-late", name, f"{controller.team.planner} is late")
            else:
                yield AlarmFinding("planner", name, f"{controller.team.planner} is {state}")

    def _kept(self) -> Iterator[AlarmFinding]:
        for flight in self._parts.flight.flights:
            if flight.kept is not None:
                yield AlarmFinding("kept", flight.vehicle, f"{flight.kept.what}: {flight.kept.why}")

    def _held(self) -> Iterator[AlarmFinding]:
        run = self._parts.flight.executive.run
        held: list[Flight] = self._parts.flight.flights.in_phase(Phase.HOLDING)
        if run in (RunPhase.RUNNING, RunPhase.RETURNING):
            for flight in held:
                by_name = run is RunPhase.RETURNING or flight.stays  # who does not go on when all are resumed
                yield AlarmFinding("stays" if by_name else "holds", flight.vehicle)
        elif run is RunPhase.HOLD:
            for flight in held:
                if flight.step is HoldStep.FOUND:
                    # A resume flies to the zones of this round, whichever round they flew before.
                    yield AlarmFinding("found", flight.vehicle, f"now {self._parts.active.round.name}")
                else:
                    yield AlarmFinding("hold", flight.vehicle)

    def _machines(self) -> Iterator[AlarmFinding]:
        parts = self._parts
        if parts.conditions.memory_lost:
            yield AlarmFinding("memory", "station", parts.conditions.memory_lost)
        if parts.conditions.orphaned:
            yield AlarmFinding("supervisor", "station")
        # Three files on one disk: whichever fails first, the flight cannot be reconstructed any more.
        for error in (parts.records.recorder.error, parts.records.journal.error, parts.conditions.memory_error):
            if error:
                yield AlarmFinding("recording", "station", error)
        for name, link in parts.comms.links.items():
            # What an operator has closed needs no operator.
            if link.error and not link.is_closed:
                yield AlarmFinding("link", name, link.error)
        for port in parts.comms.forwarder.ports:
            if port.link.error and not port.is_closed:
                yield AlarmFinding("forward", port.link.name, port.link.error)


def _does(vehicle: Vehicle, flight: Flight | None) -> str:
    """What brings it down, an order or a failsafe: "return" or "land"; "" if nothing does."""
    if flight is not None and flight.phase in _DOWN:
        return _DOWN[flight.phase]
    return comes_down_by(vehicle)


def _fitting(finding: AlarmFinding, does: str) -> AlarmFinding:
    """The finding as it is shown of a vehicle that is on its way down: no advice to order that again."""
    actions = WHEN_ON_ITS_WAY.get(finding.cause, {})
    if does not in actions:
        return finding
    text = f"{finding.text}, {_ON_ITS_WAY[does]}" if finding.text else _ON_ITS_WAY[does]
    return replace(finding, text=text, action=actions[does])


def _soonest(closing: PredictedConflict) -> float:
    return closing.in_s


_CAUSES: dict[Concern, str] = {
    "position": "position",
    "height": "height",
    "battery": "battery-critical",
    "battery-low": "battery-low",
    "health": "health",
    "fence": "fence",
}
