"""The feed: nothing lost that matters, nothing posted that changed nothing."""

import asyncio
from dataclasses import dataclass, field

import pytest

from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import (
    DisplayLagged,
    EventRaised,
    FleetUpdated,
    PlannerUpdated,
    StationBack,
    StationLost,
    StatusUpdated,
)


@dataclass
class Ear:
    """Collects what the feed posts."""

    heard: list[object] = field(default_factory=list)

    def post_message(self, message: object) -> bool:
        self.heard.append(message)
        return True

    def of(self, kind: type) -> list:
        return [message for message in self.heard if isinstance(message, kind)]

    def event_seqs(self) -> list[int]:
        return [event.seq for message in self.of(EventRaised) for event in message.events]


class Setup:
    def __init__(self) -> None:
        self.bus = MemoryBus()
        self.station = FakeStation(self.bus)
        self.clock = VirtualClock()
        self.ear = Ear()
        self.paint = True
        self.feed = Feed(self.bus, "console-1", clock=self.clock, may_paint=lambda: self.paint)
        self.feed.listen(self.ear)

    async def open(self) -> None:
        self.feed.open()
        await self.feed.idle()

    async def settle(self) -> None:
        self.feed.deliver()
        await self.feed.idle()


@pytest.fixture
async def setup():
    setup = Setup()
    yield setup
    setup.feed.close()


async def test_the_first_answer_brings_the_status_so_that_nobody_waits_for_the_next_one() -> None:
    s = Setup()
    await s.open()
    assert s.feed.status is not None and s.feed.status.vehicles == 8
    assert len(s.ear.of(StatusUpdated)) == 1
    assert not s.feed.station_lost and s.feed.silent_s == 0.0


async def test_hello_comes_first(setup: Setup) -> None:
    await setup.open()
    assert setup.station.requests[0] == m.Hello(protocol=m.PROTOCOL, who="console-1")
    assert setup.feed.scenario is not None


async def test_many_frames_between_two_deliveries_are_one_message(setup: Setup) -> None:
    await setup.open()
    setup.station.fly()
    for _ in range(10):
        setup.station.tick(0.1)
    await setup.settle()
    (message,) = setup.ear.of(FleetUpdated)
    assert message.frame.seq == 10


async def test_a_frame_that_looks_the_same_is_not_posted(setup: Setup) -> None:
    await setup.open()
    setup.station.tick(0.1)
    await setup.settle()
    setup.station.tick(0.01)
    await setup.settle()
    assert len(setup.ear.of(FleetUpdated)) == 1
    assert len(setup.ear.of(StatusUpdated)) == 1


async def test_events_from_before_are_asked_for(setup: Setup) -> None:
    setup.station.event("long ago")
    setup.station.event("a while ago")
    await setup.open()
    assert setup.ear.event_seqs() == [0, 1]


async def test_missed_events_are_asked_for_and_come_in_order(setup: Setup) -> None:
    await setup.open()
    setup.station.event("heard")
    await setup.settle()
    setup.station.silent = True
    setup.station.event("dropped on the way")
    setup.station.silent = False
    setup.station.event("heard again")
    await setup.settle()
    assert setup.ear.event_seqs() == [0, 1, 2]
    assert setup.station.requests[-1] == m.GetEvents(after=0)


async def test_event_that_nobody_has_any_more_is_skipped(setup: Setup) -> None:
    await setup.open()
    setup.station.event("heard")
    await setup.settle()
    lost = setup.station.event("gone")
    setup.station.event("heard again")
    setup.feed._mailbox._events.clear()
    setup.station.events.remove(lost)
    setup.bus.publish(keys.EVENT, m.encode(setup.station.events[-1]))
    await setup.settle()
    assert setup.ear.event_seqs() == [0, 2]


async def test_silence_is_said_and_so_is_the_return(setup: Setup) -> None:
    await setup.open()
    setup.station.tick()
    await setup.settle()
    setup.clock.advance(2.9)
    setup.feed.check()
    assert setup.ear.of(StationLost) == []
    setup.clock.advance(0.2)
    setup.feed.check()
    assert setup.feed.station_lost
    assert len(setup.ear.of(StationLost)) == 1
    setup.station.tick()
    await setup.settle()
    assert len(setup.ear.of(StationBack)) == 1
    assert not setup.feed.station_lost


async def test_restarted_station_counts_events_from_zero_again(setup: Setup) -> None:
    await setup.open()
    setup.station.event("before")
    setup.station.event("before too")
    setup.station.seq = 50
    setup.station.tick()
    await setup.settle()
    setup.station.events.clear()
    setup.station.seq = 0
    setup.station.event("after")
    setup.station.tick()
    await setup.settle()
    await setup.settle()
    assert setup.ear.event_seqs() == [0, 1, 0]


async def test_no_answer_is_a_sentence(setup: Setup) -> None:
    setup.station.silent = True
    await setup.open()
    reply = await setup.feed.requests.send(m.Hold(), tries=3)
    assert not reply.ok
    assert reply.text.startswith("the station does not answer")


async def test_unreadable_samples_are_counted(setup: Setup) -> None:
    await setup.open()
    setup.bus.publish(keys.FLEET, b"junk")
    setup.bus.publish(keys.EVENT, b"\xc1")
    await setup.settle()
    assert setup.feed.unreadable == 2
    assert setup.feed.frame is None


async def test_tours_stay_until_a_plan_brings_new_ones(setup: Setup) -> None:
    await setup.open()
    setup.station.fly()
    setup.station.tick()
    await setup.settle()
    bare = m.TeamPlan(team="defend", revision=1, seq=9, t_s=0.0, annotations=None)
    setup.bus.publish(keys.PLAN.format(team="defend"), m.encode(bare))
    await setup.settle()
    assert len(setup.ear.of(PlannerUpdated)) == 1
    assert set(setup.feed.annotations) == {"defend", "attack"}


async def test_nothing_is_posted_to_a_terminal_that_does_not_read(setup: Setup) -> None:
    await setup.open()
    setup.ear.heard.clear()
    setup.paint = False
    setup.station.event("kept")
    for _ in range(5):
        setup.station.tick()
        setup.feed.deliver()
    assert setup.ear.heard == []
    setup.paint = True
    await setup.settle()
    assert setup.ear.event_seqs() == [0]
    assert len(setup.ear.of(FleetUpdated)) == 1
    assert len(setup.ear.of(DisplayLagged)) == 1


async def test_samples_from_another_thread_wake_the_loop(setup: Setup) -> None:
    await setup.open()
    await asyncio.to_thread(setup.station.tick)
    while not setup.ear.of(FleetUpdated):
        await asyncio.sleep(0)
    assert setup.feed.frame is not None
