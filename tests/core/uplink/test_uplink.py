"""The uplink: who may be sent what, and that all of it is recorded."""

import json
from collections.abc import Callable
from pathlib import Path

from tests.core.rigs.rig import SETPOINT, Rig
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.guard.permission import PASS
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import EventClass, JournalEvent
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.records.tlog_reader import read_tlog

MakeRig = Callable[..., Rig]


def test_a_heartbeat_goes_out_once_a_second_from_254_in_sim(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(2).run(10.0)
    flight.close()
    beats = [(t, f.system, f.component) for t, f in read_tlog(tmp_path / "run.tlog") if f.msgid == 0 and f.system > 250]
    assert {(system, component) for _, system, component in beats} == {(254, 190)}
    assert 8 <= len(beats) <= 10


def test_every_frame_to_and_from_a_vehicle_is_in_the_tlog(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(2).flying().run(3.0)
    flight.close()
    frames = list(read_tlog(tmp_path / "run.tlog"))
    ours = [f for _, f in frames if f.system == 254 and f.msgid != 0]
    assert len(ours) == len(flight.sent)
    assert (
        len([f for _, f in frames if f.system != 254])
        == flight.station.picture.fleet.intakes[""].counts("memory")["frames"]
    )


def test_actions_are_journalled_one_by_one_and_set_points_by_the_second(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(2).flying().run(5.0)
    flight.close()
    lines = [json.loads(line) for line in (tmp_path / "run.jsonl").read_text().splitlines()]
    arms = [line for line in lines if line.get("action") == "arm"]
    assert sorted({line["vehicle"] for line in arms}) == [1, 2]
    sums = [line["setpoints"] for line in lines if "setpoints" in line]
    assert sum(sum(s.values()) for s in sums) <= len([1 for _, _, name, _ in flight.sent if name == SETPOINT])
    assert len(sums) >= 3 and all(count <= 6 for s in sums for count in s.values())
    assert [line["seq"] for line in lines if "seq" in line] == [e.seq for e in flight.events()]


def test_nobody_is_addressed_as_system_0_and_the_unknown_are_refused(rig: MakeRig) -> None:
    flight = rig(2).flying()
    flight.ask(m.Hold())
    flight.run(3.0)
    assert {system for _, system, _, _ in flight.sent} == {1, 2}
    before = len(flight.sent)
    flight.station.comms.command_encoder.position(0, PASS, (50.0, 200.0, 30.0))
    flight.station.comms.command_encoder.position(99, PASS, (50.0, 200.0, 30.0))
    flight.tick()
    assert flight.station.comms.uplink.refused["unknown vehicle"] == 2
    assert {s for _, s, _, _ in flight.sent[before:]} <= {1, 2}


def test_live_takes_every_vehicle_sim_only_its_own(rig: MakeRig) -> None:
    flight = rig(1).ready()
    vehicle = flight.station.picture.fleet.vehicles[1]
    assert flight.station.comms.uplink.is_ours(vehicle)
    vehicle.identity.firmware_token = "0123456789abcdef"
    assert not flight.station.comms.uplink.is_ours(vehicle)
    flight.station.comms.uplink._kind = RunKind.LIVE
    assert flight.station.comms.uplink.is_ours(vehicle)


# ---------------------------------------------------------------- events


def test_events_have_no_gaps_and_only_the_newest_are_kept() -> None:
    log = EventLog(VirtualClock())
    heard: list[JournalEvent] = []
    log.listen(heard.append)
    for k in range(2500):
        log.report(EventClass.VEHICLE, "vehicle 1", f"text {k}")
    assert [e.seq for e in heard] == list(range(1, 2501))
    assert [e.seq for e in log.since(0)] == list(range(2001, 2501)), "the newest 500"
    assert log.since(2499)[0].text == "text 2499"


def test_the_same_text_of_the_same_source_is_told_once_in_a_while() -> None:
    clock = VirtualClock()
    log = EventLog(clock)
    for _ in range(100):
        log.report(EventClass.VEHICLE, "vehicle 1", "again", every_s=5.0)
        log.report(EventClass.VEHICLE, "vehicle 2", "again", every_s=5.0)
        clock.advance(0.1)
    assert len(log.since(0)) == 4
