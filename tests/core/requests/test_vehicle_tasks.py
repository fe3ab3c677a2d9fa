"""What may be asked about vehicles' services, by whom, of which vehicles; and that what takes time has a number."""

import json
from pathlib import Path

import msgspec
import pytest

from tests.core.rigs.ftp_peer import FtpServer
from tests.core.rigs.param_peer import INT8, ParamServer
from tests.core.rigs.plan_peers import mission
from tests.core.rigs.service_asking import ask, ended, obedient, refusal, task
from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol import setup
from tui_gcs.core.protocol.bus import REQUEST
from tui_gcs.core.requests.plan_rows import plan_rows
from tui_gcs.core.uplink.jobs import MAX_PER_LINK

GUIDED, RTL = 4, 6


# ---------------------------------------------------------------- who may


CHANGES = [
    s.SetParams((1,), {"FS_GCS_ENABLE": 1}),
    s.UploadPlan((1,), "mission", plan_rows(mission(3))),
    s.ClearPlan((1,), "mission"),
    s.SetMode((1,), "GUIDED"),
    s.WriteFile((1,), "/a", b"x"),
    s.RemoveFile((1,), "/a"),
    s.EraseLogs((1,)),
    s.TypeShell((1,), "ver"),
    s.Reboot((1,)),
    setup.Calibrate((1,), "gyro"),
    setup.CancelCalibration((1,)),
    setup.UndoRadio((1,)),
    setup.SetGain((1,), "ATC_RAT_RLL_P", 0.1),
    setup.UndoGains((1,)),
    setup.ChooseAirframe((1,), ("class=1",)),
    setup.TestMotor((1,), 1, 0.1, 1.0, props_removed=True),
    setup.PointGimbal((1,), -30.0, 0.0),
    setup.ReleaseGimbal((1,)),
    setup.UseCamera((1,), "photo"),
    setup.LookAt((1,), 47.0, 8.0, 500.0),
    setup.LookAhead((1,)),
    setup.SetCurrentItem((1,), 1),
]
FETCHES = [s.ReadParams((1,), ("A",)), s.FetchParams((1,)), s.ReadFailsafes((1,)), s.DownloadPlan((1,), "fence")]
FETCHES += [s.ListFiles((1,), "/"), s.DownloadFile((1,), "/a"), s.ListLogs((1,)), s.DownloadLog((1,), 1)]
FETCHES += [setup.ReadSetup((1,)), setup.ReadGains((1,)), setup.ReadAirframe((1,)), setup.HearTraffic((1,))]


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> ServiceRig:
    """Two vehicles that are only looked at."""
    return ServiceRig(tmp_path_factory.mktemp("two"), Peer(1), Peer(2)).heard()


@pytest.mark.parametrize(
    "request_", [*CHANGES, *FETCHES, s.CancelTask(1), setup.ConfirmStep(1)], ids=lambda r: type(r).__name__
)
def test_a_planner_worker_neither_changes_nor_keeps_a_link_busy(two: ServiceRig, request_: m.Request) -> None:
    assert refusal(two, request_, "planner-defend") == "a planner worker may not command"


@pytest.mark.parametrize("request_", [*CHANGES, *FETCHES], ids=lambda r: type(r).__name__)
def test_vehicles_are_named_once_and_never_all_of_them(two: ServiceRig, request_: m.Request) -> None:
    for vehicles in ((), (1, 1), tuple(range(1, 300))):
        assert refusal(two, msgspec.structs.replace(request_, vehicles=vehicles)) == "name each vehicle once"
    assert refusal(two, msgspec.structs.replace(request_, vehicles=(9,))) == "never heard"


def test_looking_is_for_everybody_and_takes_no_control(two: ServiceRig) -> None:
    before = two.station.frontend.requests.in_control
    reply = ask(two, s.GetVehicles(), "planner-defend")
    assert [(v.id, v.autopilot, v.mode, v.armed) for v in reply.vehicles] == [
        (1, "ArduCopter", "STABILIZE", False),
        (2, "ArduCopter", "STABILIZE", False),
    ]
    assert not ask(two, s.GetVehicles((1, 9))).ok
    assert ask(two, s.GetParams(1)).params == () and not ask(two, s.GetParams(9)).ok
    assert "GUIDED" in [mode.name for mode in ask(two, s.GetModes(1)).modes]
    assert not ask(two, s.GetTaskResult(77), "console-9").ok
    assert two.station.frontend.requests.in_control == before != "console-9"


def test_health_and_failsafes_are_told_in_words(tmp_path: Path) -> None:
    peer = Peer(1)
    ParamServer(peer, {"FS_GCS_ENABLE": (INT8, 0)})
    rig = ServiceRig(tmp_path, peer).heard()
    before = ask(rig, s.GetVehicles((1,))).vehicles[0]
    assert before.failsafes == () and before.problems
    _, result = ended(rig, s.ReadFailsafes((1,)))
    assert result is not None
    assert s.FailsafeRow("this station is not heard", "NOTHING (FS_GCS_ENABLE 0)", True) in result.failsafes
    assert ask(rig, s.GetVehicles((1,))).vehicles[0].failsafes == result.failsafes


def test_who_changed_what_is_told_and_in_control(tmp_path: Path) -> None:
    peer = Peer(1)
    ParamServer(peer)
    rig = ServiceRig(tmp_path, peer).heard()
    ask(rig, s.FetchParams((1,)), "console-4")
    assert rig.station.frontend.requests.in_control == ""
    ask(rig, s.SetParams((1,), {"FS_GCS_ENABLE": 1}), "console-4")
    assert rig.station.frontend.requests.in_control == "console-4"
    assert rig.texts("console-4") == ["set FS_GCS_ENABLE = 1: vehicle 1"]
    rig.run(1.0)
    lines = [json.loads(line) for line in rig.journal.path.read_text().splitlines()]
    assert [line["vehicle"] for line in lines if line.get("action") == "parameter FS_GCS_ENABLE"] == [1]


def test_each_vehicle_has_its_own_result_and_task(tmp_path: Path) -> None:
    peers = [Peer(1), Peer(2)]
    for peer in peers:
        ParamServer(peer)
    rig = ServiceRig(tmp_path, *peers).heard()
    reply = ask(rig, s.SetParams((1, 9, 2), {"RTL_ALT": 2000}))
    assert [(r.vehicle, r.ok) for r in reply.results] == [(1, True), (9, False), (2, True)]
    assert [t.vehicle for t in reply.tasks] == [1, 2] and not reply.ok
    rig.run(1.0)
    assert [task(rig, t.number).state for t in reply.tasks] == ["done", "done"]
    assert [rig.station.services.params.table(v).params["RTL_ALT"].value for v in (1, 2)] == [2000, 2000]


def test_a_silent_vehicle_is_asked_for_nothing(tmp_path: Path) -> None:
    peer = Peer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    peer.silent = True
    rig.run(5.0)
    for request in (*CHANGES, *FETCHES):
        assert refusal(rig, request).startswith("LOST: last heard ")


def test_nonsense_is_one_line(two: ServiceRig) -> None:
    raw = msgspec.msgpack.encode({"request": "set-mode", "vehicles": ["all"], "mode": "RTL"})
    reply = m.decode(two.bus.ask(REQUEST.format(principal="cli"), raw), s.ServiceReply)
    assert not reply.ok and reply.text.startswith("request not understood")


def test_only_vehicles_of_this_run_are_asked_for_anything(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    monkeypatch.setattr(rig.station.comms.uplink, "is_ours", lambda vehicle: False)
    for request in (*CHANGES, *FETCHES):
        assert refusal(rig, request) == "not one of our simulated vehicles: this station is SIM"


def test_a_vehicle_that_is_not_commanded_gets_stops_only(tmp_path: Path) -> None:
    peer = obedient(armed=True, alt_rel_mm=20_000, custom_mode=GUIDED)
    rig = ServiceRig(tmp_path, peer).heard()
    rig.vehicle().identity.untrusted = "unknown key"
    for request in CHANGES:
        assert refusal(rig, request) == "unknown key"
    assert ended(rig, s.SetMode((1,), "RTL"))[0].state == "done" and rig.vehicle().telemetry.custom_mode == RTL


# ---------------------------------------------------------------- tasks


def test_a_task_goes_on_without_who_began_it_and_anybody_may_end_it(tmp_path: Path) -> None:
    peer = Peer(1)
    FtpServer(peer, {"/big": bytes(3_000_000)}, bursts=False)
    rig = ServiceRig(tmp_path, peer).heard()
    number = ask(rig, s.DownloadFile((1,), "/big"), "console-1").tasks[0].number
    rig.run(1.0)
    info = task(rig, number)
    assert (info.state, info.who, info.what) == ("running", "console-1", "download /big")
    assert 0 < info.done < info.total == 3_000_000
    assert ask(rig, s.CancelTask(number), "console-2").ok
    assert task(rig, number).state == "cancelled" and rig.station.comms.jobs.running(1) is None
    assert "over" in ask(rig, s.CancelTask(number)).text and not ask(rig, s.CancelTask(99)).ok
    assert f"task {number} of console-1 ends: vehicle 1, download /big" in rig.texts("console-2")


def test_only_the_task_that_is_meant_is_ended(tmp_path: Path) -> None:
    peer = Peer(1)
    FtpServer(peer, {"/a": b"x"}).sabotage = lambda server, request: True  # it never answers
    rig = ServiceRig(tmp_path, peer).heard()
    first, second = (ask(rig, s.ListFiles((1,), "/")).tasks[0].number for _ in range(2))
    assert [task(rig, n).state for n in (first, second)] == ["running", "queued"]
    assert ask(rig, s.CancelTask(second)).ok
    assert [task(rig, n).state for n in (first, second)] == ["running", "cancelled"]


def test_a_fleets_transfers_wait_their_turn(tmp_path: Path) -> None:
    peers = [Peer(number) for number in range(1, 5)]
    rig = ServiceRig(tmp_path, *peers).heard()
    ask(rig, s.ListLogs((1, 2, 3, 4)))
    states = [info.state for info in ask(rig, s.GetTasks()).tasks]
    assert states.count("running") == MAX_PER_LINK and states.count("queued") == 4 - MAX_PER_LINK


def test_old_tasks_are_forgotten_and_running_ones_are_not(tmp_path: Path) -> None:
    peer = Peer(1)
    FtpServer(peer, {}).sabotage = lambda server, request: True
    rig = ServiceRig(tmp_path, peer).heard()
    kept = ask(rig, s.ListFiles((1,), "/")).tasks[0].number
    for _ in range(600):
        number = ask(rig, s.ReadParams((1,), ("no name at all",))).tasks[0].number
    infos = ask(rig, s.GetTasks()).tasks
    assert len(infos) <= 501 and {kept, number} <= {info.number for info in infos}
