"""EVENTs of PX4: in sequence, lost ones requested again, reported once, and the reasons of a refused arming."""

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.service_rig import GCS, PX4, Fields, Peer, ServiceRig
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.services.vehicle.component_metadata import MetadataJob
from tui_gcs.core.services.vehicle.event_metadata import EventMetadata, parse
from tui_gcs.core.services.vehicle.vehicle_events import MAX_MISSING, VehicleEvents
from tui_gcs.core.uplink.jobs import JobState

COMPONENT = 1 << 24
ARMED, DENIED, SUMMARY, NO_GPS, NO_STICKS, HEALTH, FAILSAFE = (COMPONENT | n for n in range(1, 8))
HOLD, OFFBOARD = 0x3040000, 0x60000
HOLD_BIT, OFFBOARD_BIT = 1 << 4, 1 << 14


def metadata() -> EventMetadata:
    return parse(metadata_file())


def serve(events: VehicleEvents, peer: Peer, after_s: float) -> None:
    """The vehicle's file arrives a little after it was requested."""

    def fetch(vehicle: int, kind: int, on_done: Callable[[MetadataJob], None]) -> None:
        job = MetadataJob(events._files, vehicle, kind)
        job.data, job.state = metadata_file(), JobState.DONE
        peer.after(after_s, lambda: on_done(job))

    events._files.fetch = fetch  # type: ignore[method-assign, assignment]


def metadata_file() -> bytes:
    modes, index = {"name": "modes", "type": "uint32_t"}, {"name": "i", "type": "uint8_t"}
    summary = [{"name": "chunk", "type": "uint8_t"}] + [{"name": n, "type": "uint32_t"} for n in ("e", "w", "a", "r")]

    def events(**by_id: dict[str, Any]) -> dict[str, Any]:
        return {"events": {name[1:]: event for name, event in by_id.items()}}

    groups = {
        "default": events(
            _1={"message": "Armed by {1}", "arguments": [index]},
            _2={"message": "Arming denied: Resolve system health failures first"},
            _7={"message": "Failsafe activated", "type": "append_health_and_arming_messages"},
        ),
        "arming_check": events(
            _3={"message": "summary", "type": "summary", "arguments": summary},
            _4={"message": "No valid position estimate", "arguments": [modes, index]},
            _5={"message": "No manual control input", "arguments": [modes, index]},
        ),
        "health": events(_6={"message": "health summary", "type": "summary", "arguments": summary[:4]}),
    }
    component = {
        "namespace": "px4",
        "event_groups": groups,
        "navigation_mode_groups": {"groups": {"4": [HOLD], "14": [OFFBOARD]}},
    }
    return json.dumps({"version": 2, "components": {"1": component}}).encode()


class Teller(Peer):
    """A PX4 that keeps its newest EVENTs, and repeats them on request."""

    def __init__(self, keeps: int = 20) -> None:
        super().__init__(1, autopilot=PX4, custom_mode=HOLD)
        self.keeps = keeps
        self.sequence = 0
        self.said: dict[int, dict[str, Any]] = {}
        self.answers = {"REQUEST_EVENT": Teller.again}

    def event(self, number: int, arguments: bytes = b"", level: int = 4, *, lost: bool = False, to: int = 0) -> int:
        sequence = self.sequence
        fields = {
            "id": number,
            "event_time_boot_ms": 1,
            "sequence": sequence,
            "destination_component": 0,
            "destination_system": to,
            "log_levels": level << 4 | level,
            "arguments": list(arguments.ljust(40, b"\0")),
        }
        self.said[sequence] = fields
        self.said = dict(list(self.said.items())[-self.keeps :])
        self.sequence = (sequence + 1) % 65536
        if not lost:
            self.say("EVENT", **fields)
        return sequence

    def report(self, can_arm: int, *, lost: tuple[int, ...] = ()) -> None:
        """Summary, two checks, health summary; `lost` are places in it."""
        parts = [
            (SUMMARY, struct.pack("<BIIII", 0, 0, 0, can_arm, can_arm), 8),
            (NO_GPS, struct.pack("<IB", HOLD_BIT, 1), 3),
            (NO_STICKS, struct.pack("<IB", 0xFFFFFFFF, 1), 4),
            (HEALTH, struct.pack("<BIII", 0, 0, 0, 0), 8),
        ]
        for place, (number, arguments, level) in enumerate(parts):
            self.event(number, arguments, level, lost=place in lost)

    def current(self, flags: int = 0) -> None:
        self.say("CURRENT_EVENT_SEQUENCE", sequence=(self.sequence - 1) % 65536, flags=flags)

    def again(self, fields: Fields) -> None:
        sequence = fields["first_sequence"]
        while True:
            if sequence in self.said:
                self.say("EVENT", **self.said[sequence])
            else:
                oldest = next(iter(self.said))
                self.say_to_us("RESPONSE_EVENT_ERROR", sequence=sequence, sequence_oldest_available=oldest, reason=0)
            if sequence == fields["last_sequence"]:
                return
            sequence = (sequence + 1) % 65536


@pytest.fixture
def rig(tmp_path: Path) -> ServiceRig:
    return ServiceRig(tmp_path, Teller()).heard()


def parts(rig: ServiceRig) -> tuple[Teller, VehicleEvents]:
    peer, events = rig.peers[1], rig.station.services.vehicle_events
    assert isinstance(peer, Teller)
    events.learn(rig.vehicle(), metadata())
    return peer, events


def told(rig: ServiceRig) -> list[str]:
    return [text for text in rig.texts("vehicle 1") if "heard on" not in text]


def asked(peer: Peer) -> list[tuple[int, int]]:
    return [(f["first_sequence"], f["last_sequence"]) for f in peer.got("REQUEST_EVENT")]


def test_an_event_is_reported_as_text(rig: ServiceRig) -> None:
    peer, _ = parts(rig)
    peer.event(ARMED, b"\x04", 6)
    rig.run(0.1)
    assert told(rig) == ["Armed by 4"]
    assert asked(peer) == []


def test_without_metadata_only_errors_are_reported_by_number(rig: ServiceRig) -> None:
    peer, events = rig.peers[1], rig.station.services.vehicle_events
    assert isinstance(peer, Teller)
    wanted: list[int] = []
    events._files.fetch = lambda vehicle, kind, on_done: wanted.append(vehicle)  # type: ignore[method-assign]
    peer.event(ARMED, level=6)
    rig.run(0.1)
    assert not wanted, "a file is fetched only for what matters"
    for _ in range(3):
        peer.event(NO_GPS, level=2)
        rig.run(0.1)
    assert not told(rig), "it may be told in words yet"
    rig.run(8.0)
    assert told(rig) == ["event 0x01000004 (no metadata)"]
    assert wanted == [1]
    assert events.ignored["event without metadata"] == 1


def test_earlier_events_are_reported_as_text_as_soon_as_the_metadata_is_there(rig: ServiceRig) -> None:
    peer, events = rig.peers[1], rig.station.services.vehicle_events
    assert isinstance(peer, Teller)
    serve(events, peer, after_s=1.0)
    peer.event(DENIED, level=2)
    rig.run(0.5)
    assert not told(rig)
    rig.run(1.0)
    assert told(rig) == ["Arming denied: Resolve system health failures first"]


@pytest.mark.parametrize("start", [0, 65533], ids=["plain", "wraps"])
def test_a_gap_is_requested_at_once_and_each_event_is_reported_once(rig: ServiceRig, start: int) -> None:
    peer, events = parts(rig)
    peer.sequence = start
    peer.event(ARMED, b"\x00", 6)
    for number in (1, 2, 3):
        peer.event(ARMED, bytes([number]), 6, lost=True)
    peer.event(ARMED, b"\x04", 6)
    rig.run(0.2)
    assert asked(peer) == [((start + 1) % 65536, (start + 3) % 65536)]
    assert sorted(told(rig)) == [f"Armed by {n}" for n in range(5)]
    assert events.lost == 0


def test_the_newest_number_shows_that_the_last_event_was_lost(rig: ServiceRig) -> None:
    peer, _ = parts(rig)
    peer.event(ARMED, b"\x00", 6)
    peer.event(ARMED, b"\x01", 6, lost=True)
    rig.run(1.0)
    assert told(rig) == ["Armed by 0"]
    peer.current()
    rig.run(0.2)
    assert told(rig) == ["Armed by 0", "Armed by 1"]


def test_old_events_of_a_vehicle_just_met_are_not_fetched(rig: ServiceRig) -> None:
    peer, _ = parts(rig)
    peer.sequence = 500
    peer.current()
    peer.event(ARMED, b"\x01", 6)
    rig.run(3.0)
    assert asked(peer) == []


def test_what_the_vehicle_has_no_more_is_given_up_counted_and_reported(rig: ServiceRig) -> None:
    peer, events = parts(rig)
    peer.keeps = 2
    peer.event(ARMED, b"\x00", 6)
    for number in range(1, 6):
        peer.event(ARMED, bytes([number]), 6, lost=True)
    peer.event(ARMED, b"\x06", 6)
    rig.run(5.0)
    assert events.lost == 4
    assert told(rig).count("some of its events were lost on the way") == 1
    assert "Armed by 5" in told(rig), "one of the five was still there"
    assert len(asked(peer)) <= 3


def test_a_vehicle_that_never_answers_is_asked_for_ten_seconds(rig: ServiceRig) -> None:
    peer, events = parts(rig)
    peer.answers = {}
    peer.event(ARMED, b"\x00", 6)
    peer.event(ARMED, b"\x01", 6, lost=True)
    peer.event(ARMED, b"\x02", 6)
    rig.run(15.0)
    assert asked(peer) == [(1, 1)] * 20
    assert events.lost == 1


def test_thirty_percent_loss_loses_no_event(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Teller(), loss=0.3, seed=5).heard()
    peer, _ = parts(rig)
    for number in range(40):
        peer.event(ARMED, bytes([number]), 6)
        rig.run(0.5)
        if number % 6 == 0:
            peer.current()
    for _ in range(4):
        peer.current()
        rig.run(3.0)
    assert {f"Armed by {n}" for n in range(1, 40)} <= set(told(rig))


def test_wild_sequence_numbers_cost_a_few_questions_a_second(rig: ServiceRig) -> None:
    peer, events = parts(rig)
    for number in range(200):
        peer.sequence = (number * 7919) % 65536
        peer.event(ARMED, b"\x01", 6)
        rig.step()
    assert len(asked(peer)) <= 20
    assert len(events._records[1].kept) <= 64 and len(events._records[1].missing) <= MAX_MISSING


def test_a_restarted_vehicle_counts_anew(rig: ServiceRig) -> None:
    peer, _ = parts(rig)
    peer.sequence = 300
    peer.event(ARMED, b"\x00", 6)
    rig.run(0.2)
    peer.sequence, peer.said = 0, {}
    peer.event(ARMED, b"\x01", 6)
    peer.current(flags=1)
    rig.run(0.5)
    peer.event(ARMED, b"\x02", 6)
    rig.run(0.5)
    assert told(rig) == ["Armed by 0", "Armed by 1", "Armed by 2"]


def test_events_for_another_station_are_not_ours(rig: ServiceRig) -> None:
    peer, events = parts(rig)
    peer.event(ARMED, b"\x01", 6, to=77)
    peer.event(ARMED, b"\x02", 6, to=GCS)
    rig.run(0.2)
    assert events.ignored["event for another station"] == 1
    assert told(rig)[-1] == "Armed by 2"


# ---------------------------------------------------------------- texts that come twice


def test_a_fleet_of_one_firmware_fetches_its_metadata_once(tmp_path: Path) -> None:
    """250 vehicles that connect together do not queue 250 files before the first plan."""
    peers = [Teller(), Teller(), Teller()]
    for system, peer in enumerate(peers, start=1):
        peer.system, peer.encoder = system, Encoder(system, 1)
    rig = ServiceRig(tmp_path, *peers).heard()
    events, fetched = rig.station.services.vehicle_events, []
    serve(events, peers[0], after_s=1.0)
    serving = events._files.fetch

    def fetch(vehicle: int, kind: int, on_done: Any) -> None:
        fetched.append(vehicle)
        serving(vehicle, kind, on_done)

    events._files.fetch = fetch  # type: ignore[method-assign, assignment]
    for system, token in ((1, "aa"), (2, "aa"), (3, "bb")):
        vehicle = rig.vehicle(system)
        vehicle.identity.identified, vehicle.identity.firmware_token = True, token
    for peer in peers:
        peer.event(DENIED, level=2)
    rig.run(0.5)
    assert fetched == [1, 3], "the third has another firmware"
    rig.run(2.0)
    assert all(events.knows(rig.vehicle(system)) for system in (1, 2, 3))
    for system in (1, 2, 3):
        assert rig.texts(f"vehicle {system}")[-1] == "Arming denied: Resolve system health failures first"


def test_over_a_radio_metadata_is_fetched_for_a_refusal_only(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Teller(), bytes_per_s=4000).heard()
    peer, events, wanted = rig.peers[1], rig.station.services.vehicle_events, []
    assert isinstance(peer, Teller)
    events._files.fetch = lambda vehicle, kind, on_done: wanted.append(vehicle)  # type: ignore[method-assign]
    peer.event(DENIED, level=2)
    rig.run(1.0)
    assert not wanted and told(rig) == ["event 0x01000002 (no metadata)"]
    peer.ack(400, 1)
    rig.run(1.0)
    assert wanted == [1]


def test_a_vehicle_without_events_is_not_asked_for_metadata_when_it_refuses(rig: ServiceRig) -> None:
    """ArduPilot sends its reasons as texts."""
    events, wanted = rig.station.services.vehicle_events, []
    events._files.fetch = lambda vehicle, kind, on_done: wanted.append(vehicle)  # type: ignore[method-assign]
    rig.peers[1].ack(400, 4)
    rig.run(1.0)
    assert not wanted


@pytest.mark.parametrize("event_first", [True, False])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Armed by external command\t", "Armed by external command"),
        ("command denied during calibration: 241\t", "Command denied during calibration: 241"),
        ("IGN MISSION_ITEM: Invalid item\t", "Ignoring mission item, invalid item"),
        ("RTL: unsupported MAV_FRAME\t", "RTL: unsupported MAV_FRAME (6)"),
        ("[logger] ./log/2026-11-21/10_59_22.ulg\t", "logging: opening log file 2026-11-21/10_59_22.ulg"),
    ],
)
def test_a_text_that_is_an_event_too_is_reported_once(
    rig: ServiceRig, text: str, message: str, event_first: bool
) -> None:
    """Wording as on a real PX4; either may be first (px4-services.tlog)."""
    texts, vehicle = rig.station.picture.fleet.texts, rig.vehicle()
    if event_first:
        texts.take_event(vehicle, 3, message)
    rig.peers[1].say("STATUSTEXT", severity=2, text=text.encode())
    rig.run(0.1)
    if not event_first:
        texts.take_event(vehicle, 3, message)
    assert told(rig) == [message if event_first else text.strip()]


def test_an_event_with_more_than_its_text_is_reported_too(rig: ServiceRig) -> None:
    """A real PX4 that lost its GPS in flight: the operator read "Failsafe activated", and no more."""
    rig.peers[1].say("STATUSTEXT", severity=2, text=b"Failsafe activated\t")
    rig.run(0.1)
    why = "Failsafe activated: Autopilot disengaged, switching to Descend"
    rig.station.picture.fleet.texts.take_event(rig.vehicle(), 2, why)
    assert told(rig) == ["Failsafe activated", why]
    assert rig.vehicle().failsafe_words(0.0) == "Autopilot disengaged, switching to Descend"


def test_a_text_with_a_tab_and_no_event_is_reported(rig: ServiceRig) -> None:
    rig.station.picture.fleet.texts.take_event(rig.vehicle(), 6, "Takeoff detected")
    rig.peers[1].say("STATUSTEXT", severity=6, text=b"Landing at destination\t")
    rig.peers[1].say("STATUSTEXT", severity=6, text=b"Takeoff detected")
    rig.run(0.1)
    assert told(rig)[:2] == ["Takeoff detected", "Landing at destination"]


# ---------------------------------------------------------------- arming


def test_the_arming_report_has_the_modes_that_can_arm_and_the_reasons(rig: ServiceRig) -> None:
    peer, events = parts(rig)
    vehicle = rig.vehicle()
    assert events.can_arm(vehicle) is None
    peer.report(can_arm=OFFBOARD_BIT)
    rig.run(0.2)
    assert events.can_arm(vehicle) is False and events.can_arm(vehicle, OFFBOARD) is True
    assert events.reasons(vehicle) == ["No valid position estimate", "No manual control input"]
    assert events.reasons(vehicle, OFFBOARD) == []
    assert told(rig) == [], "checks are a report, not news"
    peer.report(can_arm=HOLD_BIT | OFFBOARD_BIT)
    rig.run(0.2)
    assert events.can_arm(vehicle) is True


@pytest.mark.parametrize("lost", [(0,), (1,), (3,), (0, 1, 2)])
def test_a_report_with_a_hole_waits_for_what_was_lost(rig: ServiceRig, lost: tuple[int, ...]) -> None:
    peer, events = parts(rig)
    peer.event(ARMED, level=6)
    peer.report(can_arm=0, lost=lost)
    rig.until(lambda: bool(peer.got("REQUEST_EVENT")) or 3 not in lost or (peer.current() or False), 1.0)
    rig.run(0.2)
    assert events.reasons(rig.vehicle()) == ["No valid position estimate", "No manual control input"]


def test_a_refused_arming_has_its_reasons(rig: ServiceRig) -> None:
    peer, _ = parts(rig)
    peer.report(can_arm=0)
    rig.run(60.0)
    since_s = rig.clock.now()
    peer.ack(400, 1)
    peer.event(DENIED, level=2)
    rig.run(0.1)
    assert set(rig.vehicle().reasons_since(since_s)) == {
        "No valid position estimate",
        "No manual control input",
        "Arming denied: Resolve system health failures first",
    }


def test_a_failsafe_has_its_reasons(rig: ServiceRig) -> None:
    peer, _ = parts(rig)
    peer.report(can_arm=0)
    rig.run(1.0)
    since_s = rig.clock.now()
    peer.event(FAILSAFE, level=2)
    rig.run(0.1)
    assert "No valid position estimate" in rig.vehicle().reasons_since(since_s)


def test_a_refusal_before_we_know_the_checks_is_explained_as_soon_as_we_do(rig: ServiceRig) -> None:
    """The report was sent before we listened: its metadata is fetched, and its last EVENTs are requested."""
    peer, events = rig.peers[1], rig.station.services.vehicle_events
    assert isinstance(peer, Teller)
    serve(events, peer, after_s=0.3)
    peer.silent = True
    peer.event(ARMED, level=6)
    peer.report(can_arm=0)
    peer.silent = False
    peer.current()
    rig.run(1.0)
    peer.ack(400, 1)
    rig.run(1.0)
    assert {"cannot arm: No valid position estimate", "cannot arm: No manual control input"} <= set(told(rig))
    assert events.lost == 0 and len(asked(rig.peers[1])) <= 3, "what was before is no loss"
