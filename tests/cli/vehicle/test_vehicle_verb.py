"""`tui-gcs vehicle …`: what it asks, what it tells, how it ends; on scripted vehicles, and once on a real station."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.cli.test_keys import Typist
from tests.cli.vehicle.vehicle_rig import RigClient, Tell, tell
from tests.core.rigs.ftp_peer import FtpServer, describing_px4
from tests.core.rigs.log_peer import LogServer
from tests.core.rigs.param_peer import REAL32, ParamServer
from tests.core.rigs.plan_peers import ArduPilotPeer, fence, mission, rally, square
from tests.core.rigs.service_rig import Fields, Peer, ServiceRig
from tests.core.services.vehicle.test_shell_service import Nsh
from tests.rigs.reports import report_of
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.main import command_line_parser, main
from tui_gcs.cli.sim_fleet import spec_of
from tui_gcs.cli.vehicle_numbers import vehicle_ids
from tui_gcs.client.launcher import LaunchOptions, launch
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.formats.content import Content
from tui_gcs.core.formats.file_types import read_file
from tui_gcs.core.formats.qgc_write import write_qgc
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.scenario.load import load

SCENARIO = Path(__file__).parents[3] / "tui_gcs/scenarios/swarm-challenge.toml"
HOME_LINE = "0\t1\t0\t16\t0\t0\t0\t0\t47.3977000\t8.5456000\t488\t1\n"
WPL = (
    "QGC WPL 110\n" + HOME_LINE + "1\t0\t3\t22\t0\t0\t0\t0\t47.3977000\t8.5456000\t15\t1\n"
    "2\t0\t3\t16\t0\t0\t0\t0\t47.3978000\t8.5457000\t20\t1\n3\t0\t2\t20\t0\t0\t0\t0\t0\t0\t0\t1\n"
)

__all__ = ["tell"]


def obeys(peer: Peer, fields: Fields) -> None:
    if fields["command"] == 176:
        peer.custom_mode = int(fields["param2"])
    peer.ack(fields["command"])


# ---------------------------------------------------------------- words


@pytest.mark.parametrize(
    ("text", "ids"), [("3", (3,)), ("3-7", (3, 4, 5, 6, 7)), ("1,4", (1, 4)), ("4,1-2,4", (4, 1, 2)), ("1003", (1003,))]
)
def test_vehicles_are_named(text: str, ids: tuple[int, ...]) -> None:
    assert vehicle_ids(text) == ids


@pytest.mark.parametrize(
    "text", ["", "all", "*", "0", "-1", "7-3", "1,", "1-", "1-9999", "²", "9" * 30, "3 4", "0000000123"]
)
def test_what_names_no_vehicles_is_one_line(text: str, tell: Tell, tmp_path: Path) -> None:
    with pytest.raises(CommandError):
        vehicle_ids(text)


@pytest.mark.parametrize(
    "words", [("get", "/a", "--yes", "b"), ("get", "--json", "/a", "b", "--yes"), ("get", "/a", "b")]
)
def test_options_may_stand_anywhere(words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    """argparse gives up an optional argument that comes after an option."""
    arguments = command_line_parser().parse_args(["vehicle", "files", "3", *words])
    assert (arguments.path, arguments.file, arguments.yes) == ("/a", "b", "--yes" in words)
    assert command_line_parser().parse_args(["vehicle", "params", "set", "3", "A", "-5"]).value == "-5"
    assert command_line_parser().parse_args(["vehicle", "shell", "3", "--", "--help"]).line == ["--help"]
    with pytest.raises(SystemExit):
        command_line_parser().parse_args(["vehicle", "plan", "upload", "--help"])
    assert "--home-line" in capsys.readouterr().out


def test_no_station_is_exit_code_2(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    assert main(["vehicle", "list"]) == 2
    assert "no station runs" in capsys.readouterr().err


# ---------------------------------------------------------------- looking


def test_list_and_show_say_who_and_how(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(3)
    ParamServer(peer)
    rig = ServiceRig(tmp_path, peer).heard()
    code, out, _ = tell(rig, "list")
    assert code == 0 and out.split()[:3] == ["3", "ArduCopter", "STABILIZE"]
    code, out, _ = tell(rig, "show", "3,9")
    assert code == 1 and "vehicle 9: never heard" in out
    assert "! this station is not heard: NOTHING (FS_GCS_ENABLE 0)" in out and "round trip" in out
    code, out, _ = tell(rig, "show", "3", "--json")
    assert code == 0 and report_of(out, "vehicle show")["vehicles"][0]["data"]["mode"] == "STABILIZE"


def test_no_vehicle_whose_propellers_turn_is_called_ready(tmp_path: Path, tell: Tell) -> None:
    rig = ServiceRig(tmp_path, Peer(3)).heard()
    rig.vehicle(3).telemetry.armed = True
    assert "armed on the ground; nothing is heard of its EKF" in tell(rig, "list")[1]


def test_an_id_that_several_vehicles_use_is_listed_as_that(tmp_path: Path, tell: Tell) -> None:
    rig = ServiceRig(tmp_path, Peer(3)).heard()
    rig.vehicle(3).identity.blocked = "several vehicles use id 3"
    assert "NOT COMMANDED: several vehicles use id 3" in tell(rig, "list")[1]
    (entry,) = report_of(tell(rig, "show", "3", "--json")[1])["vehicles"]
    assert entry["data"]["ready"] is False


def test_nothing_that_a_vehicle_says_reaches_the_terminal_as_it_is(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1)
    FtpServer(peer, {}, listing={"/": [b"F\x1b]52;c;ZXZpbA==\x07\t5"]})
    rig = ServiceRig(tmp_path, peer).heard()
    rig.station.records.events.report(EventClass.VEHICLE, "vehicle 1", "\x1b[2J[red]text")
    for words in (("files", "1", "ls"), ("events", "1")):
        code, out, _ = tell(rig, *words)
        assert code == 0 and "\x1b" not in out and "␛" in out


def test_what_was_ordered_of_a_vehicle_is_among_its_events(tmp_path: Path, tell: Tell) -> None:
    rig = ServiceRig(tmp_path, Peer(1, custom_mode=4, answers={"COMMAND_LONG": obeys}), Peer(2)).heard()
    assert tell(rig, "mode", "1", "GUIDED")[0] == 0
    assert "mode GUIDED" in tell(rig, "events", "1")[1] and "mode GUIDED" not in tell(rig, "events", "2")[1]


def test_of_a_lost_vehicle_nothing_is_told_as_if_it_were_now(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    peer.silent = True
    rig.run(5.0)
    out = tell(rig, "show", "1")[1]
    assert "; nothing is heard of it now" in out and "% lost" not in out and "round trip" not in out


# ---------------------------------------------------------------- parameters


def test_params(tmp_path: Path, tell: Tell) -> None:
    peers = [Peer(1), Peer(2)]
    for peer in peers:
        ParamServer(peer)
    rig = ServiceRig(tmp_path, *peers).heard()
    assert tell(rig, "params", "set", "1-2", "RTL_ALT", "2000") == (
        0,
        "".join(
            f"vehicle {number}: RTL_ALT = 2000 (range not checked: the autopilot reports none)\n" for number in (1, 2)
        ),
        "",
    )
    code, out, _ = tell(rig, "params", "get", "1", "RTL_ALT", "NO_SUCH")
    assert code == 1 and "RTL_ALT          2000" in out and "FAILED: NO_SUCH" in out
    assert tell(rig, "params", "set", "1,9", "RTL_ALT", "1")[0] == 1
    assert tell(rig, "params", "set", "1", "RTL_ALT", "high")[0] == 2
    code, out, _ = tell(rig, "params", "list", "1")
    assert code == 0 and "--fetch asks for all" in out
    code, out, _ = tell(rig, "params", "list", "1", "--fetch", "fs_*")
    assert (code, out.split()) == (0, ["1", "FS_GCS_ENABLE", "0"])
    assert tell(rig, "params", "save", "1", "one.param")[0] == 0
    lines = Path("one.param").read_text().splitlines()
    assert len(lines) == 206 and "RTL_ALT,1" in lines and lines[0].startswith("# vehicle 1 ArduCopter")
    assert tell(rig, "params", "save", "1", "one.param")[0] == 2, "nobody is there to be asked"
    assert tell(rig, "params", "save", "1-2", "one.param")[0] == 2, "one file is for one vehicle"


def test_parameters_from_one_vehicle_to_another_by_a_file(tmp_path: Path, tell: Tell) -> None:
    peers = [Peer(1), Peer(2)]
    servers = [ParamServer(peer) for peer in peers]
    servers[1].params["RTL_ALT"][1] = 4000.0
    del servers[1].params["FS_GCS_ENABLE"]
    rig = ServiceRig(tmp_path, *peers).heard()
    assert tell(rig, "params", "save", "1", "one.params")[0] == 0
    assert "1\t1\tRTL_ALT\t1500\t4" in Path("one.params").read_text()
    assert tell(rig, "params", "diff", "1", "one.params") == (0, "   1 holds all of it\n", "")
    code, out, _ = tell(rig, "params", "diff", "2", "one.params")
    assert code == 1 and "   2 RTL_ALT          4000 -> 1500\n" in out and "   2 it has no FS_GCS_ENABLE\n" in out
    assert tell(rig, "params", "load", "2", "one.params")[0] == 2, "nobody is there to be asked"
    assert servers[1].params["RTL_ALT"][1] == 4000.0
    code, out, _ = tell(rig, "params", "load", "1-2", "one.params", answer="y\n")
    assert code == 1 and "vehicle 1: holds all of it already" in out
    assert "vehicle 2: FAILED: 1 of 1 parameter set; range not checked" in out and "it has no FS_GCS_ENABLE" in out
    assert servers[1].params["RTL_ALT"][1] == 1500.0


def test_values_out_of_range_are_set_only_when_named(tmp_path: Path, tell: Tell) -> None:
    """By a file and as a gain, too: PX4 takes any value without a word."""
    row = {"name": "MC_ROLLRATE_P", "type": "Float", "min": 0.01, "max": 0.2}
    peer, _ = describing_px4(json.dumps({"parameters": [row]}).encode())
    server = ParamServer(peer, {"MC_ROLLRATE_P": (REAL32, 0.15), "MC_ROLL_P": (REAL32, 6.5)})
    rig = ServiceRig(tmp_path, peer).heard()
    Path("a.param").write_text("MC_ROLLRATE_P,0.3\nMC_ROLL_P,7\n")
    code, out, _ = tell(rig, "params", "load", "1", "a.param", "--yes")
    assert code == 1 and "FAILED: 1 of 2 parameters set; MC_ROLLRATE_P: must be within 0.01 to 0.2" in out
    code, out, _ = tell(rig, "tune", "1", "rate", "MC_ROLLRATE_P", "0.25")
    assert code == 1 and "FAILED: must be within 0.01 to 0.2" in out and server.params["MC_ROLLRATE_P"][1] == 0.15
    assert tell(rig, "params", "load", "1", "a.param", "--yes", "--beyond-range")[0] == 0
    assert server.params["MC_ROLLRATE_P"][1] == pytest.approx(0.3)
    assert tell(rig, "tune", "1", "rate", "MC_ROLLRATE_P", "0.25", "--beyond-range")[0] == 0


def test_a_file_of_another_autopilot_sets_nothing_although_some_names_are_the_same(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1)
    ParamServer(peer)
    rig = ServiceRig(tmp_path, peer).heard()
    Path("a.param").write_text("RTL_ALT,7\n" + "".join(f"OTHER_{number},1\n" for number in range(12)))
    code, out, _ = tell(rig, "params", "load", "1", "a.param", "--yes")
    assert code == 1 and "it has no 12 of the file's 13 parameters: a file of another autopilot; none was set" in out
    assert peer.got("PARAM_SET") == []


def test_what_a_vehicle_reckons_itself_and_who_it_is_stays(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1)
    ParamServer(peer)
    rig = ServiceRig(tmp_path, peer).heard()
    Path("a.param").write_text("RTL_ALT,7\nSYSID_THISMAV,9\nMIS_TOTAL,3\n")
    code, out, _ = tell(rig, "params", "load", "1", "a.param", "--yes")
    assert code == 0 and "part of a vehicle's identity: SYSID_THISMAV" in out and "itself: MIS_TOTAL" in out
    assert [fields["param_id"] for fields in peer.got("PARAM_SET")] == ["RTL_ALT"]
    Path("b.param").write_text("RTL_ALT x\n")
    assert tell(rig, "params", "load", "1", "b.param")[0] == 2


def test_parameters_are_not_loaded_in_the_air(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1, armed=True, alt_rel_mm=20_000)
    ParamServer(peer)
    rig = ServiceRig(tmp_path, peer).heard()
    Path("a.param").write_text("RTL_ALT,7\n")
    code, out, _ = tell(rig, "params", "load", "1", "a.param", "--yes")
    assert code == 1 and "FAILED: 0 of 1 parameter set; it is in the air" in out and peer.got("PARAM_SET") == []


def test_a_parameter_in_the_air_is_asked_for(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1, armed=True, alt_rel_mm=20_000)
    ParamServer(peer)
    rig = ServiceRig(tmp_path, peer, Peer(2)).heard()
    code, _, err = tell(rig, "params", "set", "1", "RTL_ALT", "2000")
    assert code == 2 and "vehicle 1: set RTL_ALT = 2000 (it is in the air): say --yes" in err
    code, out, _ = tell(rig, "params", "set", "1", "RTL_ALT", "2000", answer="n\n")
    assert code == 1 and "nothing was sent" in out and peer.got("PARAM_SET") == []
    code, out, _ = tell(rig, "params", "set", "1", "RTL_ALT", "2000", answer="y\n")
    assert code == 0 and out.endswith("vehicle 1: RTL_ALT = 2000 (range not checked: the autopilot reports none)\n")
    assert tell(rig, "params", "set", "1", "RTL_ALT", "2100", "--yes")[0] == 0


def test_what_is_done_for_some_is_reported_though_others_must_be_confirmed(tmp_path: Path, tell: Tell) -> None:
    """An error in place of the results would hide that a parameter of vehicle 2 was set."""
    flying, other = Peer(1, armed=True, alt_rel_mm=20_000), Peer(2)
    ParamServer(flying)
    ParamServer(other)
    rig = ServiceRig(tmp_path, flying, other).heard()
    code, out, _ = tell(rig, "params", "set", "1-2", "RTL_ALT", "2000", "--json")
    report = report_of(out, "vehicle params set")
    assert code == 1 and report["code"] == "not confirmed"
    assert report["text"] == "vehicle 1: it is in the air: say --yes, or answer on a terminal"
    assert [entry["ok"] for entry in report["vehicles"]] == [False, True]
    assert flying.got("PARAM_SET") == [] and other.got("PARAM_SET")


# ---------------------------------------------------------------- plans


def test_plans(tmp_path: Path, tell: Tell) -> None:
    peer = ArduPilotPeer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    Path("a.wpl").write_text(WPL)
    code, out, _ = tell(rig, "plan", "upload", "1", "a.wpl", "--yes")
    assert code == 0 and "first line is home, and is no item" in out and "vehicle 1: 3 items" in out
    code, out, _ = tell(rig, "plan", "show", "1")
    assert code == 0 and "mission of 3 items" in out and "47.3978000 8.5457000" in out
    assert tell(rig, "plan", "download", "1", "b.wpl")[0] == 0
    assert Path("b.wpl").read_text().splitlines()[2:4] == WPL.splitlines()[2:4]
    assert tell(rig, "plan", "download", "1", "c.json")[0] == 0
    assert len(json.loads(Path("c.json").read_text())["items"]) == 3
    assert tell(rig, "plan", "upload", "1", "c.json", "--kind", "fence") == (
        *(2, ""),
        "tui-gcs: c.json: there is no fence in it\n",
    )
    code, _, err = tell(rig, "plan", "clear", "1")
    assert code == 2 and "clear the mission of vehicle 1: say --yes" in err and len(peer.stores[0]) == 4
    assert tell(rig, "plan", "clear", "1", answer="y\n")[0] == 0
    assert "mission of 0 items" in tell(rig, "plan", "show", "1")[1]


def test_one_mission_for_two_vehicles_is_refused_unless_they_may_meet(tmp_path: Path, tell: Tell) -> None:
    """Two real ArduCopters on one mission met at 0 m."""
    peers = [ArduPilotPeer(1), ArduPilotPeer(2)]
    rig = ServiceRig(tmp_path, *peers).heard()
    Path("a.wpl").write_text(WPL)
    code, _, err = tell(rig, "plan", "upload", "1-2", "a.wpl", "--yes")
    assert code == 2 and "vehicle 1: it would come within" in err and "--meet" in err
    assert not any(len(peer.stores[0]) > 1 for peer in peers)
    assert tell(rig, "plan", "upload", "1-2", "a.wpl", "--yes", "--meet")[0] == 0


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("hello", "none of the formats"),
        (WPL.replace("47.3978000", "147.3978000"), "item 2: latitude"),
        ("QGC WPL 110\n0 1 3 5001 4 0 0 0 47 8 0 1\n", "fence: item 1: a polygon of 1 point"),
        ("RTL_ALT 3000\n", "holds no plan for a vehicle"),
    ],
)
def test_a_file_that_is_no_mission_is_not_sent(text: str, why: str, tmp_path: Path, tell: Tell) -> None:
    peer = ArduPilotPeer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    Path("bad.wpl").write_text(text)
    code, _, err = tell(rig, "plan", "upload", "1", "bad.wpl")
    assert code == 2 and why in err and "bad.wpl" in err and peer.got("MISSION_COUNT") == []
    assert tell(rig, "plan", "upload", "1", "gone.wpl")[0] == 2


def test_what_is_wrong_with_a_plan_is_told_before_it_replaces_what_is_on_board(tmp_path: Path, tell: Tell) -> None:
    """As `clear` asks: a terminal is asked, a script says --yes. Against the area, heights and the fence on board."""
    peer = ArduPilotPeer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    rig.station.services.missions.upload(1, fence(*square(500)))
    rig.run(5.0)
    Path("a.wpl").write_text(WPL.replace("000\t20\t", "000\t20000\t"))
    code, _, err = tell(rig, "plan", "upload", "1", "a.wpl")
    assert code == 2 and "replace the mission of vehicle 1 all the same: say --yes" in err
    assert "vehicle 1: mission 2: 20000 m above home: meant above sea level?" in err
    assert "20000 m is above the operating area (90 m)" in err
    assert "its home is not known" in err
    assert "leaves the operating area" in err and "leaves its own fence" in err
    code, out, _ = tell(rig, "plan", "upload", "1", "a.wpl", answer="n\n")
    assert code == 1 and "nothing was sent" in out and peer.stores[0] == []
    assert tell(rig, "plan", "upload", "1", "a.wpl", answer="y\n")[0] == 0 and len(peer.stores[0]) == 4


def test_a_fence_that_cannot_be_read_is_told(tmp_path: Path, tell: Tell) -> None:
    peer = ArduPilotPeer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    Path("a.wpl").write_text(WPL)
    peer.silent = True
    code, _, err = tell(rig, "plan", "upload", "1", "a.wpl")
    assert code == 2 and "vehicle 1: its own fence could not be read: " in err


def test_a_plan_of_qgroundcontrol_goes_up_whole_and_comes_down_whole(tmp_path: Path, tell: Tell) -> None:
    """Fence first, then rally points, then the mission; what comes down is the same."""
    peer = ArduPilotPeer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    Path("a.plan").write_bytes(write_qgc(Content(mission(6), fence(), rally(20.0))).data)
    code, out, _ = tell(rig, "plan", "upload", "1", "a.plan", "--yes")
    assert code == 0 and [line.split(":")[1].strip() for line in out.splitlines()] == ["fence", "rally", "mission"]
    assert [len(store) for store in peer.stores] == [7, 4, 1]
    code, out, _ = tell(rig, "plan", "download", "1", "b.plan")
    assert code == 0 and "mission of 6 items and fence of 4 items and rally of 1 items written" in out
    read = read_file(Path("b.plan").read_bytes())
    assert read.autopilot == 3 and read.fence == fence() and len(read.mission.items) == 6


def test_a_vehicle_that_does_not_take_the_fence_gets_no_mission(tmp_path: Path, tell: Tell) -> None:
    peer = ArduPilotPeer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    Path("a.plan").write_bytes(write_qgc(Content(mission(6), fence())).data)
    peer.deaf_to = {0, 1, 2, 3}
    code, out, _ = tell(rig, "plan", "upload", "1", "a.plan", "--yes")
    assert code == 1 and "FAILED: fence" in out and "mission" not in out and peer.stores[0] == []


def test_a_plan_with_a_part_that_is_not_in_the_file_is_not_flown(tmp_path: Path, tell: Tell) -> None:
    rig = ServiceRig(tmp_path, ArduPilotPeer(1)).heard()
    document = json.loads(write_qgc(Content(mission(6))).data)
    document["mission"]["items"].append({"type": "ComplexItem", "complexItemType": "StructureScan", "version": 3})
    Path("a.plan").write_text(json.dumps(document))
    code, _, err = tell(rig, "plan", "upload", "1", "a.plan", "--yes")
    assert code == 2 and "item 7, StructureScan: its way is not in the file" in err


# ---------------------------------------------------------------- files, logs


def test_files_and_logs(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1)
    server = FtpServer(peer, {"/a.txt": b"hello"}, listing={"/": [b"Fa.txt\t5"]})
    LogServer(peer, {4: (1_700_000_000, b"log" * 300)})
    rig = ServiceRig(tmp_path, peer).heard()
    assert "a.txt" in tell(rig, "files", "1", "ls")[1]
    assert tell(rig, "files", "1", "get", "/a.txt", "here.txt")[0] == 0
    assert Path("here.txt").read_bytes() == b"hello"
    code, _, err = tell(rig, "files", "1", "get", "/a.txt", "here.txt")
    assert code == 2 and "overwrite here.txt: say --yes" in err
    Path("new.txt").write_bytes(b"new")
    assert tell(rig, "files", "1", "put", "new.txt", "/b.txt")[0] == 2 and "/b.txt" not in server.files
    assert tell(rig, "files", "1", "put", "new.txt", "/b.txt", "--yes")[0] == 0
    assert bytes(server.files["/b.txt"]) == b"new"
    assert tell(rig, "files", "1", "rm", "/b.txt", "--yes")[0] == 0 and "/b.txt" not in server.files
    assert "log     4" in tell(rig, "logs", "1", "ls")[1]
    assert tell(rig, "logs", "1", "get", "4", "four.bin")[0] == 0
    assert Path("four.bin").read_bytes() == b"log" * 300
    code, _, err = tell(rig, "logs", "1", "erase")
    assert code == 2 and "erase ALL logs on vehicle 1" in err and peer.got("LOG_ERASE") == []
    assert tell(rig, "logs", "1", "erase", "--yes")[0] == 0 and peer.got("LOG_ERASE")
    (entry,) = report_of(tell(rig, "logs", "1", "ls", "--json")[1], "vehicle logs ls")["vehicles"]
    assert entry["data"]["logs"] == [], "an empty list is there, too"


def test_what_is_dangerous_is_refused_while_armed_whatever_is_said(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1, armed=True)
    rig = ServiceRig(tmp_path, peer).heard()
    Path("x").write_bytes(b"x")
    for words in (
        ("logs", "1", "erase"),
        ("reboot", "1"),
        ("files", "1", "rm", "/a"),
        ("files", "1", "put", "x", "/a"),
    ):
        assert tell(rig, *words, "--yes")[:2] == (1, "vehicle 1: FAILED: it is armed\n")


# ---------------------------------------------------------------- modes, shell, tasks


def test_modes(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1, armed=True, alt_rel_mm=20_000, custom_mode=4, answers={"COMMAND_LONG": obeys})
    rig = ServiceRig(tmp_path, peer).heard()
    assert "* GUIDED" in tell(rig, "mode", "1")[1].splitlines()
    assert tell(rig, "mode", "1", "brake")[:2] == (0, "vehicle 1: in BRAKE\n")
    code, _, err = tell(rig, "mode", "1", "AUTO")
    assert code == 2 and "AUTO takes off or flies by itself" in err and peer.custom_mode == 17
    assert tell(rig, "mode", "1", "AUTO", "--yes")[0] == 0 and peer.custom_mode == 3
    assert tell(rig, "mode", "1", "WARP", "--yes")[:2] == (1, "vehicle 1: FAILED: it has no mode WARP\n")
    code, _, err = tell(rig, "mode", "1", "GUIDED")
    assert code == 2 and "it is armed, and leaves AUTO" in err and peer.custom_mode == 3


@pytest.mark.parametrize("stop", ["RTL", "LAND", "BRAKE"])
def test_return_landing_and_hold_never_wait_for_a_question(stop: str, tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1, armed=True, alt_rel_mm=20_000, custom_mode=3, answers={"COMMAND_LONG": obeys})
    assert tell(ServiceRig(tmp_path, peer).heard(), "mode", "1", stop)[:2] == (0, f"vehicle 1: in {stop}\n")


def test_for_several_vehicles_their_number_is_typed(tmp_path: Path, tell: Tell) -> None:
    peers = [Peer(i, armed=True, alt_rel_mm=20_000, custom_mode=4, answers={"COMMAND_LONG": obeys}) for i in (1, 2)]
    rig = ServiceRig(tmp_path, *peers).heard()
    code, out, _ = tell(rig, "mode", "1-2", "AUTO", answer="y\n")
    assert code == 1 and "type their number, 2:" in out and [peer.custom_mode for peer in peers] == [4, 4]
    assert tell(rig, "mode", "1-2", "AUTO", answer="2\n")[0] == 0 and [peer.custom_mode for peer in peers] == [3, 3]


def test_a_file_for_several_vehicles_asks_for_their_number_too(tmp_path: Path, tell: Tell) -> None:
    peers = [Peer(1), Peer(2)]
    servers = [FtpServer(peer, {"/a": b"old"}) for peer in peers]
    rig = ServiceRig(tmp_path, *peers).heard()
    for act in (("rm", "/a"), ("put", "new", "/a")):
        (tmp_path / "new").write_bytes(b"new")
        code, out, _ = tell(rig, "files", "1-2", *act, answer="y\n")
        assert code == 1 and "type their number, 2:" in out
    assert [server.files for server in servers] == [{"/a": b"old"}] * 2


def test_a_vehicle_that_fell_silent_in_a_mode_is_not_told_to_be_in_it(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1, custom_mode=4, answers={"COMMAND_LONG": obeys})
    rig = ServiceRig(tmp_path, peer).heard()
    assert tell(rig, "mode", "1", "GUIDED")[:2] == (0, "vehicle 1: in GUIDED\n")
    peer.silent = True
    assert tell(rig, "mode", "1", "GUIDED")[:2] == (1, "vehicle 1: FAILED: no answer\n")


def test_what_waits_behind_a_long_transfer_says_so(tmp_path: Path, tell: Tell) -> None:
    peer = Peer(1)
    FtpServer(peer, {"/big": bytes(2_000_000)}, bursts=False, listing={"/": [b"Fa.txt\t5"]})
    rig = ServiceRig(tmp_path, peer).heard()
    before = rig.station.services.ftp.download(1, "/big", lambda job: None)
    peer.after(8.0, lambda: rig.station.services.context.jobs.cancel_job(before))
    code, _, err = tell(rig, "files", "1", "ls", "/")
    assert code == 0 and "vehicle 1: waits for vehicle 1: download /big (" in err


def test_a_shell_line(tmp_path: Path, tell: Tell) -> None:
    peer = Nsh()
    rig = ServiceRig(tmp_path, peer).heard()
    for words in (("ver all",), ("ver", "all")):
        assert tell(rig, "shell", "1", *words)[:2] == (0, "PX4 version: 1.17.0\n")
    assert tell(rig, "shell", "1", "top", "-n", "1")[0] == 0, "its own options are no business of ours"
    assert tell(rig, "shell", "1")[0] == 2
    assert [line for line in peer.typed.split(b"\n") if line] == [b"ver all", b"ver all", b"top -n 1"]
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    assert tell(rig, "shell", "1", "ver all")[:2] == (1, "vehicle 1: FAILED: this autopilot has no shell\n")


def test_an_interrupted_command_leaves_its_task_and_says_so(
    tmp_path: Path, tell: Tell, monkeypatch: pytest.MonkeyPatch
) -> None:
    peer = Peer(1)
    FtpServer(peer, {"/big": bytes(2_000_000)}, bursts=False)
    rig = ServiceRig(tmp_path, peer).heard()

    def ctrl_c(self: RigClient) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(RigClient, "pause", ctrl_c)
        code, _, err = tell(rig, "files", "1", "get", "/big")
    assert code == 2 and "task 1 goes on" in err
    rig.run(1.0)
    code, out, _ = tell(rig, "tasks")
    assert code == 0 and "running" in out and "download /big  by cli" in out
    assert tell(rig, "cancel", "1")[0] == 0 and tell(rig, "cancel", "1")[0] == 1
    assert "cancelled" in tell(rig, "tasks")[1]


# ---------------------------------------------------------------- the real thing


@pytest.mark.long
@pytest.mark.process
@pytest.mark.xdist_group("operator")
def test_both_autopilots_through_a_station_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def command(*words: str) -> tuple[int, str]:
        code = main(["vehicle", *words])
        return code, capsys.readouterr().out

    def homes() -> list[list[float] | None]:
        code, out = command("list", "--json")
        # Empty while the station is still starting.
        return [v["data"]["home"] for v in report_of(out)["vehicles"]] if code == 0 else []

    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setattr(sys, "stdin", Typist("", terminal=False))
    monkeypatch.chdir(tmp_path)
    spec = spec_of(load(SCENARIO), autopilots="mixed")
    spec["vehicles"] = spec["vehicles"][:2]
    launch(RunKind.SIM, str(SCENARIO), SCENARIO.read_text(), [], LaunchOptions(spec))
    try:
        end = time.monotonic() + 60
        while len(homes()) < 2 or None in homes():
            assert time.monotonic() < end
            time.sleep(0.3)
        listed = [v["data"] for v in report_of(command("list", "--json")[1], "vehicle list")["vehicles"]]
        assert [v["autopilot"] for v in listed] == ["ArduCopter", "PX4"]
        both = f"{listed[0]['id']}-{listed[1]['id']}"
        code, out = command("params", "list", both, "--fetch", "--json")
        assert code == 0
        assert all(len(v["data"]["params"]) > 100 for v in report_of(out, "vehicle params list")["vehicles"])
        lat, lon, _ = listed[0]["home"]
        Path("a.wpl").write_text(
            f"QGC WPL 110\n0\t1\t3\t22\t0\t0\t0\t0\t{lat}\t{lon}\t15\t1\n"
            f"1\t0\t3\t16\t0\t0\t0\t0\t{lat + 2e-4}\t{lon}\t20\t1\n2\t0\t2\t20\t0\t0\t0\t0\t0\t0\t0\t1\n"
        )
        assert command("plan", "upload", both, "a.wpl", "--yes", "--meet") == (
            0,
            "vehicle 1: 3 items\nvehicle 2: 3 items\n",
        )
        assert command("plan", "show", both)[1].count("mission of 3 items") == 2
        assert command("plan", "clear", both, "--yes")[0] == 0
        assert command("files", "2", "ls", "/")[0] == 0
        assert command("mode", both, "LAND")[0] == 0
        code, out = command("show", both)
        assert code == 0 and out.count("  failsafes") == 2
    finally:
        stop_all(str(tmp_path / "run"))


def stop_all(runtime: str) -> None:
    listing = subprocess.run(["ps", "-ww", "-eo", "pid,args"], capture_output=True, text=True, check=True).stdout
    for part in ("tui_gcs.client.launcher", "tui_gcs.core.process.station_process", "sitl.launch.simulated"):
        for line in listing.splitlines():
            if part in line and runtime in line:
                os.kill(int(line.split()[0]), signal.SIGKILL)
