"""Bad input B.6-66…74: parameters. One test per case of the catalogue."""

import json
import math
import struct
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.hostile.peer_rig import PeerRig  # also makes the following importable

from tests.core.rigs.param_peer import INT32, REAL32, ParamServer  # isort: skip
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Peer  # isort: skip

from tui_gcs.core.base.text import SafeText
from tui_gcs.core.firmware.parameter_transport import Encoding
from tui_gcs.core.services.parameters.param_channel import ParamTable
from tui_gcs.core.services.parameters.param_info import parse_info
from tui_gcs.core.services.parameters.param_values import Parameter, ParamType, ParamValueError, read_value, wire_value
from tui_gcs.core.uplink.jobs import JobState


def evil(tmp_path: Path, autopilot: int = ARDUPILOT) -> tuple[PeerRig, ParamServer]:
    peer = Peer(1, autopilot=autopilot)
    server = ParamServer(peer, {"ONE": (REAL32, 1.0), "TWO": (INT32, 2), "THREE": (REAL32, 3.0)})
    return PeerRig(tmp_path, peer), server


def table(rig: PeerRig) -> dict[str, Any]:
    return rig.station.services.params.table(1).params


def test_b6_66_a_count_of_65535_and_three_values_end_by_time_not_by_memory(tmp_path: Path) -> None:
    rig, server = evil(tmp_path)
    say = server.say
    server.say = lambda name, number, kind, index, count=None: say(name, number, kind, index, 65535)
    job = rig.station.services.params.fetch_all(1)
    rig.until(lambda: job.over, 120.0)
    assert job.error.endswith("list: 3 of 65535 came")
    assert len(rig.evil.got("PARAM_REQUEST_READ")) <= 210
    rig.holds()


def test_b6_67_a_count_that_changes_with_each_message_is_followed_once_in_ten_seconds(tmp_path: Path) -> None:
    rig, server = evil(tmp_path)
    say, said = server.say, []

    def restless(name: str, number: float, kind: int, index: int, count: int | None = None) -> None:
        said.append(name)
        say(name, number, kind, index, 100 + len(said) % 7)

    server.say = restless
    job = rig.station.services.params.fetch_all(1)
    rig.until(lambda: job.over, 200.0)
    assert job.state is JobState.FAILED
    times = [t for t, name, _ in rig.evil.heard if name == "PARAM_REQUEST_LIST"]
    assert len(times) <= 4 and all(b - a >= 10.0 for a, b in pairwise(times))
    rig.holds()


@pytest.mark.parametrize("index", [65535, 3, 40_000, 32_768])
def test_b6_68_an_index_that_is_none_is_stored_by_name_only(tmp_path: Path, index: int) -> None:
    rig, server = evil(tmp_path)
    job = rig.station.services.params.fetch_all(1)
    server.say("ODD", 5.0, REAL32, index)
    rig.until(lambda: job.over, 20.0)
    assert job.state is JobState.DONE and {"ONE", "TWO", "THREE"} <= set(table(rig))
    server.say("ODD", 6.0, REAL32, index)
    rig.run(0.1)
    assert table(rig)["ODD"].value == 6.0
    rig.holds()


def test_b6_69_a_hundred_thousand_names_stop_at_4096(tmp_path: Path) -> None:
    rig, server = evil(tmp_path)
    for number in range(6000):
        server.say(f"N{number}", 1.0, REAL32, number, 65535)
        if number % 1000 == 999:
            rig.step()
    rig.run(0.2)
    assert len(table(rig)) == 4096
    rig.holds(counted="parameter: too many names")
    kept = ParamTable()
    assert sum(kept.put(Parameter(SafeText(f"N{number}"), 1.0, ParamType.REAL32)) for number in range(100_000)) == 4096


@pytest.mark.parametrize(
    ("raw", "shown"),
    [
        (b"A\0B", "A"),
        (b"\x1b]52;c;x\x07", "␛]52;c;x␇"),
        (b"../../x", "../../x"),
        (b"=cmd|'..'", "=cmd|'..'"),
        (b"SIXTEEN_LETTERS_", "SIXTEEN_LETTERS_"),
        (b"\xff\xfe\x80", "\ufffd" * 3),
        (b"[@click=app.q]x[", "[@click=app.q]x["),
    ],
)
def test_b6_70_names_are_text_and_never_files(tmp_path: Path, raw: bytes, shown: str) -> None:
    rig, server = evil(tmp_path, PX4)
    server.params = {}
    server.say(raw, 1.0, REAL32, 0, 1)  # type: ignore[arg-type]
    rig.run(0.1)
    assert list(table(rig)) == [shown]
    rig.holds()
    assert not [p for p in tmp_path.rglob("*") if "cmd" in p.name or p.name == "x"]


def test_b6_70_an_empty_name_is_none(tmp_path: Path) -> None:
    rig, server = evil(tmp_path)
    server.say("", 1.0, REAL32, 0, 1)
    rig.run(0.1)
    assert not table(rig)
    rig.holds(counted="parameter without name or type")


@pytest.mark.parametrize("number", [0, -1, 1, 127, 16_777_216, 16_777_217, -(2**31), 2**31 - 1, -5_000_000, 0x7FA00000])
@pytest.mark.parametrize("encoding", list(Encoding))
def test_b6_71_whole_numbers_arrive_exactly_or_are_refused(number: int, encoding: Encoding) -> None:
    try:
        wire = wire_value(ParamType.INT32, number, encoding)
    except ParamValueError:
        assert abs(number) > (1 << 24 if encoding is Encoding.C_CAST else 1 << 22)
        return
    assert read_value(ParamType.INT32, struct.pack("<f", wire), encoding) == number


@pytest.mark.parametrize("number", [0.0, -0.0, 0.1, 1e-45, 3.4028235e38, math.inf, -math.inf, math.nan])
def test_b6_71_reals_keep_their_bits(number: float) -> None:
    bits = struct.pack("<f", number)
    held = read_value(ParamType.REAL32, bits, Encoding.BYTEWISE)
    assert struct.pack("<f", held) == bits
    if math.isfinite(number):
        assert struct.pack("<f", wire_value(ParamType.REAL32, held, Encoding.C_CAST)) == bits
    else:
        with pytest.raises(ParamValueError):
            wire_value(ParamType.REAL32, held, Encoding.C_CAST)


def test_b6_71_whole_numbers_that_look_like_nan_are_read_from_the_frame(tmp_path: Path) -> None:
    """A signalling NaN does not survive being a float: -5,000,000 would be read as -805,696."""
    rig, server = evil(tmp_path, PX4)
    frame = bytearray(
        rig.evil.encoder.encode(
            "PARAM_VALUE", param_id="TWO", param_value=1.0, param_type=INT32, param_index=1, param_count=3
        )
    )
    frame[10:14] = struct.pack("<i", -5_000_000)
    rig.evil.out.append(_with_crc(bytes(frame), 220))
    rig.run(0.2)
    assert rig.station.services.params.table(1).params["TWO"].value == -5_000_000
    assert server.px4
    rig.holds()


def test_b6_71_another_type_than_before_is_taken_as_reported(tmp_path: Path) -> None:
    rig, server = evil(tmp_path, PX4)
    server.value("TWO")
    rig.run(0.1)
    server.params["TWO"] = [REAL32, 2.5]
    server.value("TWO")
    rig.run(0.1)
    param = rig.station.services.params.table(1).params["TWO"]
    assert (param.value, param.type) == (2.5, ParamType.REAL32)
    rig.holds()


@pytest.mark.parametrize("number", [3.5, math.nan, 1e30, -1e30, math.inf, 128.0])
def test_b6_72_an_invalid_whole_number_crashes_nothing(tmp_path: Path, number: float) -> None:
    rig, server = evil(tmp_path)
    server.say("RALLY_TOTAL", number, 2, 0)
    rig.run(0.1)
    held = table(rig)["RALLY_TOTAL"].value
    assert held == pytest.approx(number, rel=1e-6, nan_ok=True) and isinstance(held, float)
    rig.holds()


def test_b6_73_another_value_than_requested_is_reported(tmp_path: Path) -> None:
    rig, server = evil(tmp_path)

    def stubborn(peer: Peer, fields: dict[str, Any]) -> None:
        server.value("ONE")

    rig.evil.answers["PARAM_SET"] = stubborn
    reported: list[str] = []
    rig.station.services.params.set(1, "ONE", 7.0, lambda setting: reported.append(setting.error))
    rig.until(lambda: bool(reported), 10.0)
    assert reported == ["vehicle holds 1"]
    assert "parameter ONE NOT SET: vehicle holds 1" in rig.texts("vehicle 1")
    rig.holds()


@pytest.mark.parametrize(
    "broken",
    [
        {"min": 10, "max": 1},
        {"min": 1e300, "max": -1e300},
        {"min": "0", "max": []},
        {"increment": -1, "decimalPlaces": 10**6},
        {"values": [{"value": None}, {"description": 5}, 7]},
        {"bitmask": [{"index": 10**9, "description": "x"}]},
        {"name": "x" * 4000},
        {"shortDesc": "\x1b]0;evil\x07" * 1000},
    ],
)
def test_b6_74_descriptions_that_make_no_sense_are_left_out(broken: dict[str, Any]) -> None:
    row = {"name": "P", "type": "Int32", "min": 0, "max": 5} | broken
    good = {"name": "Q", "type": "Float", "min": 0.5, "max": 2.0}
    infos = parse_info(json.dumps({"parameters": [row, good]}).encode())
    assert infos["Q"].why_not(3.0) == "must be within 0.5 to 2" and not infos["Q"].why_not(1.0)
    if "P" in infos:
        info = infos["P"]
        assert "min" not in broken or info.why_not(1e6) == ""
        assert "\x1b" not in info.short and len(info.short) <= 200
        assert not info.bits and info.decimals is None and info.step is None


@pytest.mark.parametrize(
    "data", [b"", b"{", b"[" * 100_000, b'{"parameters": 5}', b'{"parameters": [' + b"[" * 50_000, b"\xff"]
)
def test_b6_74_a_broken_file_describes_nothing(data: bytes) -> None:
    assert parse_info(data) == {}


def _with_crc(frame: bytes, extra: int) -> bytes:
    from fastcrc.crc16 import mcrf4xx

    body = frame[:-2]
    return body + mcrf4xx(body[1:] + bytes([extra])).to_bytes(2, "little")
