"""Modes, shells and reboots by request."""

from pathlib import Path

import pytest

from tests.core.rigs.ftp_peer import FtpServer
from tests.core.rigs.service_asking import ask, ended, obedient, refusal, takes_modes, task
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Fields, Peer, ServiceRig
from tests.core.rigs.vehicles import a_vehicle
from tests.core.services.vehicle.test_shell_service import Nsh
from tui_gcs.core.firmware.mode_change_policy import mode_change_policy
from tui_gcs.core.mavlink.mode_names import known_modes
from tui_gcs.core.protocol import services as s
from tui_gcs.core.uplink.actions import RetryClass

ACCEPTED, DENIED = 0, 2
GUIDED, LOITER, RTL, AUTO = 4, 5, 6, 3
PX4_LAND = 4 << 16 | 6 << 24


def test_a_mode_by_name_is_done_when_the_heartbeat_says_so(tmp_path: Path) -> None:
    peer = obedient()
    rig = ServiceRig(tmp_path, peer).heard()
    info, _ = ended(rig, s.SetMode((1,), "guided"))
    assert info.state == "done" and rig.vehicle().telemetry.custom_mode == GUIDED
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
    """It accepts every DO_SET_MODE, and then refuses the ones it does not take (docs/autopilots.md)."""

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
    assert rig.vehicle().telemetry.custom_mode == AUTO


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
    assert info.state == "failed" and rig.vehicle().telemetry.custom_mode != PX4_LAND


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
    """On the ground nothing is a stop; in the air only stops, and going home or down, need no second thought."""
    modes = known_modes(autopilot, 2)
    ground, air = a_vehicle(autopilot=autopilot), a_vehicle(autopilot=autopilot, armed=True)
    assert not [name for number, name in modes.items() if mode_change_policy(ground, number).retry is RetryClass.STOP]
    assert not [name for number, name in modes.items() if mode_change_policy(ground, number).danger]
    stops = {name for number, name in modes.items() if mode_change_policy(air, number).retry is RetryClass.STOP}
    assert stops == ({"RTL", "LAND", "HOLD"} if autopilot == PX4 else {"RTL", "LAND", "BRAKE"})
    calm = {name for number, name in modes.items() if not mode_change_policy(air, number).danger} - stops
    assert calm == ({"PRECLAND"} if autopilot == PX4 else {"SMART_RTL"})


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
