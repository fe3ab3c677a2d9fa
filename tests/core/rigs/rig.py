"""A whole system in one process for tests: simulator, station and planners on a virtual clock.

`Rig` is the lock-step run of `tui_gcs.rehearsal.lock_step` with handles: links may lose datagrams, a planner may be a
function of the test, everything sent and told can be looked at.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

import msgspec

from tests.core.rigs.designs import remembered
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import FLEET, PLAN, REQUEST, TASK, MemoryBus
from tui_gcs.core.protocol.common import FleetFrame, Intent, JournalEvent, Phase, PlannerTask, Reply, RunPhase, TeamPlan
from tui_gcs.core.protocol.preflight import OVERRIDABLE
from tui_gcs.core.records.event_log import ALERT
from tui_gcs.core.requests.frontend import attach_frontend
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.core.station.station import Station
from tui_gcs.rehearsal.lock_step import TICK_S, LockStep

SHIPPED = Path(__file__).parents[3] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"
SPOT = (240.0, 200.0)
"""Inside the area, east and north."""
SETPOINT = "SET_POSITION_TARGET_GLOBAL_INT"

DISARM = 400
"""MAV_CMD_COMPONENT_ARM_DISARM."""

Wants = Callable[[FleetFrame, PlannerTask], list[Intent]]
"""A planner made of one function: intents for a frame."""


def toml() -> str:
    """The shipped scenario as text."""
    return SHIPPED.read_text()


def scenario(vehicles: int = 8) -> Scenario:
    """The shipped scenario; with fewer than five vehicles only the team `defend`, on its four layers."""
    whole = load(SHIPPED)
    if vehicles == 8:
        return whole
    assert vehicles <= 4
    team = msgspec.structs.replace(whole.teams[0], vehicles=tuple(range(1, vehicles + 1)))
    return msgspec.structs.replace(whole, teams=(team,), places=whole.places[:vehicles])


def stay(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
    """The dullest planner: everybody goes to his own spot in the middle of the area, on his own layer."""
    return [
        Intent(vehicle=v, kind="goto", position_m=(200.0 + 20.0 * v, 200.0, task.layers_m[v])) for v in task.members
    ]


def goto(vehicle: int, x: float, y: float, z: float) -> Intent:
    """To a place."""
    return Intent(vehicle, "goto", position_m=(x, y, z))


@dataclass
class Rig(LockStep):
    """A lock-step run that tests can hold by every part. `wants=None`: the scenario's own planners."""

    wants: Wants | None = stay
    sent: list[tuple[float, int, str, dict[str, Any]]] = field(default_factory=list)
    """(time, system id, message name, fields) of every frame the station sent, heartbeats apart."""
    frame: FleetFrame | None = None
    planning: bool = True
    """Set False and the function planner is silent."""
    loses: Callable[[str, int], bool] = lambda way, index: False
    """loses("up" or "down", index of the vehicle): whether this datagram is lost."""

    def __post_init__(self) -> None:
        if self.wants is None:
            with patch("tui_gcs.planner.patrol.patrol.begin_search", remembered):
                super().__post_init__()
        else:
            with patch("tui_gcs.rehearsal.lock_step.attach"):  # the real planners would only draw tours nobody flies
                super().__post_init__()
        self.bus.subscribe(FLEET, self._on_frame)
        self.sim_index = {spec.system_id: i for i, spec in enumerate(self.sim.specs)}
        self.outgoing = Encoder(1, 1)
        self.seq = 0

    def end_planners(self) -> None:
        """The planner hosts leave the bus; the station hears nothing more of them."""
        keep = PLAN.format(team="*")
        self.bus._subscribers[:] = [entry for entry in self.bus._subscribers if entry[0] == keep]

    # ---------------------------------------------------------------- time

    def step(self) -> None:
        """As `LockStep.step`, through links that may lose datagrams."""
        self.clock.advance(TICK_S)
        self.sim.step(TICK_S)
        for index, data in self.sim.drain():
            if not self.loses("up", index):
                self.link.inject(data, ("sim", index))
        self.tick()

    def tick(self) -> None:
        """The station's part of a step."""
        self.station.tick()
        while self.link.sent:
            data, address = self.link.sent.popleft()
            self._note(data)
            if address[0] == "sim" and int(address[1]) < len(self.sim) and not self.loses("down", int(address[1])):
                self.sim.receive(int(address[1]), data)

    def run(self, seconds: float) -> "Rig":
        """Let time pass."""
        for _ in range(round(seconds / TICK_S)):
            self.step()
        return self

    def until(self, reached: Callable[[], bool], limit_s: float, what: str = "") -> float:
        """Let time pass until `reached`; how long it took. Fails after `limit_s`."""
        begin_s = self.clock.now()
        while not reached():
            assert self.clock.now() - begin_s <= limit_s, f"not within {limit_s} s: {what or reached}"
            self.step()
        return self.clock.now() - begin_s

    def restart_station(self, memory: StateStore) -> None:
        """`kill -9` and a new station on the same vehicles, links and logs; it knows what `memory` holds."""
        self.link.receive()
        self.link.sent.clear()
        self.bus = MemoryBus()
        config = self.station.config
        self.station = Station(config, self.clock, self.bus, [self.link], self.recorder, self.journal)
        self.frontend = attach_frontend(self.station)
        self.bus.subscribe(FLEET, self._on_frame)
        memory.recall(self.station.parts, self.station.frontend)

    def until_heard(self) -> "Rig":
        """A new station has just heard every vehicle, and knows nothing else."""
        fleet = self.station.picture.fleet
        self.until(lambda: all(i in fleet.vehicles and fleet.vehicles[i].telemetry.airborne for i in self.ids), 3.0)
        return self

    # ---------------------------------------------------------------- flight

    @property
    def ids(self) -> tuple[int, ...]:
        """All simulated system ids."""
        return tuple(spec.system_id for spec in self.sim.specs)

    def ready(self) -> "Rig":
        """Booted, heard and with a position."""
        return self.run(6.0)

    def flying(self) -> "Rig":
        """Started, everybody on his layer and given to the planner."""
        self.ready()
        self.until(
            lambda: not any(map(self.station.frontend.readiness.why_not_start, self.ids)), 60.0, "ready to start"
        )
        reply = self.ask(m.Start(vehicles=self.ids, **self.regardless()))
        assert reply.ok, reply
        self.until(lambda: self.station.flight.executive.run is RunPhase.RUNNING, 90.0, "running")
        return self

    def regardless(self) -> dict[str, Any]:
        """Of a LIVE start: what only real vehicles need is overridden."""
        live = self.station.config.kind is RunKind.LIVE
        return {"overrides": OVERRIDABLE, "operator": "a test"} if live else {}

    def phase(self, vehicle: int) -> Phase:
        """What the station is doing with a vehicle."""
        return self.station.flight.flights.by_id[vehicle].phase

    def phases(self) -> set[Phase]:
        """The phases of all flights."""
        return {flight.phase for flight in self.station.flight.flights}

    def speed(self, vehicle: int) -> float:
        """True speed of a vehicle, m/s."""
        velocity = self.sim.velocity_m_s[self.sim_index[vehicle]]
        return float((velocity**2).sum() ** 0.5)

    def place(self, vehicle: int) -> tuple[float, float, float]:
        """True place of a vehicle, ENU metres about the scenario origin."""
        i = self.sim_index[vehicle]
        x, y = self.station.picture.fleet.frame.to_enu(self.sim.lat_deg[i], self.sim.lon_deg[i])
        return float(x), float(y), float(self.sim.alt_rel_m[i])

    def pilot(self, vehicle: int, mode: int) -> None:
        """The vehicle's own pilot changes its mode by radio."""
        assert self.sim._pilots[self.sim_index[vehicle]].modes.set_mode(mode)

    # ---------------------------------------------------------------- bus

    def ask(self, request: m.AnyRequest, principal: str = "console-1") -> Reply:
        """Ask the station."""
        return m.decode(self.bus.ask(REQUEST.format(principal=principal), m.encode(request)), Reply)

    def plan(self, *intents: Intent, team: str = "defend", revision: int | None = None, **more: Any) -> None:
        """Publish a plan by hand."""
        self.seq += 1
        task = self.station.active.team_controllers[team].task
        if revision is None:
            revision = task.revision if task is not None else 0
        plan = TeamPlan(team=team, revision=revision, seq=self.seq, t_s=self.clock.now(), intents=intents, **more)
        self.bus.publish(PLAN.format(team=team), m.encode(plan))

    def alerts(self, team: str = "defend") -> list[str]:
        """What of a team's planner was told as an alert."""
        return [e.text for e in self.events() if e.severity <= ALERT and e.source == f"planner {team}"]

    def texts(self, source: str = "") -> list[str]:
        """Event texts so far, of one source or of all."""
        return [e.text for e in self.events() if not source or e.source == source]

    def events(self) -> tuple[JournalEvent, ...]:
        """All events so far."""
        return self.station.records.events.since(0, 2000)

    # ---------------------------------------------------------------- wire

    def say(self, name: str, system: int = 1, *, index: int | None = None, component: int = 1, **fields: Any) -> None:
        """A forged or scripted message arrives from vehicle `system` at its own (or vehicle `index`'s) address."""
        address = ("sim", self.sim_index.get(system, 0) if index is None else index)
        self.link.inject(Encoder(system, component).encode(name, **fields), address)

    def sent_to(self, vehicle: int, name: str = SETPOINT, since_s: float = 0.0) -> list[tuple[float, dict[str, Any]]]:
        """(time, fields) of what was sent to a vehicle."""
        return [(t, f) for t, v, n, f in self.sent if v == vehicle and n == name and t > since_s]

    def disarms_in_the_air(self, seconds: float) -> list[tuple[float, int]]:
        """Let time pass; (time, vehicle) of every DISARM that was sent to a vehicle in the air."""
        wrong = []
        end_s = self.clock.now() + seconds
        while self.clock.now() < end_s:
            flying = {v for v in self.ids if self.place(v)[2] > 0.2}
            before = len(self.sent)
            self.step()
            wrong += [
                (t, v)
                for t, v, _, fields in self.sent[before:]
                if v in flying and fields.get("command") == DISARM and fields["param1"] == 0
            ]
        return wrong

    def _note(self, data: bytes) -> None:
        for frame in cut_datagram(data).frames:
            message = decode(frame)
            if message is not None and message.name != "HEARTBEAT":
                self.sent.append(
                    (self.clock.now(), message.fields.get("target_system", 0), message.name, message.fields)
                )

    def _on_frame(self, key: str, payload: bytes) -> None:
        self.frame = m.decode(payload, FleetFrame)
        if self.wants is None or not self.planning:
            return
        if self.frame.seq % 2 == 0:  # 5 Hz
            for name, controller in self.station.active.team_controllers.items():
                if controller.task is not None:
                    self.plan(*self.wants(self.frame, controller.task), team=name, revision=controller.task.revision)


__all__ = ["SETPOINT", "SHIPPED", "TASK", "Rig", "scenario", "stay", "toml"]
