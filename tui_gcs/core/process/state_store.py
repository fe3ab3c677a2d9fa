"""The state store: what a station must know again after `kill -9`, in one small JSON file.

It holds the scenario, round, teams, homes and answered alarms; which vehicles fly missions that this station began, and
orders that wait or are not confirmed yet; vehicles that must be rebooted or whose position jumped;
what was acknowledged before the start, which plans on board are ours, what planners learnt, and what was being changed
on vehicles. A restarted station shows the whole picture and sends no set-point: vehicles found in the air are holding.
"""

import base64
import binascii
import json
import logging
import math
import time
from pathlib import Path
from typing import Any

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.flight.executive import HOLD, LAND, RETURN
from tui_gcs.core.flight.flights import IN_THE_AIR, Flight, KeptOrder, Lost, TakenOut
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol.common import EventClass, Phase, RunPhase
from tui_gcs.core.protocol.plan_limits import MAX_LEARNT_BYTES
from tui_gcs.core.records.event_log import ALERT, WARNING
from tui_gcs.core.services.plans.plan_jobs import PlanJob
from tui_gcs.core.station.assembly import StationParts
from tui_gcs.core.station.frontend_protocol import StationFrontend

log = logging.getLogger("tui_gcs.station")

RETRY_S = 2.0
"""After a failed write the next try comes this much later."""
MAX_FLIGHT_S = 6 * 3600.0
"""What a killed station left longer ago than this is of no flight that still goes on."""
REQUIRED_KEYS = frozenset({"toml", "run", "round_index", "revision", "task_revision", "started_s", "flights"})
"""Keys without which a state file is not one of this version; later ones are optional."""


class StateStore:
    """One JSON file, replaced atomically when something in it changes."""

    def __init__(self, path: Path) -> None:
        """Read `path` if it exists; a file that cannot be read counts as lost, see `lost`."""
        self._path = path
        self._written = b""
        self._retry_s = -math.inf
        self._held: dict[str, Any] = {}
        self._continued = False
        self.lost = ""
        """Why the state of the previous run is not known although there was one; "" otherwise."""
        try:
            held = json.loads(path.read_text())
            # Later keys are optional, so that a newer station can take over a flight from an older one.
            if isinstance(held, dict) and held.keys() >= REQUIRED_KEYS:
                self._held = held
            else:
                self.forget("it is not this version's")
        except FileNotFoundError:
            pass
        except (OSError, ValueError) as error:
            self.forget(f"it cannot be read: {error}")

    def take_over(self, earlier: Path, toml: str) -> None:
        """Go on with what another station left at `earlier`: one that was killed together with its supervisor.

        Its fleet flew round 2 while the next station was in round 1, and a resume flew there. It is continued if
        vehicles were in the air and `toml` is the scenario that they flew; under another scenario that is reported.
        """
        if self._held or self.lost or not earlier.exists():
            return
        before = StateStore(earlier)
        flights = before._held.get("flights", [])
        if before.lost:
            self.forget(f"a station was killed, and what it left {before.lost.removeprefix('it ')}")
        elif not any(isinstance(flight, dict) and flight.get("in_the_air") for flight in flights):
            return
        elif time.time() - earlier.stat().st_mtime > MAX_FLIGHT_S:
            log.warning("%s is too old to be continued", earlier)
        elif before.toml != toml:
            self.forget("vehicles were in the air under another scenario than this, whose first round it is now")
        else:
            self._held, self._continued = before._held, True
            if time.time() - earlier.stat().st_mtime > time.monotonic():  # times of before the computer started
                self._held |= {"started_s": None, "jumps": [], "heights": {}, "reboots": {}}

    def forget(self, why: str) -> None:
        """Discard what was read; `recall` reports the loss to the station."""
        log.error("memory of the last run is lost: %s", why)
        self._held, self.lost = {}, why

    @property
    def toml(self) -> str:
        """The scenario text that was flown last; "" if nothing is stored."""
        return str(self._held.get("toml", ""))

    def recall(self, parts: StationParts, frontend: StationFrontend) -> None:
        """Put the stored state into a fresh station, and report there if it is lost."""
        try:
            if self._held:
                self._recall(parts, frontend)
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            self.forget(f"it is damaged: {type(error).__name__} {error}")
        parts.conditions.memory_lost = self.lost
        if self._continued and not self.lost:
            text = f"goes on where a station ended that was killed: in {parts.active.round.name}"
            parts.records.events.report(EventClass.MISSION, "station", text, WARNING)

    def _recall(self, parts: StationParts, frontend: StationFrontend) -> None:
        active, executive = parts.active, parts.flight.executive
        for item in self._held["flights"]:
            home = item["home_m"]
            flight = Flight(item["vehicle"], item["team"], item["layer_m"], home_m=tuple(home) if home else None)
            # A vehicle that did not go on with the others must not do so after a restart either.
            flight.stays = str(item.get("stays", ""))
            parts.flight.flights.by_id[flight.vehicle] = flight
            if item["in_the_air"]:
                executive.remember_flying(flight, on_mission=bool(item.get("on_mission")))
                kept = item.get("kept")
                flight.kept = msgspec.convert(kept, KeptOrder) if kept is not None else None
        for vehicle in self._held.get("sent", []):
            parts.flight.courses.watch_mission(int(vehicle), parts.records.clock.now())
        executive.started_s = self._held["started_s"] or math.nan
        was_running = self._held["run"] in (RunPhase.RUNNING, RunPhase.STARTING)
        # Only a fleet that was running goes on by itself, and only if the scenario asks for it.
        executive.resume_found = was_running and active.scenario.link_loss.resume
        active.revision = self._held["revision"]
        active.task_revision = self._held["task_revision"]
        active.set_round(min(self._held["round_index"], len(active.scenario.rounds) - 1))
        parts.alarms.recall(self._held.get("alarms", {}))
        parts.picture.reboots.recall(self._held.get("reboots", {}))
        parts.picture.jump_monitor.recall(self._held.get("jumps", []))
        parts.picture.altitude_monitor.recall(self._held.get("heights", {}))
        parts.flight.points.recall(self._held.get("points", {}))
        frontend.recall_checks(self._held.get("acknowledged", []))
        parts.services.missions.registry.recall(self._held.get("plans", []))
        learnt = self._held.get("learnt")
        for name, controller in active.team_controllers.items():
            controller.learnt = _learnt_bytes(learnt.get(name)) if isinstance(learnt, dict) else b""
        self._report_changes(parts)

    def _report_changes(self, parts: StationParts) -> None:
        """Report what the end of the previous run cut short: a vehicle may hold a part that looks like a whole."""
        for vehicle, kind in self._held.get("changing", []):
            parts.services.missions.registry.cut_short(int(vehicle), PlanKind(kind))
        for vehicle, what in self._held.get("unfinished", []):
            text = f"{clean(what, 80)}: cut short when the station ended, it may hold a part: look, do it again"
            parts.records.events.report(EventClass.MISSION, f"vehicle {int(vehicle)}", text, ALERT)

    def remember(self, parts: StationParts, frontend: StationFrontend) -> None:
        """Write the state if it has changed since it was written last."""
        conditions = parts.conditions
        if parts.flight.executive.run in (RunPhase.STARTING, RunPhase.RUNNING):
            conditions.memory_lost = ""  # an operator has decided how to go on
        state = _state(parts, frontend)
        # Asked at every tick, and nearly always nothing has changed: encoded like this it takes a sixth of the time.
        # What is written may hold NaN, which this turns into null.
        encoded = msgspec.json.encode(state)
        now = parts.records.clock.now()
        if encoded == self._written or now < self._retry_s:
            return
        new = self._path.with_suffix(".new")
        try:
            # Written beside and renamed: a `kill -9` in the middle leaves the old file whole.
            new.write_text(json.dumps(state))
            new.replace(self._path)
        except OSError as error:
            if not conditions.memory_error:
                log.error("memory of this run cannot be written: %s", error)
            self._retry_s, conditions.memory_error = now + RETRY_S, f"{new}: {error.strerror}"
        else:
            self._written, conditions.memory_error = encoded, ""


def _state(parts: StationParts, frontend: StationFrontend) -> dict[str, Any]:
    active, started_s = parts.active, parts.flight.executive.started_s
    return {
        "toml": active.toml,
        "run": parts.flight.executive.run,
        "round_index": active.round_index,
        "revision": active.revision,
        "task_revision": active.task_revision,
        "started_s": None if math.isnan(started_s) else started_s,
        "points": parts.flight.points.memory(),
        "flights": [
            {
                "vehicle": f.vehicle,
                "team": f.team,
                "layer_m": f.layer_m,
                "home_m": f.home_m,
                "in_the_air": f.phase in IN_THE_AIR,
                "stays": f.own_activity(),
                "on_mission": f.step is TakenOut.ON_BOARD,
                "kept": msgspec.to_builtins(_kept(parts, f)),
            }
            for f in parts.flight.flights
        ],
        "sent": sorted(parts.flight.flights.sent),
        "alarms": parts.alarms.memory(),
        "reboots": parts.picture.reboots.memory(),
        "jumps": parts.picture.jump_monitor.memory(),
        "heights": parts.picture.altitude_monitor.memory(
            v.id for v in parts.picture.fleet.in_order() if v.telemetry.airborne
        ),
        "acknowledged": frontend.acknowledged_checks(),
        "plans": parts.services.missions.registry.memory(),
        "changing": [
            [job.vehicle, int(job.kind)]
            for job in parts.comms.jobs.under_way()
            if isinstance(job, PlanJob) and job.changing
        ],
        "unfinished": frontend.unfinished_tasks(),
        "learnt": {
            name: base64.b64encode(controller.learnt).decode() for name, controller in active.team_controllers.items()
        },
    }


def _kept(parts: StationParts, flight: Flight) -> KeptOrder | None:
    """The order that the next station has to carry out: one that waits, or a stop that no telemetry confirmed yet."""
    if flight.kept is not None:
        return flight.kept
    if isinstance(flight.step, Lost) and flight.step.before is Phase.RETURNING:
        return KeptOrder(RETURN, flight.ordered_by, False, "it was lost")
    stop = parts.comms.commands.stop_under_way(flight.vehicle)
    if stop is None or stop.name not in (RETURN, LAND, HOLD) or flight.held_by_station:
        return None
    # By a veto of the guard the vehicle stops as well, and flies on for its planner when the way is free.
    if stop.name == HOLD and flight.phase is not Phase.HOLDING:
        return None
    return KeptOrder(stop.name, stop.by, False, "the station ended before it was confirmed")


def _learnt_bytes(text: object) -> bytes:
    """What a planner learnt; b"" if that is damaged: it learns again, and the rest of the state stays good."""
    try:
        learnt = base64.b64decode(text, validate=True) if isinstance(text, str) else b""
    except (binascii.Error, ValueError):
        learnt = b""
    return learnt if len(learnt) <= MAX_LEARNT_BYTES else b""
