"""The console's view of the station: the latest picture, and the messages that report its changes.

Bus callbacks come on any thread, so they only fill the mailbox and wake the event loop once. At most five times a
second the loop empties it and posts messages to the listeners. Widgets handle messages; nothing polls, and nothing is
posted when nothing visible changed.
"""

import asyncio
from collections.abc import Callable, Coroutine
from copy import copy
from typing import Any

from textual.message import Message
from textual.message_pump import MessagePump

from tui_gcs.actions.action_context import ActionContext
from tui_gcs.core.base.clock import Clock, MonotonicClock
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as wire
from tui_gcs.core.protocol.bus import Bus, Closable
from tui_gcs.core.protocol.plan_limits import shown
from tui_gcs.core.protocol.services import GetOnBoard, OnBoardRow, VehicleInfo
from tui_gcs.core.protocol.setup import GetTraffic, TrafficRow
from tui_gcs.feed import messages as posted
from tui_gcs.feed.inspection import VehicleInspection
from tui_gcs.feed.logs.event_history import EventHistory
from tui_gcs.feed.logs.journal_notes import JournalNotes
from tui_gcs.feed.mailbox import Mailbox
from tui_gcs.feed.notices import Notice
from tui_gcs.feed.requests import ConsoleRequests
from tui_gcs.feed.selection import KnownVehicles, Selection
from tui_gcs.feed.visible_changes import visible_fleet, visible_info, visible_status

PERIOD_S = 0.2
"""Between two deliveries: 5 Hz is what an operator follows; more only costs bytes where cells change faster."""
STATION_LOST_S = 3.0
"""A station that publishes no status this long counts as lost; it publishes two a second."""
CHECK_S = 1.0


class _Listeners:
    """The widgets and screens that get the feed's messages."""

    def __init__(self) -> None:
        self.nodes: list[MessagePump] = []
        self._shown: dict[str, object] = {}

    def post(self, message: Message) -> None:
        # Textual keeps the sender and the handled state in a message: each listener needs its own. A node that is
        # closed takes no messages, and gets no more of them.
        self.nodes = [node for node in self.nodes if node.post_message(copy(message))]

    def post_if_new(self, what: str, visible: object, message: Message) -> None:
        """Post unless `visible` equals what was posted last of the same subject."""
        # A message costs time in every widget (docs/terminal.md B5); what is refreshed is written, equal or not (B1).
        if self._shown.get(what) != visible:
            self._shown[what] = visible
            self.post(message)

    def forget(self) -> None:
        self._shown.clear()


class Feed:
    """The console's view of the bus. Everything but the bus callbacks runs on the event loop."""

    def __init__(
        self,
        bus: Bus,
        principal: str,
        *,
        clock: Clock | None = None,
        period_s: float = PERIOD_S,
        may_paint: Callable[[], bool] = lambda: True,
    ) -> None:
        """Ask as `principal`; while `may_paint` is false (the terminal stalls) only the latest samples are kept."""
        self.frame: wire.FleetFrame | None = None
        self.status: wire.StationStatus | None = None
        self.scenario: wire.ScenarioChanged | None = None
        self.annotations: dict[str, tuple[wire.Annotation, ...]] = {}
        """What the planners draw, by team."""
        self.planner_files: dict[str, wire.PlannerInfo] = {}
        """What the planners in the operator's own files declare, by name: only the station knows them."""
        self.station_lost = False
        self.starts_station = False
        """The command line has just started the station that this console waits for."""
        self.notice = Notice("")
        """What this console shows its operator now, on every screen."""
        self.live = Notice("")
        """Beside a replay: the worst news of the stations that fly; an empty text where none does."""
        self.requests = ConsoleRequests(bus, principal)
        self.selection = Selection(lambda: self._listeners.post(posted.SelectionChanged()))
        """The vehicles that this console's commands are for."""
        self.events = EventHistory(self.requests, self._spawn, self._post_events)
        self.notes = JournalNotes(self.requests, self._spawn, lambda: self.station_lost)
        self.inspection = VehicleInspection(self.requests, self._spawn, self._may_ask, self._post_info)
        self._bus = bus
        self._listeners = _Listeners()
        self._mailbox = Mailbox(clock or MonotonicClock())
        self._period_s = period_s
        self._may_paint = may_paint
        self._presence: Closable | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timers: dict[str, asyncio.TimerHandle] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._lagged = False
        self._last_delivery = float("-inf")
        self._attaching = False

    def listen(self, node: MessagePump) -> None:
        """Post all messages to `node` too, until it is closed."""
        self._listeners.nodes.append(node)

    def open(self) -> None:
        """Subscribe and begin the first exchange; call on the running event loop."""
        self._loop = asyncio.get_running_loop()
        self._mailbox.open(self._bus, self._schedule)
        # The station shows who is connected, until this process is gone.
        self._presence = self._bus.alive(keys.ALIVE.format(principal=self.requests.principal))
        self._timers["check"] = self._loop.call_later(CHECK_S, self._check_again)
        self._begin_attach()

    async def idle(self) -> None:
        """Wait until no exchange with the station is under way."""
        while self._tasks:
            await asyncio.gather(*self._tasks, return_exceptions=True)

    def close(self) -> None:
        """Leave the bus; what comes later is ignored."""
        self._mailbox.close()
        if self._presence is not None:
            self._presence.close()
        for timer in self._timers.values():
            timer.cancel()
        for task in self._tasks:
            task.cancel()
        self.requests.close()
        self._loop = None

    @property
    def silent_s(self) -> float:
        """Time since the last status."""
        return self._mailbox.silent_s

    @property
    def station_ended(self) -> bool:
        """Whether the station's last status reported that an operator ended it: nothing starts it again."""
        return self.status is not None and self.status.ending

    @property
    def unreadable(self) -> int:
        """Number of samples that could not be decoded."""
        return self._mailbox.unreadable

    @property
    def alarms(self) -> tuple[wire.Alarm, ...]:
        """The station's alarms, worst first; none while it is silent, for then nothing is known."""
        return self.status.alarms if self.status is not None and not self.station_lost else ()

    def action_context(self) -> ActionContext:
        """What actions look at to decide whether they can do anything now."""
        return ActionContext(self.status, self.frame, self.selection.ids, self.requests.read_only, self.station_lost)

    def shown_vehicles(self) -> tuple[int, ...]:
        """Return the selected vehicles; all that are heard while none is selected."""
        return self.selection.ids or (self.frame.ids if self.frame is not None else ())

    def known_vehicles(self) -> KnownVehicles:
        """What names of vehicles can mean now."""
        ids = self.frame.ids if self.frame is not None else ()
        members = {team.name: team.members for team in self.status.teams} if self.status is not None else {}
        here = {name: tuple(v for v in vehicles if v in ids) for name, vehicles in members.items()}
        return KnownVehicles(ids, here, self.selection.groups, self.selection.ids)

    def show_notice(self, notice: Notice) -> None:
        """Show the operator a notice on every screen; an empty text ends it."""
        self.notice = notice
        self._listeners.post(posted.NoticeChanged())

    def show_live(self, news: Notice) -> None:
        """Show what is to be known of the stations that fly, on every screen; see `LiveWatch.news`."""
        if news != self.live:
            self.live = news
            self._listeners.post(posted.LiveNewsChanged())

    def note(self, text: str, severity: int) -> None:
        """Write what the operator was shown to the station's journal; it is kept while the station is not heard."""
        self.notes.add(text, severity)
        if self._loop is not None:
            self.notes.send_soon()

    async def traffic(self) -> tuple[TrafficRow, ...]:
        """Return the aircraft that vehicles' receivers hear; none when the station does not answer."""
        return (await self.requests.send(GetTraffic())).traffic

    async def on_board(self, vehicles: tuple[int, ...]) -> tuple[OnBoardRow, ...]:
        """Return the plans that the station knows these vehicles to hold; none when it does not answer."""
        return (await self.requests.send(GetOnBoard(vehicles))).on_board

    def deliver(self) -> None:
        """Empty the mailbox and post what changed."""
        if self._loop is None:
            return
        self._last_delivery = self._loop.time()
        # A full queue of writes blocks the loop: 6.7 s were measured with a stalled terminal (docs/terminal.md B4).
        if not self._may_paint():
            self._lagged = True
            self._schedule()
            return
        if self._lagged:
            self._lagged = False
            self._listeners.post(posted.DisplayLagged())
        # Scenario before status before frame: a message about a vehicle or team finds what it refers to.
        box = self._mailbox
        latest = box.take_latest()
        if (change := box.decoded(latest.get(keys.SCENARIO), wire.ScenarioChanged)) is not None:
            self._take_scenario(change)
        if (status := box.decoded(latest.get(keys.STATUS), wire.StationStatus)) is not None:
            self._take_status(status)
        if (frame := box.decoded(latest.get(keys.FLEET), wire.FleetFrame)) is not None:
            self.frame = frame
            self._listeners.post_if_new("fleet", visible_fleet(frame), posted.FleetUpdated(frame))
        self._take_plans()
        self.events.take([event for data in box.take_events() if (event := box.decoded(data, wire.JournalEvent))])

    def check(self) -> None:
        """Report a silent station; called once a second."""
        if self.silent_s > STATION_LOST_S or self.station_ended:
            self.station_lost = True
            # Again every second, because the second line shows for how long the station has been silent.
            self._listeners.post(posted.StationLost())

    def _check_again(self) -> None:
        if self._loop is not None:
            self.check()
            self._timers["check"] = self._loop.call_later(CHECK_S, self._check_again)

    def _schedule(self) -> None:
        if self._loop is None:
            return
        delay_s = max(0.0, self._last_delivery + self._period_s - self._loop.time())
        self._timers["deliver"] = self._loop.call_later(delay_s, self.deliver)

    def _take_scenario(self, change: wire.ScenarioChanged) -> None:
        self.scenario = change
        self._listeners.post_if_new("scenario", change, posted.ScenarioUpdated(change))

    def _take_status(self, status: wire.StationStatus) -> None:
        # A station that was started anew counts its statuses from 0 again.
        before = self.status
        restarted = before is not None and status.seq < before.seq
        was_lost, self.station_lost = self.station_lost, status.ending
        self.status = status
        if status.ending:
            self._listeners.post(posted.StationLost())
            return
        if _went_back(before, status):
            # Events that wait in the mailbox are from before, or are in the answer to `fill`.
            self._mailbox.take_events()
            self.events.forget()
            self._listeners.post(posted.EventsForgotten())
            self._spawn(self.events.fill())
        if was_lost or restarted:
            self._listeners.forget()
            self._listeners.post(posted.StationBack())
            self.events.begin_again(restarted=restarted)
            self._begin_attach()
        elif self.scenario is None or self.scenario.revision != status.revision or _files_changed(before, status):
            self._begin_attach()  # the first exchange found no station yet, or a change was missed
        self._listeners.post_if_new("status", visible_status(status), posted.StatusUpdated(status))

    def _take_plans(self) -> None:
        new = dict(self.annotations)
        for data in self._mailbox.take_plans():
            plan = self._mailbox.decoded(data, wire.TeamPlan)
            if plan is not None and plan.annotations is not None:
                new[plan.team] = shown(plan.annotations)
        self._take_annotations(new)

    def _take_annotations(self, annotations: dict[str, tuple[wire.Annotation, ...]]) -> None:
        if annotations != self.annotations:
            self.annotations = annotations
            self._listeners.post(posted.PlannerUpdated(annotations))

    def _post_events(self, events: tuple[wire.JournalEvent, ...]) -> None:
        self._listeners.post(posted.EventRaised(events))

    def _post_info(self, info: VehicleInfo) -> None:
        self._listeners.post_if_new("info", visible_info(info), posted.VehicleInfoUpdated())

    def _may_ask(self) -> bool:
        return self._loop is not None and not self.station_lost

    def _begin_attach(self) -> None:
        """Begin a first exchange, unless one is under way."""
        if not self._attaching:
            self._attaching = True
            self._spawn(self._attach())

    async def _attach(self) -> None:
        """Exchange protocol versions, then ask for everything that was published before this console came."""
        hello = await self.requests.send(wire.Hello(protocol=wire.PROTOCOL, who=self.requests.principal))
        if not hello.ok and hello.code is not wire.ReplyCode.NO_ANSWER:
            self.requests.read_only = f"read-only: {hello.text}"
            if self.status is not None:
                self._listeners.post(posted.StatusUpdated(self.status))
        if hello.status is not None and self.status is None:  # the next one is published in half a second
            self._mailbox.note_heard()
            self._take_status(hello.status)
        planners = (await self.requests.send(wire.GetPlanners())).planners
        self.planner_files = {info.name: info for info in planners if info.file}
        scenario = (await self.requests.send(wire.GetScenario())).scenario
        if scenario is not None:
            self._take_scenario(scenario)
        self._take_annotations((await self.requests.send(wire.GetPlan())).annotations or self.annotations)
        # Events last: until they are filled, live ones wait, and the picture is more urgent.
        await self.events.fill()
        self._attaching = False
        self.notes.send_soon()

    def _spawn(self, job: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(job)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


def _went_back(before: wire.StationStatus | None, status: wire.StationStatus) -> bool:
    """Whether the player of a recording went back in time since the last status."""
    old, new = before.replay if before is not None else None, status.replay
    return old is not None and new is not None and old.rewinds != new.rewinds


def _files_changed(before: wire.StationStatus | None, status: wire.StationStatus) -> bool:
    """Whether a planner's file was saved (`tui-gcs planner watch`): it may take other parameters now."""
    return before is not None and bool(before.planner_files) and status.planner_files != before.planner_files
