"""Parameters: read, set and fetched on both autopilots, over links that lose."""

import math
import struct
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.ftp_peer import FtpServer
from tests.core.rigs.param_peer import INT8, INT32, REAL32, ParamServer
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Peer, ServiceRig
from tui_gcs.core.services.parameters.param_exchange import ParamReading, ParamSetting
from tui_gcs.core.uplink.jobs import JobState

VERSION = {
    "flight_sw_version": 0x04070000,
    "middleware_sw_version": 0,
    "os_sw_version": 0,
    "board_version": 0,
    "vendor_id": 0,
    "product_id": 0,
    "uid": 77,
    **{f"{part}_custom_version": bytes(range(8)) for part in ("flight", "middleware", "os")},
}
REQUEST_MESSAGE = 512


def make(tmp_path: Path, autopilot: int = ARDUPILOT, *, files: bool = False, **how: Any):
    """A rig with one vehicle that reports its hardware id, and its parameters."""
    peer = Peer(1, autopilot=autopilot)
    server = ParamServer(peer)
    if files:
        FtpServer(peer, {"@PARAM/param.pck": server.packed()}, announced=12 * len(server.params))

    def command(peer: Peer, fields: dict[str, Any]) -> None:
        if fields["command"] == REQUEST_MESSAGE and fields["param1"] == 148:
            peer.say("AUTOPILOT_VERSION", capabilities=32 * files, **VERSION)
        if fields["command"] in (511, 512):
            peer.ack(fields["command"])

    peer.answers["COMMAND_LONG"] = command
    rig = ServiceRig(tmp_path, peer, **how).heard()
    rig.until(lambda: rig.vehicle().identity.identified, 10.0)
    return rig, server


def values(rig: ServiceRig) -> dict[str, Any]:
    return {name: param.value for name, param in rig.station.services.params.table(1).params.items()}


def expected(server: ParamServer) -> dict[str, Any]:
    return {name: value for name, (_, value) in server.params.items()}


# ---------------------------------------------------------------- all of them


def test_nothing_is_fetched_unasked(tmp_path: Path) -> None:
    rig, _ = make(tmp_path)
    rig.run(20.0)
    assert not [name for _, name, _ in rig.peers[1].heard if name.startswith(("PARAM", "FILE"))]


def test_ardupilot_serves_them_in_one_file(tmp_path: Path) -> None:
    rig, server = make(tmp_path, files=True)
    job = rig.station.services.params.fetch_all(1)
    took_s = rig.until(lambda: job.over, 10.0)
    assert job.way == "file" and took_s < 1.0
    assert values(rig) == expected(server)
    assert rig.station.services.params.table(1).complete
    assert not rig.peers[1].got("PARAM_REQUEST_LIST")


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_without_files_they_are_listed(tmp_path: Path, autopilot: int) -> None:
    rig, server = make(tmp_path, autopilot)
    job = rig.station.services.params.fetch_all(1)
    rig.until(lambda: job.over, 20.0)
    assert job.state is JobState.DONE and job.way == "list"
    assert values(rig) == expected(server)
    assert len(rig.peers[1].got("PARAM_REQUEST_LIST")) == 1


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(1, 4))])
def test_what_is_lost_of_a_list_is_asked_for_again(tmp_path: Path, autopilot: int, seed: int) -> None:
    rig, server = make(tmp_path, autopilot, loss=0.3, duplicate=0.1, reorder=0.2, seed=seed)
    job = rig.station.services.params.fetch_all(1)
    rig.until(lambda: job.over, 120.0)
    assert job.state is JobState.DONE, job.error
    assert values(rig) == expected(server)


def test_a_broken_file_is_no_loss(tmp_path: Path) -> None:
    rig, server = make(tmp_path, files=True)
    FtpServer(rig.peers[1], {"@PARAM/param.pck": b"\x1b\x67\x05\x00\x05\x00broken"})
    job = rig.station.services.params.fetch_all(1)
    rig.until(lambda: job.over, 20.0)
    assert job.way == "list" and job.notes[-1].startswith("file: ")
    assert values(rig) == expected(server)


def test_px4s_are_kept_and_compared_by_checksum(tmp_path: Path) -> None:
    rig, server = make(tmp_path, PX4)
    first = rig.station.services.params.fetch_all(1)
    rig.until(lambda: first.over, 20.0)
    (tmp_path / "again").mkdir()
    later, server = make(tmp_path, PX4)
    job = later.station.services.params.fetch_all(1)
    took_s = later.until(lambda: job.over, 5.0)
    assert job.way == "cache" and took_s < 0.2
    assert values(later) == expected(server)
    assert not later.peers[1].got("PARAM_REQUEST_LIST")
    server.params["NEGATIVE"][1] = -4
    changed = later.station.services.params.fetch_all(1)
    later.until(lambda: changed.over, 20.0)
    assert changed.way == "list" and values(later)["NEGATIVE"] == -4


def test_another_vehicle_or_firmware_does_not_use_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig, _ = make(tmp_path, PX4)
    first = rig.station.services.params.fetch_all(1)
    rig.until(lambda: first.over, 20.0)
    for key, value in (("uid", 78), ("flight_sw_version", 0x04070001), ("flight_custom_version", bytes(8))):
        monkeypatch.setitem(VERSION, key, value)
        other, _ = make(tmp_path, PX4)
        job = other.station.services.params.fetch_all(1)
        other.until(lambda job=job: job.over, 20.0)
        assert job.way == "list", key


def test_indices_that_shift_under_way(tmp_path: Path) -> None:
    """PX4's count grows while it runs; names count, and all of them come."""
    rig, server = make(tmp_path, PX4)
    server.gap_s = 0.01
    job = rig.station.services.params.fetch_all(1)
    rig.run(0.6)
    server.params = {"AAA_NEW": [REAL32, 1.0], **server.params}
    rig.until(lambda: job.over, 60.0)
    assert job.state is JobState.DONE, job.error
    assert values(rig) == expected(server)


def test_unasked_values_are_no_progress_but_known(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    server.mute = True
    job = rig.station.services.params.fetch_all(1)
    for _ in range(100):
        server.say("STAT_RUNTIME", 5.0, INT32, 65535)
        rig.run(0.1)
    server.mute = False
    rig.until(lambda: job.over, 40.0)
    assert job.state is JobState.DONE
    assert "STAT_RUNTIME" not in values(rig), "the list does not have it"
    server.say("STAT_RUNTIME", 6.0, INT32, 65535)
    rig.run(0.2)
    assert values(rig)["STAT_RUNTIME"] == 6


def test_a_vehicle_without_parameters_is_given_up_on(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    server.mute = True
    job = rig.station.services.params.fetch_all(1)
    rig.until(lambda: job.over, 60.0)
    assert "list: no answer" in job.error


def test_a_reboot_forgets_them(tmp_path: Path) -> None:
    rig, _ = make(tmp_path, files=True)
    job = rig.station.services.params.fetch_all(1)
    rig.until(lambda: job.over, 10.0)
    for listener in rig.station.picture.fleet.paths.on_reboot:
        listener(rig.vehicle())
    table = rig.station.services.params.table(1)
    assert not table.params and not table.complete


# ---------------------------------------------------------------- some of them


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_some_are_read_by_name(tmp_path: Path, autopilot: int, loss: float) -> None:
    rig, _ = make(tmp_path, autopilot, loss=loss)
    reported: list[ParamReading] = []
    rig.station.services.params.read(1, ["BIG", "SIXTEEN_LETTERS_", "NOT_THERE", "bad name"], reported.append)
    rig.until(lambda: bool(reported), 10.0)
    (reading,) = reported
    assert {name: p.value for name, p in reading.values.items()} == {"BIG": 16_777_216, "SIXTEEN_LETTERS_": 0.5}
    assert reading.missing["NOT_THERE"].startswith("no answer" if autopilot == ARDUPILOT else "it has no such")
    assert reading.missing["bad name"].startswith("not a parameter's name")


def test_reading_goes_on_beside_a_job(tmp_path: Path) -> None:
    rig, server = make(tmp_path, files=True)
    server.mute = True
    FtpServer(rig.peers[1], {}).sabotage = lambda *_: True
    job = rig.station.services.params.fetch_all(1)
    rig.run(0.2)
    server.mute = False
    reading = rig.station.services.params.read(1, ["BIG"])
    rig.until(lambda: reading.over, 2.0)
    assert reading.values["BIG"].value == 16_777_216 and not job.over


# ---------------------------------------------------------------- setting


def set_one(rig: ServiceRig, name: str, value: float, **how: Any) -> str:
    reported: list[ParamSetting] = []
    rig.station.services.params.set(1, name, value, reported.append, **how)
    rig.until(lambda: bool(reported), 20.0)
    return reported[0].error


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_a_parameter_is_set_with_its_own_type_and_confirmed(tmp_path: Path, autopilot: int, loss: float) -> None:
    rig, server = make(tmp_path, autopilot, loss=loss)
    assert set_one(rig, "NEGATIVE", -70_000) == ""
    assert set_one(rig, "SIXTEEN_LETTERS_", 0.1) == ""
    assert server.params["NEGATIVE"] == [INT32, -70_000]
    assert server.params["SIXTEEN_LETTERS_"][1] == pytest.approx(0.1)
    assert values(rig)["NEGATIVE"] == -70_000
    assert "NEGATIVE = -70000" in rig.texts("vehicle 1")


def test_another_value_than_requested_is_reported(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    server.params["LIMITED"] = [REAL32, 1.0]
    original = server.set

    def limited(peer: Peer, fields: dict[str, Any]) -> None:
        original(peer, fields | {"param_value": min(fields["param_value"], 5.0)})

    rig.peers[1].answers["PARAM_SET"] = limited
    assert set_one(rig, "LIMITED", 7.5) == "vehicle holds 5"
    assert values(rig)["LIMITED"] == 5.0


def test_an_older_value_on_its_way_is_no_refusal(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    rig.station.services.params.read(1, ["NEGATIVE"])
    rig.run(0.5)
    reported: list[ParamSetting] = []
    rig.station.services.params.set(1, "NEGATIVE", 9, reported.append)
    server.say("NEGATIVE", -3.0, INT32, 65535)
    rig.until(lambda: bool(reported), 5.0)
    assert reported[0].error == "" and server.params["NEGATIVE"][1] == 9


@pytest.mark.parametrize(
    ("autopilot", "name", "value", "why"),
    [
        (ARDUPILOT, "FS_GCS_ENABLE", 300, "must be a whole number -128 to 127"),
        (ARDUPILOT, "FS_GCS_ENABLE", 7.6, "must be a whole number -128 to 127"),
        (ARDUPILOT, "BIG", 16_777_217, "too many digits"),
        (ARDUPILOT, "P001_LONG", math.nan, "must be a number"),
        (ARDUPILOT, "P001_LONG", math.inf, "must be a number"),
        (ARDUPILOT, "P001_LONG", 16_777_217, "cannot be held exactly"),
        (ARDUPILOT, "P001_LONG", 1e39, "too large"),
        (PX4, "BIG", -5_000_000, "cannot be sent exactly"),
        (PX4, "BIG", 2**31, "must be a whole number"),
        (ARDUPILOT, "seventeen_letters", 1, "not a parameter's name"),
        (ARDUPILOT, "", 1, "not a parameter's name"),
    ],
)
def test_what_would_not_arrive_as_it_is_is_not_sent(
    tmp_path: Path, autopilot: int, name: str, value: float, why: str
) -> None:
    rig, _ = make(tmp_path, autopilot)
    assert why in set_one(rig, name, value)
    assert not rig.peers[1].got("PARAM_SET")


def test_px4_takes_whole_numbers_as_their_bytes(tmp_path: Path) -> None:
    rig, server = make(tmp_path, PX4)
    assert set_one(rig, "BIG", 16_777_217) == ""
    assert server.params["BIG"][1] == 16_777_217
    sent = rig.peers[1].got("PARAM_SET")[0]
    assert struct.pack("<f", sent["param_value"]) == struct.pack("<i", 16_777_217) and sent["param_type"] == INT32


def test_an_unknown_name_is_silence_on_ardupilot_and_an_error_on_px4(tmp_path: Path) -> None:
    rig, _ = make(tmp_path)
    assert set_one(rig, "NOT_THERE", 1) == "no answer: it has no such parameter, or does not hear us"
    other, _ = make(tmp_path, PX4)
    assert set_one(other, "NOT_THERE", 1) == "it has no such parameter"


def test_errors_are_words(tmp_path: Path) -> None:
    rig, server = make(tmp_path, PX4)
    rig.peers[1].answers["PARAM_SET"] = lambda peer, fields: server.error("BIG", 5)
    assert set_one(rig, "BIG", 1) == "it cannot be written"


def test_a_newer_setting_supersedes_one_that_is_not_answered(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    server.mute = True
    reported: list[ParamSetting] = []
    rig.station.services.params.set(1, "BIG", 1, reported.append)
    rig.run(0.2)
    rig.station.services.params.set(1, "BIG", 2, reported.append)
    assert reported[0].error == "superseded"
    server.mute = False
    rig.until(lambda: len(reported) == 2, 10.0)
    assert reported[1].error == "" and server.params["BIG"][1] == 2


def test_a_setting_is_journalled_and_refused_for_a_vehicle_that_must_not_be_commanded(tmp_path: Path) -> None:
    rig, _ = make(tmp_path)
    assert set_one(rig, "FS_GCS_ENABLE", 1) == ""
    assert '"parameter FS_GCS_ENABLE"' in (tmp_path / "run.jsonl").read_text()
    rig.vehicle().identity.blocked = "several vehicles use id 1"
    rig.vehicle().identity.blocked_s = rig.clock.now()
    assert set_one(rig, "FS_GCS_ENABLE", 0) == "several vehicles use id 1"
    assert len(rig.peers[1].got("PARAM_SET")) == 1


def test_what_others_set_is_known(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    server.params["FS_GCS_ENABLE"] = [INT8, 5]
    server.value("FS_GCS_ENABLE")
    rig.run(0.1)
    assert values(rig) == {"FS_GCS_ENABLE": 5}
