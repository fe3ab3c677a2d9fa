"""A station made of paper: publishes plausible frames on a bus and answers requests, driven by `tick`.

Also a program for looking at the console:
`python -m tests.screens.rigs.fake_station [scene]` runs it in a terminal.
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import msgspec

import tui_gcs
from tui_gcs.core.alarms.alarm_table import AlarmFinding, AlarmTable
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.geometry.zones import bounds
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import flight as f
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.alarms import AlarmLevel
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.inspection import (
    GetMessages,
    GetValues,
    Inspection,
    MessageDetail,
    SetMessageRate,
    ValueRow,
)
from tui_gcs.core.protocol.link_report import (
    AddLink,
    AddPartner,
    CloseLink,
    ClosePartner,
    GetLinks,
    LinkReport,
    SetLinkRate,
)
from tui_gcs.core.protocol.people import GetPeople, HandOver, PersonRow, TakeControl
from tui_gcs.core.protocol.planner_log import PLANNER_LOG_END, GetPlannerLog, PlannerLogLine, PlannerLogPiece
from tui_gcs.core.protocol.preflight import AcknowledgeCheck, Check, ReadChecks, SignOff, TickItem
from tui_gcs.core.protocol.setup import (
    AskPayloads,
    ConfirmStep,
    GetRemoteIds,
    GetSetup,
    GetTraffic,
    ReadSetup,
    RemoteIdRow,
    SetGain,
    SetUp,
    SetupSectionRow,
    TrafficRow,
)
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Scenario

SCENARIO_FILE = Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml"
WALL_START_S = 1_790_000_000.0
SPEED_M_S = 8.0
NAN = float("nan")
PHASES = {
    m.RunPhase.IDLE: m.Phase.GROUND,
    m.RunPhase.STARTING: m.Phase.TAKEOFF,
    m.RunPhase.RUNNING: m.Phase.FLYING,
    m.RunPhase.HOLD: m.Phase.HOLDING,
    m.RunPhase.RETURNING: m.Phase.RETURNING,
}


@dataclass
class FakeStation:
    """Eight vehicles on two rings, or on the ground; fields may be changed between ticks."""

    bus: MemoryBus
    kind: m.RunKind = m.RunKind.SIM
    run: m.RunPhase = m.RunPhase.IDLE
    count: int = 8
    t_s: float = 100.0
    round_index: int = 0
    alarm: str = ""
    """One more alarm, of these words."""
    silent: bool = False
    """Neither publishes nor answers."""
    refuse: tuple[int, ...] = ()
    stays: dict[int, str] = field(default_factory=dict)
    """Who does not go on with the others when all are resumed, and why."""
    protocol_answer: str = ""
    """Why Hello is refused; empty: it is not."""
    changes: dict[int, dict[str, object]] = field(default_factory=dict)
    """Values of single vehicles that differ from the usual."""
    tasks: dict[int, s.TaskInfo] = field(default_factory=dict)
    requests: list[m.AnyRequest] = field(default_factory=list)
    events: list[m.JournalEvent] = field(default_factory=list)
    old_events: list[m.JournalEvent] = field(default_factory=list)
    """Of earlier starts: in the journal only."""
    traffic: tuple[TrafficRow, ...] = ()
    remote_ids: tuple[RemoteIdRow, ...] = ()
    tracks: tuple[m.Track, ...] = ()
    points: tuple[m.PointOfInterest, ...] = ()
    on_board: dict[int, s.OnBoardRow] = field(default_factory=dict)
    modes: tuple[str, ...] = ()
    params: dict[int, dict[str, s.ParamRow]] = field(default_factory=dict)
    """What the station knows of vehicles' parameters."""
    unread: dict[int, dict[str, s.ParamRow]] = field(default_factory=dict)
    """Parameters that only the vehicle knows, until they are fetched."""
    infos: dict[str, s.ParamInfoRow] = field(default_factory=dict)
    """What every vehicle says about its parameters."""
    no_set: dict[int, str] = field(default_factory=dict)
    """Vehicles that refuse every value, and why."""
    results: dict[int, s.TaskResult] = field(default_factory=dict)
    """Results by the number of their task."""
    greatest: dict[str, float] = field(default_factory=dict)
    """The top of the range of parameters, by name."""
    setup: tuple[SetupSectionRow, ...] = ()
    """How the setup of vehicles stands, with the lines of every section."""
    no_confirm: str = ""
    """Why no prompt is taken as followed."""
    inspection: Inspection | None = None
    """What is received."""
    details: dict[int, MessageDetail] = field(default_factory=dict)
    """The newest frame of messages, by message id; every vehicle's is the same."""
    people: tuple[PersonRow, ...] = ()
    in_control: str = "console-test"
    refused_control: str = ""
    """Why control is not handed over."""
    link_report: LinkReport | None = None
    planner_log: list[PlannerLogLine] | None = None
    """What planners printed; a place in it is an index. None: no log is kept."""
    lines_left_out: int = 0
    link_refusal: str = ""
    """Why no link is changed."""
    doubts: str = ""
    """Why a message rate has to be meant."""
    dropped: dict[str, int] = field(default_factory=dict)
    values: dict[str, float] = field(default_factory=dict)
    """Numbers that every vehicle has sent, by field or parameter."""
    planners: tuple[m.PlannerInfo, ...] = ()
    preflight: tuple[Check, ...] = ()
    metrics: dict[str, float] = field(default_factory=dict)
    planner_error: str = ""
    """What every planner counts."""
    toml: str = ""
    """The text of the scenario."""
    seq: int = 0
    started_s: float = NAN

    def __post_init__(self) -> None:
        self.scenario: Scenario = load(SCENARIO_FILE)
        self.clock = VirtualClock()
        self.table = AlarmTable(self.clock, EventLog(self.clock))
        """The real one; what is wrong counts at once, without its delays."""
        self.bus.answer(keys.REQUEST.format(principal="*"), self._answer)

    # ------------------------------------------------------------ time

    def fly(self, mission_s: float = 252.0) -> None:
        """All in the air since `mission_s` seconds."""
        self.run, self.started_s = m.RunPhase.RUNNING, self.t_s - mission_s

    def tick(self, dt_s: float = 0.1) -> None:
        """Move on and publish."""
        self.t_s += dt_s
        self.seq += 1
        if self.silent:
            return
        self.bus.publish(keys.FLEET, m.encode(self.frame()))
        self.bus.publish(keys.STATUS, m.encode(self.status()))
        if self.flying:
            for team in self.scenario.teams:
                self.bus.publish(keys.PLAN.format(team=team.name), m.encode(self.plan(team.name)))

    def event(self, text: str, *, source: str = "station", severity: int = 6, cls: str = "mission") -> m.JournalEvent:
        """Raise an event and publish it."""
        event = m.JournalEvent(
            seq=len(self.events),
            t_s=self.t_s,
            wall_s=WALL_START_S + self.t_s,
            cls=m.EventClass(cls),
            severity=severity,
            source=source,
            text=text,
        )
        self.events.append(event)
        if not self.silent:
            self.bus.publish(keys.EVENT, m.encode(event))
        return event

    @property
    def flying(self) -> bool:
        return self.run is not m.RunPhase.IDLE

    # ------------------------------------------------------------ what is published

    def frame(self) -> m.FleetFrame:
        rows = [self._row(index) for index in range(self.count)]
        columns = {name: tuple(getattr(row, name) for row in rows) for name in m.VehicleRow._fields}
        columns["ids"] = columns.pop("id")
        return m.FleetFrame(
            seq=self.seq, t_s=self.t_s, wall_s=WALL_START_S + self.t_s, kind=self.kind, tracks=self.tracks, **columns
        )

    def status(self) -> m.StationStatus:
        frame = self.frame()
        return m.StationStatus(
            seq=self.seq,
            t_s=self.t_s,
            wall_s=WALL_START_S + self.t_s,
            kind=self.kind,
            scenario=self.scenario.name,
            revision=1,
            run=self.run,
            round_index=self.round_index,
            rounds=tuple(r.name for r in self.scenario.rounds),
            mission_time_s=self.t_s - self.started_s if math.isfinite(self.started_s) and self.flying else 0.0,
            heard=sum(f is not m.Freshness.LOST for f in frame.freshness),
            vehicles=self.count,
            armed=sum(frame.armed),
            in_control=self.in_control,
            teams=tuple(self._team(team.name) for team in self.scenario.teams),
            links=(m.LinkStatus(name="udpin:127.0.0.1:14550", up=True, datagrams=9000, frames=9000, bad=0),),
            min_separation_m=21.4 if self.flying else NAN,
            recording="2026-09-21T14-13.tlog" if self.flying else "",
            if_silent={v: self.if_silent(v) for v in frame.ids},
            alarms=self.alarms(),
            preflight=self.preflight,
            dropped=self.dropped,
            points=self.points,
        )

    def alarms(self) -> tuple[m.Alarm, ...]:
        """Of what is wrong with the vehicles now."""
        findings = [finding for row in map(self._row, range(self.count)) for finding in findings_of(row)]
        for _ in range(2):
            self.clock.advance(10.0)
            self.table.look(findings)
        found = self.table.alarms()
        if not self.alarm:
            return found
        return (
            m.Alarm("test", AlarmLevel.WARNING, "TST", self.alarm, "[hold_all] hold all", "new", 1, self.t_s),
            *found,
        )

    def if_silent(self, vehicle: int) -> str:
        """Half of them are ArduCopters."""
        if vehicle < 5:
            return "brakes after 3 s and holds; on its way to a place flies there first"
        return "after 1-2 s without set-points: Position mode, without a pilot SINKS (COM_OBL_RC_ACT)"

    def plan(self, team: str) -> m.TeamPlan:
        x, y, rx, ry = self._ring(team)
        ring = tuple((x + rx * math.sin(a), y + ry * math.cos(a)) for a in (math.tau * i / 64 for i in range(64)))
        tour = m.Annotation(kind="polygon", points_m=ring)
        return m.TeamPlan(team=team, revision=1, seq=self.seq, t_s=self.t_s, annotations=(tour,))

    def _ring(self, team: str) -> tuple[float, float, float, float]:
        served = next(t.zone for t in self.scenario.teams if t.name == team)
        zone = next(z for z in self.scenario.rounds[self.round_index].zones if z.name == served)
        x0, y0, x1, y1 = bounds(zone.shape)
        return (x0 + x1) / 2, (y0 + y1) / 2, (x1 - x0) / 2 - 20, (y1 - y0) / 2 - 20

    def _row(self, index: int) -> m.VehicleRow:
        team = self.scenario.teams[(index // 4) % 2].name
        place = self.scenario.places[index % len(self.scenario.places)]
        position = (*place.place_m, 0.0)
        velocity, heading = (0.0, 0.0, 0.0), 0.0
        if self.flying:
            x, y, rx, ry = self._ring(team)
            angle = math.tau * (index % 4) / 4 + (self.t_s - 100.0) * SPEED_M_S / max(rx, ry)
            position = (x + rx * math.sin(angle), y + ry * math.cos(angle), place.layer_m)
            speed = 0.0 if self.run is m.RunPhase.HOLD else SPEED_M_S
            velocity = (speed * math.cos(angle), -speed * math.sin(angle), 0.0)
            heading = math.degrees(math.atan2(math.cos(angle), -math.sin(angle))) % 360.0
        row = m.VehicleRow(
            id=index + 1,
            team=team,
            autopilot="ArduPilot",
            vehicle_type="quadrotor",
            mode="GUIDED" if self.flying else "STABILIZE",
            armed=self.flying,
            phase=PHASES[self.run],
            freshness=m.Freshness.OK,
            position_m=position,
            velocity_m_s=velocity,
            heading_deg=heading,
            lat_deg=52.0720 + position[1] / 111_000,
            lon_deg=-0.6280 + position[0] / 68_000,
            alt_amsl_m=110.0 + position[2],
            battery_pct=82.0 - index,
            battery_v=15.4,
            gps_fix=3,
            satellites=12,
            age_s=0.1,
            heard_age_s=0.05,
            loss_pct=0.0,
            slot=f"{index % 4 + 1}/4" if self.flying else "",
            slot_error_m=0.8 if self.flying else NAN,
            lag_s=0.1 if self.flying else NAN,
            link="udpin:127.0.0.1:14550",
            signing="unsigned",
            problem="",
            layer_m=place.layer_m,
            camera=True,
            gimbal=True,
        )
        row = row._replace(**self.changes.get(row.id, {}))
        if row.phase is m.Phase.RETURNING and "velocity_m_s" not in self.changes.get(row.id, {}):
            return row._replace(velocity_m_s=(0.0, 0.0, 0.0))  # it waits for another one on its way
        return row

    def _team(self, name: str) -> m.TeamStatus:
        team = next(t for t in self.scenario.teams if t.name == name)
        zone = next(z for z in self.scenario.rounds[self.round_index].zones if z.name == team.zone)
        known = 1.0 if self.flying else NAN
        return m.TeamStatus(
            name=name,
            zone=team.zone,
            role=str(zone.role),
            planner=team.planner,
            members=team.vehicles,
            worker="running" if self.flying else "ready",
            plan_age_s=0.1,
            rate_hz=5.0,
            on_slot=4 if self.flying else 0,
            slots=4,
            worst_idleness_s=24.1 * known,
            average_idleness_s=9.1 * known,
            coverage=1.0 * known,
            ideal_s=20.9,
            bound_s=18.0,
            ratio=1.15 * known,
            metrics=self.metrics,
            error=self.planner_error,
        )

    # ------------------------------------------------------------ what is answered

    def _answer(self, _key: str, payload: bytes, reply: Callable[[bytes], None]) -> None:
        if self.silent:
            return
        request = s.decode_request(payload)
        self.requests.append(request)
        reply(m.encode(self._reply(request)))

    def _reply(self, request: m.AnyRequest) -> m.Reply:
        handler = HANDLERS.get(type(request))
        return handler(self, request) if handler else m.Reply(ok=False, text="not on paper")

    def _hello(self, _request: m.Hello) -> m.Reply:
        status = None if self.protocol_answer else self.status()
        return m.Reply(ok=not self.protocol_answer, text=self.protocol_answer, status=status)

    def _scenario(self, _request: m.GetScenario) -> m.Reply:
        change = m.ScenarioChanged(revision=1, path="swarm-challenge.toml", toml=self.toml, scenario=self.scenario)
        return m.Reply(ok=True, scenario=change)

    def _events(self, request: m.GetEvents) -> m.Reply:
        return m.Reply(ok=True, events=tuple(e for e in self.events if e.seq > request.after))

    def _journal(self, request: m.GetJournal) -> m.Reply:
        at = len(self.old_events) if request.before == -1 else request.before
        begin = max(0, at - 100)
        return m.Reply(ok=True, events=tuple(self.old_events[begin:at]), journal_at=begin)

    def _vehicles(self, request: s.GetVehicles) -> s.ServiceReply:
        rows = {row.id: row for row in map(self._row, range(self.count))}
        infos = tuple(info_of(rows[v]) for v in request.vehicles if v in rows)
        return s.ServiceReply(ok=True, vehicles=infos)

    def _modes(self, _request: s.GetModes) -> s.ServiceReply:
        rows = tuple(s.ModeRow(name, at, name == "ACRO") for at, name in enumerate(self.modes))
        return s.ServiceReply(ok=True, modes=rows, complete=True)

    def _params(self, request: s.GetParams) -> s.ServiceReply:
        rows = tuple(self.params.get(request.vehicle, {}).values())
        return s.ServiceReply(ok=True, params=rows, complete=bool(rows) and request.vehicle not in self.unread)

    def _fetch_params(self, request: s.FetchParams) -> s.ServiceReply:
        """Every vehicle answers at once."""
        for vehicle in request.vehicles:
            self.params.setdefault(vehicle, {}).update(self.unread.pop(vehicle, {}))
        return self._ended(request, {})

    def _set_params(self, request: s.SetParams) -> s.ServiceReply:
        top = {} if request.beyond_range else self.greatest
        beyond = tuple(name for name, value in request.values.items() if value > top.get(name, value))
        for vehicle in request.vehicles:
            held = self.params.setdefault(vehicle, {})
            for name, value in request.values.items() if vehicle not in self.no_set else ():
                if name not in beyond:
                    held[name] = msgspec.structs.replace(held[name], value=value)
        if not beyond:
            return self._ended(request, self.no_set)
        why = "; ".join(f"{name}: must be within 0 to {top[name]:g}" for name in beyond)
        reply = self._ended(request, dict.fromkeys(request.vehicles, why))
        for task in reply.tasks:
            self.results[task.number] = s.TaskResult(out_of_range=beyond)
        return reply

    def _ended(self, request: Any, failed: dict[int, str]) -> s.ServiceReply:
        """Tasks that are over when they are asked about."""
        reply = self._begin(request)
        for task in reply.tasks:
            why = failed.get(task.vehicle, "")
            self.end_task(task.number, "failed" if why else "done", why)
        return reply

    def _setup(self, request: GetSetup) -> s.ServiceReply:
        asked = set(request.vehicles)
        rows = (r for r in self.setup if r.vehicle in asked and (not request.only or r.section == request.section))
        without = (row if row.section == request.section else msgspec.structs.replace(row, fields=()) for row in rows)
        return s.ServiceReply(ok=True, setup_sections=tuple(without))

    def _set_gain(self, request: SetGain) -> s.ServiceReply:
        if self.doubts and not request.sure:
            results = (m.VehicleResult(v, False, self.doubts, m.ReplyCode.NOT_CONFIRMED) for v in request.vehicles)
            return s.ServiceReply(ok=False, results=tuple(results))
        beyond = request.value > self.greatest.get(request.name, math.inf) and not request.beyond_range
        if not beyond:
            return self._ended(request, self.no_set)
        reply = self._ended(request, dict.fromkeys(request.vehicles, f"{request.name}: must be within its range"))
        for task in reply.tasks:
            self.results[task.number] = s.TaskResult(out_of_range=(request.name,))
        return reply

    def _confirm(self, request: ConfirmStep) -> m.Reply:
        why = self.no_confirm
        return m.Reply(ok=not why, text=why or f"task {request.number}: confirmed")

    def _messages(self, request: GetMessages) -> s.ServiceReply:
        found = self.inspection
        if found is None:
            return s.ServiceReply(ok=True)
        rows = tuple(row for row in found.rows if not request.vehicles or row.vehicle in request.vehicles)
        detail = self.details.get(request.detail.msgid) if request.detail is not None else None
        if detail is not None and request.detail is not None:
            detail = msgspec.structs.replace(detail, key=request.detail)
        found = msgspec.structs.replace(found, t_s=self.t_s, rows=rows, detail=detail)
        return s.ServiceReply(ok=True, inspection=found)

    def _values(self, request: GetValues) -> s.ServiceReply:
        rows = (
            ValueRow(self.t_s if key.name in self.values else NAN, self.values.get(key.name, NAN))
            for key in request.keys
        )
        return s.ServiceReply(ok=True, values=tuple(rows))

    def _set_rate(self, request: SetMessageRate) -> s.ServiceReply:
        if self.doubts and not request.sure:
            results = (m.VehicleResult(v, False, self.doubts, m.ReplyCode.NOT_CONFIRMED) for v in request.vehicles)
            return s.ServiceReply(ok=False, results=tuple(results))
        return self._ended(request, self.no_set)

    def _links(self, _request: GetLinks) -> s.ServiceReply:
        found = self.link_report
        return s.ServiceReply(ok=True, link_report=msgspec.structs.replace(found, t_s=self.t_s) if found else None)

    def _planner_log(self, request: GetPlannerLog) -> s.ServiceReply:
        if self.planner_log is None:
            return s.ServiceReply(ok=False, text="this station keeps no planner log")
        at = len(self.planner_log) if request.at == PLANNER_LOG_END else request.at
        begin, end = (at, len(self.planner_log)) if request.newer else (max(0, at - 100), at)
        lines = tuple(self.planner_log[begin:end])
        piece = PlannerLogPiece(lines, begin, end, begin == 0, self.lines_left_out, "/state/run-planners.log")
        return s.ServiceReply(ok=True, planner_log=piece)

    def _hand_over(self, request: HandOver) -> m.Reply:
        if not self.refused_control:
            self.in_control = request.to
        return m.Reply(ok=not self.refused_control, text=self.refused_control or f"{request.to} has control")

    def _take_control(self, _request: TakeControl) -> m.Reply:
        self.in_control = "console-test"
        return m.Reply(ok=True, text="has control")

    def _cancel(self, request: s.CancelTask) -> s.ServiceReply:
        self.end_task(request.number, "cancelled", "")
        return s.ServiceReply(ok=True, text=f"task {request.number} ends")

    def _change_link(self, _request: object) -> m.Reply:
        return m.Reply(ok=not self.link_refusal, text=self.link_refusal or "link changed")

    def _on_board(self, request: s.GetOnBoard) -> s.ServiceReply:
        rows = tuple(self.on_board[v] for v in request.vehicles if v in self.on_board)
        return s.ServiceReply(ok=True, on_board=rows)

    def _start(self, request: m.Start) -> m.Reply:
        self.fly(0.0)
        return self._results(request.vehicles)

    def _hold(self, request: m.Hold) -> m.Reply:
        self.run = m.RunPhase.HOLD if self.flying else self.run
        return self._results(request.vehicles or tuple(range(1, self.count + 1)))

    def _resume(self, _request: m.Resume) -> m.Reply:
        self.run = m.RunPhase.RUNNING
        return m.Reply(ok=True, results=tuple(m.VehicleResult(v, not why, why) for v, why in self.stays.items()))

    def _return(self, request: m.Return | f.Land) -> m.Reply:
        self.run = m.RunPhase.RETURNING
        return self._results(request.vehicles or tuple(range(1, self.count + 1)))

    def _note(self, request: m.Note) -> m.Reply:
        self.event(request.text, source="console-test", severity=request.severity, cls="console")
        return m.Reply(ok=True)

    def _switch_round(self, request: m.SwitchRound) -> m.Reply:
        self.round_index = request.index
        return m.Reply(ok=True)

    def _begin(self, request: s.Change) -> s.ServiceReply:
        """A task for each vehicle; a test ends them by `end_task`."""
        good = [v for v in request.vehicles if v not in self.refuse]
        for vehicle in good:
            number = len(self.tasks) + 1
            self.tasks[number] = s.TaskInfo(number, vehicle, "it", "console-test", "running", 0, 0, "", 0.0)
        results = tuple(m.VehicleResult(v, v in good, "" if v in good else "prearm: compass") for v in request.vehicles)
        tasks = tuple(self.tasks.values())[len(self.tasks) - len(good) :]
        return s.ServiceReply(ok=len(good) == len(results), results=results, tasks=tasks)

    def end_task(self, number: int, state: str, text: str) -> None:
        """What comes of a task."""
        self.tasks[number] = msgspec.structs.replace(self.tasks[number], state=state, text=text)

    def _results(self, vehicles: tuple[int, ...]) -> m.Reply:
        results = tuple(
            m.VehicleResult(vehicle=v, ok=v not in self.refuse, text="prearm: compass" if v in self.refuse else "")
            for v in vehicles
        )
        return m.Reply(ok=not self.refuse, results=results)

    def commands(self) -> list[m.AnyRequest]:
        """What was asked beyond looking."""
        looking = (
            m.Hello,
            m.GetScenario,
            m.GetEvents,
            m.GetTask,
            m.GetPlan,
            m.GetPlanners,
            m.GetPreviews,
            m.Preview,
            m.CancelPreview,
            GetTraffic,
            GetRemoteIds,
            GetMessages,
            GetValues,
            GetLinks,
            GetPeople,
            GetSetup,
            AskPayloads,
            m.GetJournal,
            m.Note,
            s.GetTasks,
            s.GetVehicles,
            s.GetOnBoard,
            s.GetModes,
            s.GetParamInfos,
            s.GetParams,
            s.GetTaskResult,
        )
        return [_without_time(request) for request in self.requests if not isinstance(request, looking)]


def _without_time(request: m.AnyRequest) -> m.AnyRequest:
    """The request, if a stop without the moment at which it was given: a test compares what was asked."""
    return msgspec.structs.replace(request, given_ns=0) if isinstance(request, m.StopRequest) else request


HANDLERS: dict[type, Callable[[FakeStation, Any], m.Reply]] = {
    **dict.fromkeys((*get_args(s.Change), s.ListLogs, s.DownloadLog), FakeStation._begin),
    **dict.fromkeys(get_args(s.Change), FakeStation._begin),
    GetSetup: FakeStation._setup,
    **dict.fromkeys((ReadSetup, *get_args(SetUp)), lambda station, request: station._ended(request, station.no_set)),
    SetGain: FakeStation._set_gain,
    ConfirmStep: FakeStation._confirm,
    m.Hello: FakeStation._hello,
    m.GetScenario: FakeStation._scenario,
    m.GetEvents: FakeStation._events,
    m.GetJournal: FakeStation._journal,
    s.GetVehicles: FakeStation._vehicles,
    s.GetModes: FakeStation._modes,
    s.GetOnBoard: FakeStation._on_board,
    GetMessages: FakeStation._messages,
    GetValues: FakeStation._values,
    GetLinks: FakeStation._links,
    GetPlannerLog: FakeStation._planner_log,
    GetPeople: lambda station, _: s.ServiceReply(ok=True, people=station.people),
    HandOver: FakeStation._hand_over,
    TakeControl: FakeStation._take_control,
    s.CancelTask: FakeStation._cancel,
    **dict.fromkeys((AddLink, CloseLink, SetLinkRate, AddPartner, ClosePartner), FakeStation._change_link),
    SetMessageRate: FakeStation._set_rate,
    s.GetParams: FakeStation._params,
    s.GetParamInfos: lambda station, request: s.ServiceReply(
        ok=True, param_infos=tuple(station.infos[name] for name in request.names if name in station.infos)
    ),
    s.FetchParams: FakeStation._fetch_params,
    s.SetParams: FakeStation._set_params,
    s.GetTaskResult: lambda station, request: s.ServiceReply(
        ok=True, result=station.results.get(request.number, s.TaskResult())
    ),
    s.GetTasks: lambda station, request: s.ServiceReply(
        ok=True, tasks=tuple(station.tasks[n] for n in request.numbers or station.tasks)
    ),
    GetTraffic: lambda station, _: s.ServiceReply(ok=True, traffic=station.traffic),
    GetRemoteIds: lambda station, _: s.ServiceReply(ok=True, remote_ids=station.remote_ids),
    **dict.fromkeys((m.AddPoints, m.CancelPoints), lambda *_: m.Reply(ok=True, text="done")),
    m.GetPlan: lambda *_: m.Reply(ok=True),
    m.GetPlanners: lambda station, _: m.Reply(ok=True, planners=station.planners),
    m.Start: FakeStation._start,
    m.Hold: FakeStation._hold,
    m.Resume: FakeStation._resume,
    m.Return: FakeStation._return,
    f.Land: FakeStation._return,
    m.Acknowledge: lambda station, request: station.table.acknowledge("console-test", request),
    m.Shelve: lambda station, request: station.table.shelve("console-test", request),
    m.Unshelve: lambda station, request: station.table.unshelve("console-test", request),
    **dict.fromkeys((AcknowledgeCheck, SignOff, TickItem, ReadChecks), lambda *_: m.Reply(ok=True)),
    m.Note: FakeStation._note,
    m.SwitchRound: FakeStation._switch_round,
}
"""What answers each kind of request; all others are refused."""


def info_of(row: m.VehicleRow) -> s.VehicleInfo:
    """What a station would tell of a vehicle when asked."""
    return s.VehicleInfo(
        id=row.id,
        network="",
        system=row.id,
        autopilot=row.autopilot,
        type=row.vehicle_type,
        firmware="4.7.0-dev",
        uid="0123456789abcdef01234567",
        team=row.team,
        mode=row.mode,
        armed=row.armed,
        in_flight=row.armed,
        freshness=row.freshness.value,
        heard_age_s=row.heard_age_s,
        signing=row.signing,
        ready=row.id != 3,
        problems=(s.ProblemRow(text="PreArm: Compass not healthy", blocks=True),) if row.id == 3 else (),
        failsafes=(),
        links=(row.link,),
        loss_pct=row.loss_pct,
        rtt_s=0.012,
        best_rtt_s=0.01,
        home=(52.072, -0.628, 110.0),
        mission_items=12,
        mission_current=2,
        params_known=0,
        params_complete=False,
        busy="",
        details=s.Details(
            roll_deg=-2.0,
            pitch_deg=5.0,
            yaw_deg=184.0,
            airspeed_m_s=8.1,
            battery_a=22.1,
            battery_left_s=660.0,
            hdop=0.7,
            position_error_m=0.8,
            estimator="0.21 compass",
            home_m=(-20.0, 5.0, 0.0),
        ),
    )


def findings_of(row: m.VehicleRow) -> list[AlarmFinding]:
    """What a station would find of a vehicle in a frame."""
    if row.freshness is m.Freshness.LOST and row.armed:
        return [AlarmFinding("lost", row.id)]
    found = [AlarmFinding("stale", row.id)] if row.freshness is m.Freshness.STALE and row.armed else []
    found += [AlarmFinding("identity", row.id, row.problem)] if row.problem else []
    if row.armed and row.battery_pct < 25.0:
        word = "critical" if row.battery_pct < 15.0 else "low"
        found.append(AlarmFinding(f"battery-{word}", row.id, f"{row.battery_pct:.0f} %"))
    return found


def trouble(station: FakeStation) -> None:
    """In flight with a low battery and a lost vehicle."""
    station.fly()
    station.changes[7] = {"battery_pct": 24.0}
    station.changes[5] = {"freshness": m.Freshness.LOST, "heard_age_s": 12.4, "age_s": 12.4}
    station.event("ARMED, take-off to 40 m", source="vehicle 5", cls="vehicle")
    station.event("Round 1 started: 8 vehicles (1-8)", source="you", cls="operator")
    station.event("GPS glitch", source="vehicle 3", severity=4, cls="sensor")
    station.event("vehicle 5 LOST: no frame for 3.5 s", source="station", severity=2, cls="connection")


SCENES: dict[str, Callable[[FakeStation], None]] = {
    "ground": lambda station: None,
    "flight": lambda station: station.fly(),
    "trouble": trouble,
}


def main(argv: list[str]) -> None:
    """Run the console on a fake station at 10 Hz."""
    import threading
    import time

    from tui_gcs.app import ConsoleApp

    bus = MemoryBus()
    station = FakeStation(bus)
    SCENES[argv[0] if argv else "flight"](station)
    stopped = threading.Event()

    def publish() -> None:
        while not stopped.is_set():
            station.tick(0.1)
            time.sleep(0.1)

    thread = threading.Thread(target=publish, daemon=True)
    thread.start()
    ConsoleApp(bus, "console-test").run()
    stopped.set()


if __name__ == "__main__":
    main(sys.argv[1:])
