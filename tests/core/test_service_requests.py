"""What may be asked about vehicles' services, by whom, of which vehicles; and that what takes time has a number."""

import json
from pathlib import Path

import msgspec
import pytest
from ftp_peer import FtpServer
from log_peer import LogServer
from param_peer import INT8, ParamServer
from plan_peers import ArduPilotPeer, mission
from service_rig import ARDUPILOT, PX4, Fields, Peer, ServiceRig
from test_shell import Nsh
from vehicles import a_vehicle

from tui_gcs.core import messages as m
from tui_gcs.core import messages_services as s
from tui_gcs.core import messages_setup as setup
from tui_gcs.core.bus import REQUEST
from tui_gcs.core.firmware.mode_manners import manner_of
from tui_gcs.core.firmware.modes import known_modes
from tui_gcs.core.plan_rows import plan_rows
from tui_gcs.core.services.jobs import MOST_PER_LINK
from tui_gcs.core.services.order import Retry

ACCEPTED, DENIED = 0, 2
GUIDED, LOITER, RTL, AUTO = 4, 5, 6, 3
PX4_LAND = 4 << 16 | 6 << 24


def ask(rig: ServiceRig, request: m.Request, principal: str = "cli") -> s.ServiceReply:
    return m.decode(rig.bus.ask(REQUEST.format(principal=principal), m.encode(request)), s.ServiceReply)


def task(rig: ServiceRig, number: int) -> s.TaskInfo:
    return ask(rig, s.GetTasks((number,))).tasks[0]


def ended(rig: ServiceRig, request: m.Request, limit_s: float = 20.0) -> tuple[s.TaskInfo, s.TaskResult | None]:
    """Ask, let time pass until its one task is over; how that ended."""
    reply = ask(rig, request)
    assert reply.ok, reply
    number = reply.tasks[0].number
    rig.until(lambda: task(rig, number).over, limit_s, "the task is over")
    return task(rig, number), ask(rig, s.GetTaskResult(number)).result


def refusal(rig: ServiceRig, request: m.Request, principal: str = "cli") -> str:
    """Why nothing is done for the one vehicle that is named; nothing leaves."""
    reply = ask(rig, request, principal)
    assert not reply.ok and not reply.tasks
    return reply.results[0].text if reply.results else reply.text


def takes_modes(peer: Peer, fields: Fields) -> None:
    """A vehicle that obeys DO_SET_MODE and reboots."""
    if fields["command"] == 176:
        px4 = int(fields["param2"]) << 16 | int(fields["param3"]) << 24
        peer.custom_mode = px4 if peer.autopilot == PX4 else int(fields["param2"])
        peer.ack(176)
    elif fields["command"] in (511, 512):
        peer.ack(fields["command"])


def obedient(system: int = 1, **traits: object) -> Peer:
    return Peer(system, answers={"COMMAND_LONG": takes_modes}, **traits)  # type: ignore[arg-type]


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
FETCHES += [setup.ReadGains((1,)), setup.ReadAirframe((1,)), setup.HearTraffic((1,))]


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
    before = two.station.requests.in_control
    reply = ask(two, s.GetVehicles(), "planner-defend")
    assert [(v.id, v.autopilot, v.mode, v.armed) for v in reply.vehicles] == [
        (1, "ArduCopter", "STABILIZE", False),
        (2, "ArduCopter", "STABILIZE", False),
    ]
    assert not ask(two, s.GetVehicles((1, 9))).ok
    assert ask(two, s.GetParams(1)).params == () and not ask(two, s.GetParams(9)).ok
    assert "GUIDED" in [mode.name for mode in ask(two, s.GetModes(1)).modes]
    assert not ask(two, s.GetTaskResult(77), "console-9").ok
    assert two.station.requests.in_control == before != "console-9"


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
    assert rig.station.requests.in_control == ""
    ask(rig, s.SetParams((1,), {"FS_GCS_ENABLE": 1}), "console-4")
    assert rig.station.requests.in_control == "console-4"
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
    assert task(rig, number).state == "cancelled" and rig.station.jobs.running(1) is None
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
    assert states.count("running") == MOST_PER_LINK and states.count("queued") == 4 - MOST_PER_LINK


def test_old_tasks_are_forgotten_and_running_ones_are_not(tmp_path: Path) -> None:
    peer = Peer(1)
    FtpServer(peer, {}).sabotage = lambda server, request: True
    rig = ServiceRig(tmp_path, peer).heard()
    kept = ask(rig, s.ListFiles((1,), "/")).tasks[0].number
    for _ in range(600):
        number = ask(rig, s.ReadParams((1,), ("no name at all",))).tasks[0].number
    infos = ask(rig, s.GetTasks()).tasks
    assert len(infos) <= 501 and {kept, number} <= {info.number for info in infos}


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
    info, _ = ended(rig, s.UploadPlan((1,), "mission", rows))
    assert info.state == "done" and info.text.startswith("12 items")
    assert len(peer.stores[0]) == 13, "home and the plan"
    _, result = ended(rig, s.DownloadPlan((1,), "mission"))
    assert result is not None and result.plan is not None
    assert [(row.command, row.x, row.y) for row in result.plan] == [(row.command, row.x, row.y) for row in rows]
    assert ask(rig, s.GetVehicles((1,))).vehicles[0].mission_items == 12
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
    assert (info.state, info.text) == ("failed", "the vehicle does not have it any more")
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


# ---------------------------------------------------------------- modes, shell, reboot


def test_a_mode_by_name_is_done_when_the_heartbeat_says_so(tmp_path: Path) -> None:
    peer = obedient()
    rig = ServiceRig(tmp_path, peer).heard()
    info, _ = ended(rig, s.SetMode((1,), "guided"))
    assert info.state == "done" and rig.vehicle().custom_mode == GUIDED
    assert refusal(rig, s.SetMode((1,), "HOVER\x1b[2J")) == "it has no mode HOVER␛[2J"


def test_a_refused_mode_says_why(tmp_path: Path) -> None:
    def refuses(peer: Peer, fields: Fields) -> None:
        if fields["command"] == 176:
            peer.ack(176, DENIED)
            peer.say("STATUSTEXT", severity=4, text=b"Mode change to AUTO failed: init failed")

    rig = ServiceRig(tmp_path, Peer(1, answers={"COMMAND_LONG": refuses})).heard()
    info, _ = ended(rig, s.SetMode((1,), "AUTO"))
    assert info.state == "failed" and "init failed" in info.text


def test_px4s_first_ack_of_two_is_no_answer(tmp_path: Path) -> None:
    """It accepts every DO_SET_MODE, and then refuses the ones it does not take (px4.md)."""

    def refuses_second(peer: Peer, fields: Fields) -> None:
        if fields["command"] == 176:
            peer.ack(176, ACCEPTED)
            peer.after(0.06, lambda: peer.ack(176, 1))

    rig = ServiceRig(tmp_path, Peer(1, autopilot=PX4, answers={"COMMAND_LONG": refuses_second})).heard()
    info, _ = ended(rig, s.SetMode((1,), "LAND"))
    assert info.state == "failed" and "temporarily rejected" in info.text


def test_modes_that_fly_by_themselves_or_read_sticks_have_to_be_meant(tmp_path: Path) -> None:
    peer = obedient(armed=True, alt_rel_mm=20_000, custom_mode=GUIDED)
    rig = ServiceRig(tmp_path, peer).heard()
    assert "sticks" in refusal(rig, s.SetMode((1,), "LOITER"))
    assert "flies by itself" in refusal(rig, s.SetMode((1,), "AUTO"))
    assert [f for f in peer.got("COMMAND_LONG") if f["command"] == 176] == []
    assert ended(rig, s.SetMode((1,), "AUTO", sure=True))[0].state == "done"
    assert rig.vehicle().custom_mode == AUTO


def test_a_start_is_not_said_again_later_and_a_stop_is_until_it_shows(tmp_path: Path) -> None:
    deaf = Peer(1, armed=True, alt_rel_mm=20_000, custom_mode=GUIDED, answers={"COMMAND_LONG": lambda *_: None})
    rig = ServiceRig(tmp_path, deaf).heard()

    def said(mode: int) -> list[float]:
        return [t for t, _, f in deaf.heard if f.get("command") == 176 and f["param2"] == mode]

    info, _ = ended(rig, s.SetMode((1,), "AUTO", sure=True), 30.0)
    assert info.state == "failed" and 2 <= len(said(AUTO)) <= 3 and said(AUTO)[-1] - said(AUTO)[0] <= 2.0
    number = ask(rig, s.SetMode((1,), "RTL")).tasks[0].number
    rig.run(15.0)
    assert task(rig, number).state == "running" and len(said(RTL)) > 20
    assert ask(rig, s.CancelTask(number)).ok
    before = len(said(RTL))
    rig.run(5.0)
    assert len(said(RTL)) == before and task(rig, number).state == "cancelled"


def test_a_stop_that_is_refused_on_the_ground_is_not_said_for_ever(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1, autopilot=PX4, answers={"COMMAND_LONG": lambda *_: None})).heard()
    info, _ = ended(rig, s.SetMode((1,), "LAND"), 30.0)
    assert info.state == "failed" and rig.vehicle().custom_mode != PX4_LAND


def test_one_line_for_a_shell_and_its_answer(tmp_path: Path) -> None:
    peer = Nsh()
    peer.reply = b"HW arch: SITL\nPX4 \x1b]52;c;x\x07\n"
    rig = ServiceRig(tmp_path, peer).heard()
    info, result = ended(rig, s.TypeShell((1,), "ver all"))
    assert info.state == "done" and result is not None
    assert result.lines == ("HW arch: SITL", "PX4 ␛]52;c;x␇")
    assert rig.station.services.shell.user(1) == "", "left to others"
    assert ended(rig, s.TypeShell((1,), "two\nlines"))[0].text.startswith("one line of at most")


def test_no_shell_where_there_is_none_or_where_it_is_armed(tmp_path: Path) -> None:
    copter, px4 = Peer(1), Nsh()
    px4.system, px4.armed = 2, True
    rig = ServiceRig(tmp_path, copter, Peer(2, autopilot=PX4, armed=True)).heard()
    assert refusal(rig, s.TypeShell((1,), "ver")) == "this autopilot has no shell"
    assert refusal(rig, s.TypeShell((2,), "ver")) == "it is armed"


def test_only_vehicles_of_this_run_are_asked_for_anything(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    monkeypatch.setattr(rig.station.door, "is_ours", lambda vehicle: False)
    for request in (*CHANGES, *FETCHES):
        assert refusal(rig, request) == "not one of our simulated vehicles: this station is SIM"


def test_a_vehicle_that_is_not_commanded_gets_stops_only(tmp_path: Path) -> None:
    peer = obedient(armed=True, alt_rel_mm=20_000, custom_mode=GUIDED)
    rig = ServiceRig(tmp_path, peer).heard()
    rig.vehicle().untrusted = "unknown key"
    for request in CHANGES:
        assert refusal(rig, request) == "unknown key"
    assert ended(rig, s.SetMode((1,), "RTL"))[0].state == "done" and rig.vehicle().custom_mode == RTL


def test_a_write_that_waited_is_not_begun_on_a_vehicle_that_was_armed_meanwhile(tmp_path: Path) -> None:
    peer = Peer(1)
    server = FtpServer(peer, {"/big": bytes(300_000)}, bursts=False)
    rig = ServiceRig(tmp_path, peer).heard()
    ask(rig, s.DownloadFile((1,), "/big"))
    numbers = [
        ask(rig, request).tasks[0].number for request in (s.WriteFile((1,), "/a", b"x"), s.RemoveFile((1,), "/big"))
    ]
    peer.armed = True
    rig.until(lambda: all(task(rig, number).over for number in numbers), 120.0)
    assert [task(rig, number).text for number in numbers] == ["it is armed", "it is armed"]
    assert set(server.files) == {"/big"}


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_each_mode_has_its_manner(autopilot: int) -> None:
    """On the ground nothing is a stop; in the air few modes that are none need no second thought."""
    modes = known_modes(autopilot, 2)
    ground, air = a_vehicle(autopilot=autopilot), a_vehicle(autopilot=autopilot, armed=True)
    assert not [name for number, name in modes.items() if manner_of(ground, number).retry is Retry.STOP]
    assert not [name for number, name in modes.items() if manner_of(ground, number).danger]
    stops = {name for number, name in modes.items() if manner_of(air, number).retry is Retry.STOP}
    assert stops == ({"RTL", "LAND", "HOLD"} if autopilot == PX4 else {"RTL", "LAND", "BRAKE"})
    calm = {name for number, name in modes.items() if not manner_of(air, number).danger} - stops
    assert calm == ({"PRECLAND"} if autopilot == PX4 else {"GUIDED", "SMART_RTL"})


def test_a_reboot_is_done_when_its_clock_begins_anew(tmp_path: Path) -> None:
    peer = Peer(1)

    def reboots(peer: Peer, fields: Fields) -> None:
        takes_modes(peer, fields)
        if fields["command"] == 246:
            assert fields["param1"] == 1.0
            peer.ack(246)
            peer.silent = True
            peer.after(2.0, lambda: setattr(peer, "silent", False))
            peer.say = booted  # type: ignore[method-assign]

    begun = [0.0]
    plain = peer.say

    def booted(name: str, **fields: object) -> None:
        begun[0] = begun[0] or peer.now
        if name == "GLOBAL_POSITION_INT":
            fields["time_boot_ms"] = round((peer.now - begun[0]) * 1000)
        plain(name, **fields)

    peer.answers["COMMAND_LONG"] = reboots
    rig = ServiceRig(tmp_path, peer).heard()
    rig.run(2.0)
    info, _ = ended(rig, s.Reboot((1,)), 60.0)
    assert (info.state, info.text) == ("done", "it has rebooted")
    assert len([f for f in peer.got("COMMAND_LONG") if f["command"] == 246]) == 1


def test_a_reboot_that_is_not_seen_is_not_told_as_one(tmp_path: Path) -> None:
    def only_says_so(peer: Peer, fields: Fields) -> None:
        peer.ack(fields["command"])

    rig = ServiceRig(tmp_path, Peer(1, answers={"COMMAND_LONG": only_says_so})).heard()
    info, _ = ended(rig, s.Reboot((1,)), 60.0)
    assert (info.state, info.text) == ("failed", "accepted, not confirmed")
