"""A vehicle is heard at another address: is it the same one? The whole station in lock-step."""

import pytest

from tests.core.rigs import orders
from tests.core.rigs.wires import MakeWired, Wire, Wired, apart
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.records.event_log import NOTICE, WARNING


def moving(wired: MakeWired) -> tuple[Wired, dict[str, Address]]:
    """A vehicle whose address can be changed."""
    now: dict[str, Address] = {"place": ("sim", 0)}
    return wired(1, wires=[Wire("near", place=lambda fleet, index: now["place"])]), now


def test_on_the_ground_a_new_address_is_taken_after_three_seconds_and_asked_first(wired: MakeWired) -> None:
    flight, now = moving(wired)
    flight.run(20.0)
    now["place"] = ("sim", 5)
    flight.run(2.8)
    assert flight.vehicle().address == ("sim", 0)
    since_s = flight.clock.now()
    flight.until(lambda: flight.vehicle().address == ("sim", 5), 1.5)
    flight.run(3.0)
    assert flight.vehicle().identity.identified and not flight.vehicle().why_not_commanded
    assert set(flight.names(flight.wires[0], since_s)) <= {"HEARTBEAT", "COMMAND_LONG", "TIMESYNC"}
    assert set(flight.commands(flight.wires[0], since_s)) <= {511, 512}
    assert flight.vehicle().integrity.reboots == 0


def test_nothing_but_stops_goes_to_an_address_that_does_not_say_who_it_is(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near")]).run(20.0)
    flight.sim.silence(0)
    flight.run(4.0)
    fields = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
    for _ in range(20):
        flight.wires[0].link.inject(flight.outgoing.encode("HEARTBEAT", **fields), ("elsewhere", 1))
        flight.run(0.5)
    assert flight.vehicle().address == ("elsewhere", 1)
    assert "asked for its identity" in flight.vehicle().why_not_commanded
    since_s = flight.clock.now()
    flight.station.comms.commands.submit(orders.prepare(flight, 1))
    flight.run(0.5)
    assert 176 not in flight.commands(flight.wires[0], since_s)


def test_in_flight_a_new_address_is_followed_because_it_is_the_same_vehicle(wired: MakeWired) -> None:
    flight, now = moving(wired)
    flight.flying().run(5.0)
    now["place"] = ("sim", 5)
    flight.until(lambda: flight.vehicle().address == ("sim", 5), 5.0)
    flight.run(2.0)
    assert flight.phase(1) is Phase.FLYING and flight.vehicle().integrity.reboots == 0
    since_s = flight.clock.now()
    flight.run(2.0)
    assert len(flight.sent_to(1, since_s=since_s)) >= 8
    assert [e.severity for e in flight.events() if e.text.endswith("the same vehicle")] == [NOTICE]


@pytest.mark.long
@pytest.mark.parametrize("uid", ["other", "none"])
def test_in_flight_another_vehicle_does_not_inherit_the_flight(wired: MakeWired, uid: str) -> None:
    """The one that flies falls silent; a second one with its id is switched on, on the ground."""
    flight = wired(1, wires=[Wire("near", place=apart)]).flying().run(5.0)
    flight.remove(0)
    flight.run(1.0)
    flight.stranger(age_s=30.0)
    if uid == "none":
        flight.same_uid()
        flight.vehicle().identity.uid = ""
    flight.run(20.0)
    assert flight.phase(1) is Phase.TAKEN_OUT
    assert flight.vehicle().telemetry.armed, "what the newcomer says is not taken for ours"
    assert "LOST in the air: vehicle 1" in flight.status().alarm
    assert any("another" in e.text for e in flight.events() if e.severity <= WARNING)
    flight.sim.unsilence(0)
    flight.run(20.0)
    assert flight.phase(1) in (Phase.FLYING, Phase.HOLDING)
    assert flight.vehicle().address == ("fleet 0", 0)


def test_on_the_ground_another_vehicle_takes_the_id_over_and_nothing_of_the_old_one(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near", place=apart)]).run(20.0)
    before = flight.vehicle().identity.uid
    flight.remove(0)
    flight.stranger(age_s=30.0)
    flight.run(10.0)
    vehicle = flight.vehicle()
    assert vehicle.identity.uid != before and vehicle.address == ("fleet 1", 0)
    assert any("another vehicle has id 1 now" in text for text in flight.texts("vehicle 1"))
    flight.until(lambda: not flight.station.frontend.readiness.why_not_start(1), 30.0, "the newcomer may start")
