"""Unconfirmed systems: which sent heartbeats only, and which of these are removed."""

import math
from typing import Any

import pytest

from tests.core.rigs.vehicles import a_vehicle
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.fleet.identity.unconfirmed_systems import (
    CONFIRMATION_TIMEOUT_S,
    GROUP_WARNING_SIZE,
    SILENCE_BEFORE_REMOVAL_S,
    UnconfirmedSystemMonitor,
)
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.sources import Stream
from tui_gcs.core.records.event_log import EventLog


def unconfirmed(number: int = 1, **traits: Any) -> Vehicle:
    """First heard at 0, last at 1 s."""
    vehicle = a_vehicle(number, first_heard_s=0.0, **traits)
    vehicle.path.autopilot_stream = Stream(vehicle.path.source)
    vehicle.path.autopilot_stream.last_heard_s = 1.0
    return vehicle


def removed(vehicle: Vehicle, now: float) -> bool:
    return UnconfirmedSystemMonitor(EventLog(VirtualClock())).look([vehicle], now) == [vehicle]


def test_a_silent_unconfirmed_system_is_removed_after_a_minute() -> None:
    assert not removed(unconfirmed(), 1.0 + SILENCE_BEFORE_REMOVAL_S)
    assert removed(unconfirmed(), 1.1 + SILENCE_BEFORE_REMOVAL_S)


@pytest.mark.parametrize(
    "traits",
    [{"armed": True}, {"identified": True}, {"position_m": (0.0, 0.0, 0.0)}, {"keyed": True}, {"high_latency_s": 1.0}],
    ids=lambda traits: next(iter(traits)),
)
def test_a_confirmed_or_armed_system_is_not_removed(traits: dict[str, Any]) -> None:
    assert not removed(unconfirmed(**traits), math.inf)


def test_a_large_group_is_reported_once_a_minute() -> None:
    clock = VirtualClock()
    events = EventLog(clock)
    watch = UnconfirmedSystemMonitor(events)
    few, crowd = (
        [unconfirmed(n) for n in range(1, GROUP_WARNING_SIZE)],
        [unconfirmed(n) for n in range(1, GROUP_WARNING_SIZE + 1)],
    )
    clock.advance(CONFIRMATION_TIMEOUT_S)
    watch.look(crowd, clock.now())
    assert not events.since(0, 10), "they may be booting"
    clock.advance(1.0)
    watch.look(few, clock.now())
    assert not events.since(0, 10), "a few slow ones"
    for _ in range(30):
        watch.look(crowd, clock.now())
        clock.advance(1.0)
    assert [e.text for e in events.since(0, 10)] == [
        f"{GROUP_WARNING_SIZE} vehicles are nothing but heartbeats: forged, or links that are too slow"
    ]
