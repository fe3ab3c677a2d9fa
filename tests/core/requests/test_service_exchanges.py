"""Parameters, plans, files and logs by request: all that is moved between vehicles and us."""

from pathlib import Path

import pytest

from tests.core.rigs.ftp_peer import FtpServer
from tests.core.rigs.log_peer import LogServer
from tests.core.rigs.param_peer import ParamServer
from tests.core.rigs.plan_peers import ArduPilotPeer, mission
from tests.core.rigs.service_asking import ask, ended, refusal, task
from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol import setup
from tui_gcs.core.requests.plan_rows import plan_rows

# ---------------------------------------------------------------- parameters


def test_parameters_are_read_by_name_and_as_a_whole(tmp_path: Path) -> None:
    peer = Peer(1)
    ParamServer(peer)
    rig = ServiceRig(tmp_path, peer).heard()
    info, result = ended(rig, s.ReadParams((1,), ("RTL_ALT", "NO_SUCH")))
    assert result is not None and [(p.name, p.value, p.type) for p in result.params] == [("RTL_ALT", 1500, "int16")]
    assert info.state == "failed" and "NO_SUCH: no answer" in info.text and "NO_SUCH" in result.missing
    info, _ = ended(rig, s.FetchParams((1,)), 60.0)
    assert (info.state, info.text) == ("done", "205 parameters")
    reply = ask(rig, s.GetParams(1))
    assert reply.complete and len(reply.params) == 205 and reply.params[0].name == "BIG"


def test_a_parameter_in_flight_has_to_be_meant(tmp_path: Path) -> None:
    peer = Peer(1, armed=True, alt_rel_mm=20_000)
    ParamServer(peer)
    rig = ServiceRig(tmp_path, peer).heard()
    assert refusal(rig, s.SetParams((1,), {"RTL_ALT": 2000})) == "it is in the air: say that it is meant"
    assert peer.got("PARAM_SET") == []
    info, result = ended(rig, s.SetParams((1,), {"RTL_ALT": 2000}, in_flight=True))
    assert info.state == "done" and result is not None and result.params[0].value == 2000


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e39, 40_000, 0.5])
def test_a_value_that_would_not_arrive_is_not_sent(tmp_path: Path, value: float) -> None:
    peer = Peer(1)
    ParamServer(peer)
    rig = ServiceRig(tmp_path, peer).heard()
    info, _ = ended(rig, s.SetParams((1,), {"RTL_ALT": value}))
    assert info.state == "failed" and info.text.startswith("RTL_ALT: ")
    assert peer.got("PARAM_SET") == []


def test_reading_and_setting_can_be_ended(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    for request in (s.ReadParams((1,), ("A", "B")), s.SetParams((1,), {"A": 1, "B": 2})):
        number = ask(rig, request).tasks[0].number
        assert ask(rig, s.CancelTask(number)).ok
        rig.run(0.1)
        assert task(rig, number).state == "cancelled"


# ---------------------------------------------------------------- plans


def test_a_plan_goes_up_comes_down_and_is_cleared(tmp_path: Path) -> None:
    peer = ArduPilotPeer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    rows = plan_rows(mission(12))
    assert ask(rig, s.GetOnBoard((1, 2))).on_board == (s.OnBoardRow(1),), "nothing is known of it"
    info, _ = ended(rig, s.UploadPlan((1,), "mission", rows))
    assert info.state == "done" and info.text.startswith("12 items")
    assert len(peer.stores[0]) == 13, "home and the plan"
    _, result = ended(rig, s.DownloadPlan((1,), "mission"))
    assert result is not None and result.plan is not None
    assert [(row.command, row.x, row.y) for row in result.plan] == [(row.command, row.x, row.y) for row in rows]
    assert ask(rig, s.GetVehicles((1,))).vehicles[0].mission_items == 12
    (held,) = ask(rig, s.GetOnBoard((1,))).on_board
    assert held.mission is not None and [row.x for row in held.mission] == [row.x for row in rows]
    assert held.fence is None
    info, _ = ended(rig, s.ClearPlan((1,), "mission"))
    assert info.state == "done"
    assert "nothing in it" in refusal(rig, s.UploadPlan((1,), "mission", ()))


@pytest.mark.parametrize(
    "row", [s.PlanRow(16, 3, (0, 0, 0, 0), 950_000_000, 0, 1), s.PlanRow(16, 99, (0, 0, 0, 0), 1, 1, 1)]
)
def test_a_plan_that_cannot_be_is_not_sent(tmp_path: Path, row: s.PlanRow) -> None:
    peer = ArduPilotPeer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    info, _ = ended(rig, s.UploadPlan((1,), "mission", (row,)))
    assert info.state == "failed" and "item 1" in info.text
    assert peer.got("MISSION_COUNT") == []


# ---------------------------------------------------------------- files, logs


def test_files_are_listed_read_written_and_removed(tmp_path: Path) -> None:
    peer = Peer(1)
    server = FtpServer(peer, {"/a.txt": b"hello"}, listing={"/": [b"Fa.txt\t5", b"Dlogs"]})
    rig = ServiceRig(tmp_path, peer).heard()
    _, result = ended(rig, s.ListFiles((1,), "/"))
    assert result is not None
    assert [(f.name, f.is_directory, f.size) for f in result.files] == [("a.txt", False, 5), ("logs", True, None)]
    _, result = ended(rig, s.DownloadFile((1,), "/a.txt"))
    assert result is not None and (tmp_path / "state" / result.path).read_bytes() == b"hello"
    info, _ = ended(rig, s.WriteFile((1,), "/b.txt", b"new"))
    assert info.state == "done" and bytes(server.files["/b.txt"]) == b"new"
    info, _ = ended(rig, s.RemoveFile((1,), "/b.txt"))
    assert info.state == "done" and "/b.txt" not in server.files
    info, _ = ended(rig, s.DownloadFile((1,), "/gone"))
    assert info.state == "failed" and info.text


def test_logs_are_listed_downloaded_and_erased(tmp_path: Path) -> None:
    peer = Peer(1)
    LogServer(peer, {1: (1_700_000_000, b"one" * 100), 2: (0, b"two" * 50)})
    rig = ServiceRig(tmp_path, peer).heard()
    _, result = ended(rig, s.ListLogs((1,)))
    assert result is not None
    assert [(log.id, log.size, log.time_utc) for log in result.logs] == [(1, 300, 1_700_000_000), (2, 150, 0)]
    _, result = ended(rig, s.DownloadLog((1,), 2))
    assert result is not None and (tmp_path / "state" / result.path).read_bytes() == b"two" * 50
    info, _ = ended(rig, s.DownloadLog((1,), 7))
    assert (info.state, info.text) == ("failed", "the vehicle has no log of that number")
    assert ended(rig, s.EraseLogs((1,)), 60.0)[0].state == "done"


@pytest.mark.parametrize(
    "request_",
    [
        s.WriteFile((1,), "/a", b"x"),
        s.RemoveFile((1,), "/a"),
        s.EraseLogs((1,)),
        s.Reboot((1,)),
        *(setup.Calibrate((1,), word) for word in ("gyro", "accel", "compass", "level", "rc")),
        setup.ChooseAirframe((1,), ("class=1", "type=1")),
        setup.TestMotor((1,), 1, 0.1, 1.0, props_removed=True),
    ],
    ids=lambda r: type(r).__name__,
)
def test_not_while_it_is_armed(tmp_path: Path, request_: m.Request) -> None:
    peer = Peer(1, armed=True)
    rig = ServiceRig(tmp_path, peer).heard()
    sent = len(peer.heard)
    assert refusal(rig, request_) == "it is armed"
    assert not {name for _, name, _ in peer.heard[sent:]} - {"COMMAND_LONG"}
