"""Parts of file transfers: byte ranges, round trips, packets, names on our disk, metadata of PX4."""

import json
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from tests.core.rigs.ftp_peer import OPEN, FtpServer, describing_px4
from tests.core.rigs.param_peer import INT32, ParamServer
from tests.core.rigs.service_asking import ask, task
from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.base.safe_files import SafeFolder
from tui_gcs.core.protocol import services as s
from tui_gcs.core.services.files.byte_ranges import ByteRanges
from tui_gcs.core.services.files.ftp_codec import PAYLOAD_BYTES, Op, pack, unpack
from tui_gcs.core.services.files.ftp_edit import entry_of
from tui_gcs.core.services.vehicle import component_metadata as metadata
from tui_gcs.core.uplink.jobs import JobState
from tui_gcs.core.uplink.rtt_estimator import MAX_WAIT_S, RttEstimator


@given(st.lists(st.tuples(st.integers(0, 60), st.integers(0, 60)), max_size=30))
def test_ranges_are_a_set_of_numbers(pieces: list[tuple[int, int]]) -> None:
    ranges, numbers = ByteRanges(), set[int]()
    for start, end in pieces:
        new = set(range(start, end)) - numbers
        assert ranges.add(start, end) == len(new)
        numbers |= new
        assert ranges.held == len(numbers)
        first = next(i for i in range(100) if i not in numbers)
        later = [i for i in numbers if i > first]
        assert ranges.first_gap() == (first, min(later) if later else None)
        assert ranges.end == max(numbers, default=-1) + 1
        assert ranges.covers(first) and not ranges.covers(first + 1)


def test_waits_follow_the_answers_and_grow_while_there_are_none() -> None:
    trip = RttEstimator()
    first = trip.wait_s
    for _ in range(20):
        trip.add_sample(0.02)
    assert trip.wait_s < first
    for _ in range(20):
        trip.add_loss()
    assert trip.wait_s == MAX_WAIT_S
    for _ in range(20):
        trip.add_sample(0.8)
    assert 0.8 < trip.wait_s < 2.0


@given(st.binary(min_size=PAYLOAD_BYTES, max_size=PAYLOAD_BYTES))
def test_any_packet_is_read(payload: bytes) -> None:
    packet = unpack(payload)
    assert len(packet.data) <= 239
    assert isinstance(packet.why, str) and packet.nak >= 0


def test_a_packet_is_as_the_guide_has_it() -> None:
    raw = bytes(pack(0x1234, 7, Op.WRITE, 3, 0x01020304, b"abc"))
    assert raw[:16] == bytes([0x34, 0x12, 7, 7, 3, 0, 0, 0, 4, 3, 2, 1]) + b"abc\0" and len(raw) == PAYLOAD_BYTES


@given(st.binary(max_size=250))
def test_any_entry_is_read_or_skipped(raw: bytes) -> None:
    entry = entry_of(raw)
    assert entry is None or ((entry.size is None or entry.size >= 0) and entry.name.isprintable())


def test_a_file_gets_its_name_when_it_is_whole_and_overwrites_none(tmp_path: Path) -> None:
    with SafeFolder(tmp_path / "d") as folder:
        for number in range(3):
            part = folder.part("log.bin")
            part.write(0, bytes([number]))
            assert (tmp_path / "d/log.bin.part").exists()
            assert part.finish() == ("log.bin" if number == 0 else f"log-{number + 1}.bin")
        assert sorted(folder.names()) == ["log-2.bin", "log-3.bin", "log.bin"]
    assert (tmp_path / "d/log.bin").read_bytes() == b"\0"


def describing(tmp_path: Path, text: bytes) -> tuple[ServiceRig, FtpServer]:
    """A PX4 with parameters.json.xz."""
    peer, server = describing_px4(text)
    return ServiceRig(tmp_path, peer).heard(), server


TEXT = json.dumps({"parameters": [{"name": "GF_ACTION", "type": "Int32", "min": 0, "max": 5}]}).encode()


def test_metadata_is_fetched_from_the_vehicle_and_kept_by_checksum(tmp_path: Path) -> None:
    rig, server = describing(tmp_path, TEXT)
    job = rig.station.services.metadata.fetch(1, metadata.PARAMETERS)
    rig.until(lambda: job.over, 10.0)
    assert job.data == TEXT and job.state is JobState.DONE
    again = rig.station.services.metadata.fetch(1, metadata.PARAMETERS)
    rig.until(lambda: again.over, 10.0)
    assert again.data == TEXT
    assert [data.decode()[-15:] for _, op, _, _, data in server.asked if op == OPEN] == [
        "general.json.xz",
        "rameters.json.xz"[-15:],
        "general.json.xz",
    ]


def described(tmp_path: Path, text: bytes) -> tuple[ServiceRig, ParamServer]:
    rig, _ = describing(tmp_path, text)
    return rig, ParamServer(rig.peers[1], {"GF_ACTION": (INT32, 2), "COM_OBL_RC_ACT": (INT32, 0)})


def set_by_request(rig: ServiceRig, name: str, value: float, **how: bool) -> str:
    """What an operator reads of a setting."""
    number = ask(rig, s.SetParams((1,), {name: value}, **how)).tasks[0].number
    rig.until(lambda: task(rig, number).state in ("done", "failed", "cancelled"), 20.0)
    return task(rig, number).text


LISTED = {"name": "COM_OBL_RC_ACT", "type": "Int32", "values": [{"value": 0, "description": "Position mode"}]}


def test_a_setting_reads_the_ranges_first_and_keeps_to_them(tmp_path: Path) -> None:
    ranged = {"name": "GF_ACTION", "type": "Int32", "min": 0, "max": 5}
    rig, server = described(tmp_path, json.dumps({"parameters": [ranged, LISTED]}).encode())
    assert set_by_request(rig, "GF_ACTION", 77) == "GF_ACTION: must be within 0 to 5"
    assert set_by_request(rig, "COM_OBL_RC_ACT", 99) == "COM_OBL_RC_ACT: must be one of 0 (Position mode)"
    assert server.params["GF_ACTION"][1] == 2 and server.params["COM_OBL_RC_ACT"][1] == 0
    assert set_by_request(rig, "GF_ACTION", 78, beyond_range=True) == "" and server.params["GF_ACTION"][1] == 78
    assert set_by_request(rig, "GF_ACTION", 3) == ""


def test_where_no_ranges_can_be_read_the_result_says_so(tmp_path: Path) -> None:
    rig, server = described(tmp_path, b"nonsense")
    assert set_by_request(rig, "GF_ACTION", 3) == "range not checked: its description cannot be read"
    assert server.params["GF_ACTION"][1] == 3


def test_a_setting_that_waits_for_the_ranges_can_be_cancelled(tmp_path: Path) -> None:
    rig, server = described(tmp_path, b"{}")
    number = ask(rig, s.SetParams((1,), {"GF_ACTION": 3})).tasks[0].number
    assert ask(rig, s.CancelTask(number)).ok
    rig.run(5.0)
    assert task(rig, number).state == "cancelled" and server.params["GF_ACTION"][1] == 2


def test_a_vehicle_without_metadata_is_given_up_on(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    job = rig.station.services.metadata.fetch(1, metadata.EVENTS)
    rig.until(lambda: job.over, 15.0)
    assert job.error == "the vehicle does not say where they are"
