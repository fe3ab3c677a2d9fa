"""The station: the composition root that connects links, fleet, services, guard, teams and records.

It has no loop of its own and never waits: `tick` does everything that is due. A process calls it 20 times a second;
a lock-step run calls it whenever it has moved time on.
"""

from collections.abc import Callable, Iterator

import msgspec

from tui_gcs.core.alarms.alarm_table import AlarmFinding
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.links import Link
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.common import JournalEvent, encode
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.station.alarm_finder import AlarmFinder
from tui_gcs.core.station.assembly import build_parts
from tui_gcs.core.station.bus_handlers import BusHandlers
from tui_gcs.core.station.frontend_protocol import StationFrontend
from tui_gcs.core.station.integrity_response import IntegrityResponse
from tui_gcs.core.station.parts import Records, StationConfig
from tui_gcs.core.station.publisher import Publisher
from tui_gcs.core.station.tick_schedule import TickSchedule, TickTask

ALARM_GAP_S = 0.2
HEARTBEAT_GAP_S = 1.0
BATTERY_GAP_S = 1.0
IDENTITY_MESSAGES = (148, 33)
"""AUTOPILOT_VERSION and GLOBAL_POSITION_INT: hardware id and boot clock show whether it is the vehicle we know."""


class Station:
    """One station of one kind. Everything happens on the caller's thread."""

    def __init__(
        self, config: StationConfig, clock: Clock, bus: Bus, links: list[Link], recorder: TlogWriter, journal: Journal
    ) -> None:
        """Build and connect the parts; nothing is sent before the first `tick`.

        Requests are answered once a frontend is attached, see `attach`.
        """
        self.config = config
        self.records = Records(clock, bus, EventLog(clock), recorder, journal)
        self.records.events.listen(self._publish_event)
        self.parts = build_parts(config, self.records, links)
        self.picture, self.comms, self.flight = self.parts.picture, self.parts.comms, self.parts.flight
        self.active, self.services, self.alarms = self.parts.active, self.parts.services, self.parts.alarms
        self.conditions = self.parts.conditions
        self._alarm_finder = AlarmFinder(self.parts)
        self.records.events.listen(self._alarm_finder.on_event)
        self.integrity = IntegrityResponse(self.records, self.picture, self.flight, self._alarm_finder)
        self.flight.executive.return_control.lift_m = self.integrity.lift_m
        self.publisher = Publisher(self.parts)
        self.frontend: StationFrontend | None = None
        self._handlers = BusHandlers(self.parts)
        self._handlers.listen()
        self._schedule = TickSchedule(self._tick_tasks(), clock)
        self.active.begin()

    def attach(self, frontend: StationFrontend) -> None:
        """Answer requests by `frontend` from now on, and publish what it knows with the status."""
        self.frontend = self.publisher.frontend = frontend
        self._handlers.attach(frontend)

    @property
    def waiting(self) -> bool:
        """Whether an answer is expected, so that incoming frames are worth taking at once."""
        return self.comms.commands.waiting or self.comms.jobs.busy

    def receive(self, may_go_on: Callable[[], bool] = lambda: True) -> int:
        """Take what has arrived and answer what must be answered at once; returns the number of datagrams.

        `may_go_on` is asked between links, see `Reception.receive`.
        """
        return self.comms.reception.receive(may_go_on)

    def tick(self) -> None:
        """Take what has arrived, and do everything that is due now."""
        self.receive()
        for _ in self.steps():
            pass

    def steps(self) -> Iterator[None]:
        """Do everything that is due now, in pieces; the caller may answer requests between them.

        Nothing is received: the caller has done so just before.
        """
        return self._schedule.run_due()

    def close(self) -> None:
        """Write down what the next start has to know."""
        self.picture.trust.close()

    def _tick_tasks(self) -> list[TickTask]:
        """The tasks of a tick in their order: telemetry first, then what it may lead to, then what is published."""
        picture, comms, flight = self.picture, self.comms, self.flight
        return [
            TickTask("telemetry", picture.fleet.tick),
            TickTask("signing", lambda: picture.trust.tick(list(picture.fleet.vehicles.values()))),
            TickTask("teams", self.active.assign_when_idle),
            TickTask("paths", self._ask_identities),
            TickTask("signing clocks", self._send_signing_times, serves=True),
            TickTask("message rates", comms.rates.tick, serves=True),
            TickTask("commands", lambda: comms.commands.tick(picture.fleet.vehicles)),
            TickTask("transfers", comms.jobs.tick),
            TickTask("services", self.services.tick),
            TickTask("Remote ID", self.parts.operator_id.tick),
            TickTask("reboots", picture.reboots.tick),
            TickTask("phases", flight.executive.tick),
            TickTask("monitors", self._look_at_flights, ALARM_GAP_S),
            TickTask("missions apart", flight.mission_separation.tick, ALARM_GAP_S),
            TickTask("batteries", flight.battery_return.tick, BATTERY_GAP_S),
            TickTask("firmware", comms.firmware.tick),
            TickTask("stalls", self.integrity.after_stall),
            TickTask("set-points", self._steer),
            TickTask("forwarding", comms.forwarder.tick),
            TickTask("uplink", comms.uplink.tick, serves=True),
            TickTask("alarms", self._look_for_alarms, ALARM_GAP_S, serves=True),
            TickTask("heartbeat", comms.uplink.heartbeat, HEARTBEAT_GAP_S),
            TickTask("fleet frame", self.publisher.publish_frame, self.publisher.frame_gap_s),
            TickTask("status", self.publisher.publish_status),
            # Every tick, so that a `kill -9` takes no more than 0.1 s of it (docs/threats.md R11).
            TickTask("telemetry log", self.parts.records.recorder.flush),
        ]

    def _ask_identities(self) -> None:
        """Ask over each path that may lead to a known vehicle which vehicle it is."""
        for vehicle, path in self.picture.fleet.paths.due_version_requests(list(self.picture.fleet.vehicles.values())):
            for message in IDENTITY_MESSAGES:
                self.comms.uplink.ask_path(vehicle, path, message)

    def _send_signing_times(self) -> None:
        for source, heartbeat in self.picture.trust.due_time_frames():
            self.comms.uplink.send_time(source, heartbeat)

    def _look_at_flights(self) -> None:
        vehicles, now = self.picture.fleet.vehicles, self.records.clock.now()
        self.flight.emergencies.look(vehicles, now)
        self.flight.courses.look(vehicles, now)

    def _steer(self) -> None:
        """Send set-points; none right after a stall, when what is known of the vehicles may be from before it."""
        if self.integrity.stall_detector.catches_up:
            return
        # Holds for planners that do not answer come before the set-points of this tick, which would contradict them.
        for controller in self.active.team_controllers.values():
            must_hold = controller.tick()
            if must_hold:
                self.flight.executive.hold(tuple(must_hold), stays="", ordered=False)
        self.flight.follow_control.tick()
        self.flight.steering.tick()

    def _look_for_alarms(self) -> Iterator[None]:
        """Look for all that is wrong, in pieces: a stop does not wait until a big fleet was looked at."""
        self.integrity.look_at_clock()
        self.integrity.look_at_positions()
        yield
        findings: list[AlarmFinding] = []
        for piece in self._alarm_finder.findings(ALARM_GAP_S):
            findings += piece
            yield
        self.alarms.look(findings)
        self.integrity.look_at_doubts()

    def _publish_event(self, event: JournalEvent) -> None:
        self.records.bus.publish(keys.EVENT, encode(event))
        self.records.journal.write(msgspec.to_builtins(event))
