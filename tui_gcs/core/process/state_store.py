"""What a station must know again after `kill -9`.

Scenario, round, teams, homes, answered alarms, who must be rebooted, whose position jumped, what was acknowledged,
which plans are ours, what planners learnt, what was being changed on vehicles.

A restarted station shows the whole picture and sends no set-point: vehicles found in the air are shown as holding.
"""

import base64
import binascii
import json
import logging
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tui_gcs.core.base.text import clean
from tui_gcs.core.flight.flights import IN_THE_AIR, Flight
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol.common import EventClass, RunPhase
from tui_gcs.core.protocol.plan_limits import MOST_LEARNT_BYTES
from tui_gcs.core.records.event_log import ALERT
from tui_gcs.core.services.plans.plan_jobs import PlanJob

if TYPE_CHECKING:
    from tui_gcs.core.station.station import Station

log = logging.getLogger("tui_gcs.station")

RETRY_S = 2.0
"""So long after a failure to write it is tried again."""
KEYS = frozenset({"toml", "run", "round_index", "revision", "task_revision", "started_s", "flights"})
"""What a whole memory holds."""


class StateStore:
    """One small JSON file, replaced atomically when something in it changes."""

    def __init__(self, path: Path) -> None:
        """Read `path` if it is there; what cannot be read is as if it were not."""
        self._path = path
        self._written = ""
        self._retry_s = -math.inf
        self._held: dict[str, Any] = {}
        self.lost = ""
        """Why the memory of the last run is not known, though there was one; "" otherwise."""
        try:
            held = json.loads(path.read_text())
            if isinstance(held, dict) and held.keys() >= KEYS:
                self._held = held
            else:
                self.forget("it is not this version's")
        except FileNotFoundError:
            pass
        except (OSError, ValueError) as error:
            self.forget(f"it cannot be read: {error}")

    def forget(self, why: str) -> None:
        """What was read is of no use: go on without it, and say so to the station."""
        log.error("memory of the last run is lost: %s", why)
        self._held, self.lost = {}, why

    @property
    def toml(self) -> str:
        """The scenario text last flown; empty if nothing is remembered."""
        return str(self._held.get("toml", ""))

    def recall(self, station: "Station") -> None:
        """Put what is remembered into a fresh station; tell it if it is lost."""
        try:
            if self._held:
                self._recall(station)
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            self.forget(f"it is damaged: {type(error).__name__} {error}")
        station.memory_lost = self.lost

    def _recall(self, station: "Station") -> None:
        for item in self._held["flights"]:
            home = item["home_m"]
            flight = Flight(item["vehicle"], item["team"], item["layer_m"], home_m=tuple(home) if home else None)
            flight.stays = str(item.get("stays", ""))
            station.flights.by_id[flight.vehicle] = flight
            if item["in_the_air"]:
                station.executive.remember_flying(flight)
        station.executive.started_s = self._held["started_s"] or math.nan
        was_running = self._held["run"] in (RunPhase.RUNNING, RunPhase.STARTING)
        station.executive.resume_found = was_running and station.scenario.link_loss.resume
        station.revision = self._held["revision"]
        station.task_revision = self._held["task_revision"]
        station.set_round(min(self._held["round_index"], len(station.scenario.rounds) - 1))
        station.alarms.recall(self._held.get("alarms", {}))
        station.reboots.recall(self._held.get("reboots", {}))
        station.jumps.recall(self._held.get("jumps", []))
        station.heights.recall(self._held.get("heights", {}))
        station.preflight.recall(self._held.get("acknowledged", []))
        station.services.missions.registry.recall(self._held.get("plans", []))
        learnt = self._held.get("learnt")
        for name, desk in station.team_controllers.items():
            desk.learnt = _bytes(learnt.get(name)) if isinstance(learnt, dict) else b""
        self._recall_changes(station)

    def _recall_changes(self, station: "Station") -> None:
        """What this station's end cut short is told: a vehicle may hold a part of it, which looks like a whole."""
        for vehicle, kind in self._held.get("changing", []):
            station.services.missions.registry.cut_short(int(vehicle), PlanKind(kind))
        for vehicle, what in self._held.get("unfinished", []):
            text = f"{clean(what, 80)}: cut short when the station ended, it may hold a part: look, do it again"
            station.events.report(EventClass.MISSION, f"vehicle {int(vehicle)}", text, ALERT)

    def remember(self, station: "Station") -> None:
        """Write down what changed."""
        if station.executive.run in (RunPhase.STARTING, RunPhase.RUNNING):
            station.memory_lost = ""  # somebody said how to go on
        started_s = station.executive.started_s
        held = {
            "toml": station.toml,
            "run": station.executive.run,
            "round_index": station.round_index,
            "revision": station.revision,
            "task_revision": station.task_revision,
            "started_s": None if math.isnan(started_s) else started_s,
            "flights": [
                {
                    "vehicle": f.vehicle,
                    "team": f.team,
                    "layer_m": f.layer_m,
                    "home_m": f.home_m,
                    "in_the_air": f.phase in IN_THE_AIR,
                    "stays": f.own_way(),
                }
                for f in station.flights
            ],
            "alarms": station.alarms.memory(),
            "reboots": station.reboots.memory(),
            "jumps": station.jumps.memory(),
            "heights": station.heights.memory(v.id for v in station.fleet.in_order() if v.telemetry.airborne),
            "acknowledged": station.preflight.memory(),
            "plans": station.services.missions.registry.memory(),
            "changing": [
                [job.vehicle, int(job.kind)]
                for job in station.jobs.under_way()
                if isinstance(job, PlanJob) and job.changing
            ],
            "unfinished": station.requests.tasks.unfinished(),
            "learnt": {name: base64.b64encode(desk.learnt).decode() for name, desk in station.team_controllers.items()},
        }
        text = json.dumps(held)
        now = station.clock.now()
        if text == self._written or now < self._retry_s:
            return
        new = self._path.with_suffix(".new")
        try:
            new.write_text(text)
            new.replace(self._path)
        except OSError as error:
            if not station.memory_error:
                log.error("memory of this run cannot be written: %s", error)
            self._retry_s, station.memory_error = now + RETRY_S, f"{new}: {error.strerror}"
        else:
            self._written, station.memory_error = text, ""


def _bytes(text: object) -> bytes:
    """What a planner learnt; b"" if that is damaged: it learns again, and nothing else is lost for it."""
    try:
        learnt = base64.b64decode(text, validate=True) if isinstance(text, str) else b""
    except (binascii.Error, ValueError):
        learnt = b""
    return learnt if len(learnt) <= MOST_LEARNT_BYTES else b""
