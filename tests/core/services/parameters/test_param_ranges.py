"""Every change of a parameter is checked against the vehicle's own ranges, whichever part of the station makes it."""

import ast
import json
import struct
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.ftp_peer import FtpServer, describing_px4
from tests.core.rigs.param_peer import INT32, REAL32, ParamServer
from tests.core.rigs.service_asking import ask, ended, refusal
from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol import setup
from tui_gcs.core.services.parameters.param_change import ParamChange
from tui_gcs.core.services.parameters.param_exchange import ParamSetting

ROOT = Path(__file__).parents[4]
RANGES = {
    "MC_ROLLRATE_P": (REAL32, 0.15, 0.01, 0.2),
    "MC_ROLL_P": (REAL32, 6.5, 0.0, 12.0),
    "SYS_AUTOSTART": (INT32, 4001, 0, 9999),
    "SYS_AUTOCONFIG": (INT32, 0, 0, 1),
}
"""Type, value, least and greatest value by name."""


def make(tmp_path: Path, **values: float) -> tuple[ServiceRig, ParamServer, FtpServer]:
    """A PX4 that describes `RANGES`; `values` replace those that it holds."""
    rows = [{"name": name, "type": "Float", "min": low, "max": top} for name, (_, _, low, top) in RANGES.items()]
    peer, files = describing_px4(json.dumps({"parameters": rows}).encode())
    server = ParamServer(peer, {name: (kind, values.get(name, value)) for name, (kind, value, *_) in RANGES.items()})
    return ServiceRig(tmp_path, peer).heard(), server, files


def gain(rig: ServiceRig, name: str, value: float, **how: bool) -> tuple[str, tuple[str, ...]]:
    """What an operator reads of a gain that is set, and which names were out of range."""
    ended(rig, setup.ReadGains((1,), ""))
    info, result = ended(rig, setup.SetGain((1,), name, value, sure=True, **how))
    return info.text, result.out_of_range if result is not None else ()


def test_a_gain_keeps_to_its_range_unless_named(tmp_path: Path) -> None:
    rig, server, _ = make(tmp_path)
    assert gain(rig, "MC_ROLLRATE_P", 0.25) == ("must be within 0.01 to 0.2", ("MC_ROLLRATE_P",))
    assert server.params["MC_ROLLRATE_P"][1] == 0.15 and not rig.peers[1].got("PARAM_SET")
    assert gain(rig, "MC_ROLLRATE_P", 0.25, beyond_range=True)[1] == ()
    assert server.params["MC_ROLLRATE_P"][1] == pytest.approx(0.25)


def test_a_former_gain_beyond_its_range_comes_back_at_once(tmp_path: Path) -> None:
    """Somebody flew with it: nothing is fetched before a vehicle that oscillates gets its value back."""
    rig, server, files = make(tmp_path, MC_ROLLRATE_P=0.25)
    ended(rig, setup.ReadGains((1,), "rate"))
    ended(rig, setup.SetGain((1,), "MC_ROLLRATE_P", 0.2))
    info, _ = ended(rig, setup.UndoGains((1,), "MC_ROLLRATE_P"))
    assert info.state == "done" and server.params["MC_ROLLRATE_P"][1] == pytest.approx(0.25)
    ended(rig, setup.SetGain((1,), "MC_ROLLRATE_P", 0.2))
    info, _ = ended(rig, setup.UndoGains((1,)))
    assert info.state == "done" and server.params["MC_ROLLRATE_P"][1] == pytest.approx(0.25)
    assert files.ops()


def test_another_station_is_held_to_the_same_ranges(tmp_path: Path) -> None:
    """Its first PARAM_SET is refused while the ranges are read; then they count for it as for this station."""
    rig, _, _ = make(tmp_path)
    forwarder, vehicle = rig.station.parts.comms.forwarder, rig.vehicle()

    def problem(name: str, value: float, kind: int = REAL32) -> str:
        return forwarder.parameter_problem(vehicle, name, kind, value)

    assert "the ranges of its parameters are read first" in problem("MC_ROLLRATE_P", 0.15)
    rig.until(lambda: not problem("MC_ROLLRATE_P", 0.15), 30.0)
    assert problem("MC_ROLLRATE_P", 999.0) == "must be within 0.01 to 0.2"
    assert problem("SYS_AUTOCONFIG", struct.unpack("<f", struct.pack("<i", 1))[0], INT32) == ""
    assert problem("SYS_AUTOCONFIG", struct.unpack("<f", struct.pack("<i", 7))[0], INT32) == "must be within 0 to 1"
    assert problem("NOT_DESCRIBED", 5.0) == ""
    assert problem("MC_ROLL_P", 5.0, 77) == "type 77 is not known"


def test_a_vehicle_that_describes_nothing_takes_what_another_station_sets(tmp_path: Path) -> None:
    peer = Peer(1)
    ParamServer(peer, {"ATC_RAT_RLL_P": (REAL32, 0.1)})
    rig = ServiceRig(tmp_path, peer).heard()
    check = rig.station.parts.comms.forwarder.parameter_problem
    assert check(rig.vehicle(), "ATC_RAT_RLL_P", REAL32, 99.0) == ""


def test_an_airframe_keeps_to_its_range_and_nothing_else_is_set(tmp_path: Path) -> None:
    rig, server, _ = make(tmp_path)
    info, _ = ended(rig, setup.ChooseAirframe((1,), ("10000",)))
    assert info.text == "SYS_AUTOSTART was not set: must be within 0 to 9999"
    assert server.params["SYS_AUTOCONFIG"][1] == 0


def test_a_change_of_several_stops_at_a_value_out_of_range_and_can_be_undone(tmp_path: Path) -> None:
    rig, server, _ = make(tmp_path, MC_ROLL_P=20.0)
    params = rig.station.services.params
    change = ParamChange(1, {"MC_ROLL_P": 6.0, "MC_ROLLRATE_P": 5.0}).run(params)
    rig.until(lambda: change.over, 20.0)
    assert change.error == "MC_ROLLRATE_P was not set: must be within 0.01 to 0.2" and change.changed == ["MC_ROLL_P"]
    back = change.undo(params)
    rig.until(lambda: back.over, 20.0)
    assert not back.error and server.params["MC_ROLL_P"][1] == 20.0


def test_many_settings_wait_for_one_description(tmp_path: Path) -> None:
    rig, server, files = make(tmp_path)
    done: list[ParamSetting] = []
    for name, value in (("MC_ROLL_P", 7.0), ("MC_ROLLRATE_P", 9.0), ("SYS_AUTOCONFIG", 1)):
        rig.station.services.params.set(1, name, value, done.append)
    assert "ranges of its parameters are read first" in rig.station.services.params.waits_for(1)
    rig.until(lambda: len(done) == 3, 20.0)
    assert {one.name: one.error for one in done} == {
        "MC_ROLL_P": "",
        "MC_ROLLRATE_P": "must be within 0.01 to 0.2",
        "SYS_AUTOCONFIG": "",
    }
    assert sum(data.endswith(b"parameters.json.xz") for *_, data in files.asked) == 1
    assert rig.station.services.params.waits_for(1) == "" and server.params["MC_ROLL_P"][1] == 7.0


def test_a_vehicle_that_takes_off_while_its_ranges_are_fetched_keeps_its_values(tmp_path: Path) -> None:
    rig, server, _ = make(tmp_path)
    number = ask(rig, s.SetParams((1,), {"MC_ROLL_P": 7.0})).tasks[0].number
    rig.peers[1].armed, rig.peers[1].alt_rel_mm = True, 20_000
    rig.vehicle().telemetry.armed = True
    rig.run(10.0)
    assert ask(rig, s.GetTasks((number,))).tasks[0].text == "MC_ROLL_P: it is in the air"
    assert server.params["MC_ROLL_P"][1] == 6.5


def test_a_cancelled_description_sets_nothing(tmp_path: Path) -> None:
    rig, server, _ = make(tmp_path)
    setting = rig.station.services.params.set(1, "MC_ROLL_P", 7.0)
    rig.station.services.context.jobs.cancel(1)
    rig.run(5.0)
    assert (setting.over, setting.error) == (True, "cancelled") and server.params["MC_ROLL_P"][1] == 6.5


def test_where_a_vehicle_has_no_ranges_each_result_says_so(tmp_path: Path) -> None:
    peer = Peer(1)
    ParamServer(peer, {"ATC_RAT_RLL_P": (REAL32, 0.135), "FRAME_CLASS": (INT32, 1)})
    rig = ServiceRig(tmp_path, peer).heard()
    remark = "range not checked: the autopilot reports none"
    assert gain(rig, "ATC_RAT_RLL_P", 0.2)[0] == f"ATC_RAT_RLL_P = 0.2; was 0.135; {remark}"
    assert ended(rig, setup.ChooseAirframe((1,), ("class=hexa",)))[0].text.endswith(remark)
    assert ended(rig, s.SetParams((1,), {"FRAME_CLASS": 1}))[0].text == remark


def test_the_file_of_all_parameters_is_no_way_around_the_ranges(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    for path in ("@PARAM/param.pck", "/@param/param.pck", "//@PARAM/x"):
        assert "params load" in refusal(rig, s.WriteFile((1,), path, b"x"))


# ---------------------------------------------------------------- one way


def calls(name: str) -> dict[str, int]:
    """How often each module of the product calls a function, method or class of that name."""
    found: dict[str, int] = {}
    for path in (ROOT / "tui_gcs").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and name in (getattr(node.func, "attr", ""), getattr(node.func, "id", "")):
                found[path.stem] = found.get(path.stem, 0) + 1
    return found


def strings(text: str) -> dict[str, list[ast.AST]]:
    """The nodes that hold that string as a call's argument, by module."""
    found: dict[str, list[ast.AST]] = {}
    for path in (ROOT / "tui_gcs").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            given: list[Any] = (
                [*node.args, *(word.value for word in node.keywords)] if isinstance(node, ast.Call) else []
            )
            if any(isinstance(one, ast.Constant) and one.value == text for one in given):
                found.setdefault(path.stem, []).append(node)
    return found


@pytest.mark.xdist_group("walls")
def test_parameters_are_set_in_one_place_only() -> None:
    """PARAM_SET leaves from the channel, which one class calls, which one method makes after the check."""
    for message in ("PARAM_SET", "PARAM_EXT_SET"):
        assert set(strings(message)) <= {"param_channel"}, message
    assert set(strings("PARAM_SET")) == {"param_channel"}
    assert calls("send_set") == {"param_exchange": 1}
    assert calls("ParamSetting") == {"param_service": 1}
