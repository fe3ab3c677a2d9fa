"""`tui-gcs vehicle calibrate, tune, airframe, motor-test, gimbal, camera, roi, traffic, remote-id, plan current`."""

import signal
from pathlib import Path

import pytest

from tests.cli.vehicle.test_vehicle_verb import WPL
from tests.cli.vehicle.vehicle_rig import RigClient, Tell, tell
from tests.core.motion.test_target_place import home_position
from tests.core.rigs.calibration_rig import CALIBRATE, CANCEL_MAG, Calibrated
from tests.core.rigs.param_peer import ParamServer
from tests.core.rigs.plan_peers import ArduPilotPeer
from tests.core.rigs.service_asking import ask, obedient
from tests.core.rigs.service_rig import PX4, Fields, ServiceRig
from tests.core.services.payload.test_payload import Carrier
from tests.core.services.payload.test_remote_id import LOCATION, NOBODY, TRANSMITTER
from tests.core.services.payload.test_traffic import HERE
from tests.core.services.setup import test_rc_calibration as radio
from tests.core.services.setup.test_calibration_accelerometer import Poses
from tests.core.services.setup.test_calibration_compass import Compasses
from tests.core.services.setup.test_motor_test import Motors
from tests.core.services.setup.test_tuning import COPTER, QUAD
from tests.rigs.reports import report_of
from tui_gcs.cli.vehicle.prompts import PromptGuide
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol import setup
from tui_gcs.core.protocol.services import TaskInfo
from tui_gcs.core.services.payload.camera_control import UNSEEN_PICTURE
from tui_gcs.core.services.payload.gimbal_control import UNSEEN_GIMBAL

__all__ = ["tell"]

REBOOT = "; reboot it before it flies"


def quiet(rig: ServiceRig, *words: str) -> bool:
    """At most questions and requests for messages left: none of these commands."""
    sent = {f["command"] for peer in rig.peers.values() for f in peer.got("COMMAND_LONG")}
    return not sent - {511, 512}


# ---------------------------------------------------------------- calibrations


def gyros(system: int) -> Calibrated:
    peer = Calibrated()
    peer.system, peer.encoder = system, Encoder(system, 1)
    peer.on_order = {CALIBRATE: lambda fields: peer.after(1.0, lambda: peer.ack(CALIBRATE))}
    return peer


def test_what_can_be_calibrated_is_listed_and_what_cannot_is_told(tmp_path: Path, tell: Tell) -> None:
    rig = ServiceRig(tmp_path, gyros(1)).heard()
    code, out, _ = tell(rig, "calibrate", "1,9")
    assert code == 1 and "1 gyro         keep the vehicle still" in out and "vehicle 9: never heard" in out
    (entry,) = report_of(tell(rig, "calibrate", "1", "--json")[1], "vehicle calibrate")["vehicles"]
    calibrations = entry["data"]["calibrations"]
    assert [row["sensor"] for row in calibrations][-1] == "rc"
    rig = ServiceRig(tmp_path, Calibrated(PX4)).heard()
    assert "baro" not in tell(rig, "calibrate", "1")[1]
    assert "may hang" in tell(rig, "calibrate", "1", "baro", "--yes")[1] and quiet(rig)


def test_each_vehicle_is_calibrated_and_has_its_line(tmp_path: Path, tell: Tell) -> None:
    rig = ServiceRig(tmp_path, gyros(1), gyros(2)).heard()
    code, _, err = tell(rig, "calibrate", "1-2", "gyro")
    assert code == 2 and "calibrate gyro of vehicles 1, 2: say --yes" in err and quiet(rig)
    code, out, _ = tell(rig, "calibrate", "1-2", "gyro", answer="y\n")
    assert code == 0 and out.endswith("vehicle 1: done\nvehicle 2: done\n")
    assert "vehicles 1, 2: keep the vehicle still" in out


@pytest.mark.parametrize("sensor", ["gyro", "accel", "compass", "rc"])
def test_nothing_is_calibrated_while_armed(tmp_path: Path, tell: Tell, sensor: str) -> None:
    peer = Compasses()
    peer.armed = True
    rig = ServiceRig(tmp_path, peer).heard()
    assert tell(rig, "calibrate", "1", sensor, "--yes")[:2] == (1, "vehicle 1: FAILED: it is armed\n")
    assert quiet(rig)


def test_poses_are_led_and_enter_confirms_each(tmp_path: Path, tell: Tell) -> None:
    peer = Poses()
    rig = ServiceRig(tmp_path, peer).heard()
    code, out, err = tell(rig, "calibrate", "1", "accel", "--yes", enter=lambda: True)
    assert (code, out) == (0, "vehicle 1: accelerometers calibrated; reboot it before it flies\n")
    poses = ("level", "on its left side", "on its right side", "nose down", "nose up", "on its back")
    at = [err.index(f"place the vehicle {pose}, keep it still") for pose in poses]
    assert at == sorted(at) and len(peer.orders(42429)) >= 6


def test_an_enter_that_nobody_waited_for_confirms_nothing(tmp_path: Path, tell: Tell) -> None:
    rig = ServiceRig(tmp_path, Poses()).heard()
    client = RigClient(RunKind.LIVE, rig.bus)
    client.rig = rig
    number = ask(rig, setup.Calibrate((1,), "accel")).tasks[0].number

    def task() -> TaskInfo:
        return ask(rig, s.GetTasks((number,))).tasks[0]

    lead = PromptGuide(client)
    client.enter = lambda: True  # type: ignore[method-assign]
    lead.look((task(),))
    rig.until(lambda: task().waits, 5.0)
    lead.look((task(),))
    assert task().waits, "what was typed before the prompt is not meant for it"
    lead.look((task(),))
    assert not task().waits


def test_ctrl_c_cancels_in_the_vehicle(tmp_path: Path, tell: Tell, monkeypatch: pytest.MonkeyPatch) -> None:
    peer = Compasses()
    rig = ServiceRig(tmp_path, peer).heard()
    looks = [0]

    def pause(client: RigClient) -> None:
        client.rig.run(0.2)
        looks[0] += 1
        if looks[0] == 20:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(RigClient, "pause", pause)
    code, out, err = tell(rig, "calibrate", "1", "compass", "--yes")
    assert (code, out) == (1, f"vehicle 1: cancelled{REBOOT}\n") and "cancelling" in err
    assert peer.orders(CANCEL_MAG) and not peer.running


def test_what_cannot_be_cancelled_is_told_goes_on_and_can_be_joined(
    tmp_path: Path, tell: Tell, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = ServiceRig(tmp_path, Poses()).heard()
    with monkeypatch.context() as patched:

        def pause(client: RigClient) -> None:
            client.rig.run(1.0)
            signal.raise_signal(signal.SIGINT)

        patched.setattr(RigClient, "pause", pause)
        code, _, err = tell(rig, "calibrate", "1", "accel", "--yes")
    assert code == 2 and "this autopilot cannot cancel it: finish all six poses" in err and "task 1 goes on" in err
    assert "cannot cancel it" in tell(rig, "calibrate", "1", "cancel")[1]
    assert "another calibration of this vehicle is under way" in tell(rig, "calibrate", "1", "gyro", "--yes")[1]
    code, out, _ = tell(rig, "calibrate", "1", "next")
    assert code == 0 and "place the vehicle level" in out
    rig.run(3.0)
    code, out, _ = tell(rig, "calibrate", "1", "accel", enter=lambda: True)
    assert code == 0 and "accelerometers calibrated" in out
    assert tell(rig, "calibrate", "1", "next")[:2] == (1, "vehicle 1: FAILED: no task of it waits for a confirmation\n")


def test_somebody_elses_calibration_is_cancelled_by_name(tmp_path: Path, tell: Tell) -> None:
    peer = Compasses()
    rig = ServiceRig(tmp_path, peer).heard()
    assert tell(rig, "calibrate", "1", "cancel")[:2] == (1, "vehicle 1: FAILED: no calibration is under way\n")
    number = ask(rig, setup.Calibrate((1,), "compass"), "console-4").tasks[0].number
    rig.run(2.0)
    assert tell(rig, "calibrate", "1", "cancel")[:2] == (0, f"vehicle 1: cancelled{REBOOT}\n")
    assert ask(rig, s.GetTasks((number,))).tasks[0].state == "cancelled" and not peer.running


def test_compasses_show_each_how_far_it_is(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Compasses()).heard()
    number = ask(rig, setup.Calibrate((1,), "compass")).tasks[0].number
    rig.run(3.0)
    (info,) = ask(rig, s.GetTasks((number,))).tasks
    assert [line.partition(":")[0] for line in info.lines] == ["compass 1", "compass 2", "compass 3"]
    assert 0 < info.done < 100 and not info.waits


def test_a_transmitter_is_led_shows_its_channels_and_is_undone(tmp_path: Path, tell: Tell) -> None:
    peer = radio.Transmitter()
    server = ParamServer(peer, radio.params(3))
    rig = ServiceRig(tmp_path, peer).heard()
    seen: list[tuple[str, ...]] = []
    middle = {f"c{channel}": radio.MIDDLE for channel in radio.CHANNELS.values()}
    acts = {
        "switch the transmitter on": lambda: None,
        "push the throttle": lambda: radio.put(rig, peer, **(middle | {"c3": radio.HIGH})),
        "push yaw": lambda: radio.put(rig, peer, **(middle | {"c4": radio.HIGH})),
        "push roll": lambda: radio.put(rig, peer, **(middle | {"c1": radio.HIGH})),
        "push pitch": lambda: radio.put(rig, peer, **(middle | {"c2": radio.HIGH})),
        "move all": lambda: radio.move_all(rig, peer, 1, 2, 3, 4),
        "let go": lambda: radio.put(rig, peer, **(middle | {"c3": radio.LOW})),
    }

    def enter() -> bool:
        """Somebody who does what the prompt says, and then types Enter."""
        for info in ask(rig, s.GetTasks()).tasks:
            if info.waits and not info.over:
                seen.append(info.lines)
                next(act for words, act in acts.items() if words in info.prompt)()
                return True
        return False

    code, out, err = tell(rig, "calibrate", "1", "rc", "--yes", enter=enter)
    assert code == 0 and "parameters written" in out, (out, err)
    assert "push the throttle fully up" in err and server.params["RC3_MIN"][1] == 1100
    assert any("throttle" in line and "1100" in line and "1900" in line for lines in seen for line in lines)
    assert tell(rig, "calibrate", "1", "rc", "--undo")[0] == 0 and server.params["RC3_MIN"][1] == 1000
    assert tell(rig, "calibrate", "1", "gyro", "--undo")[0] == 2


# ---------------------------------------------------------------- gains, airframe, motors


def test_gains_are_shown_changed_and_set_back(tmp_path: Path, tell: Tell) -> None:
    peer = Calibrated()
    server = ParamServer(peer, COPTER)
    rig = ServiceRig(tmp_path, peer).heard()
    code, out, _ = tell(rig, "tune", "1", "rate")
    assert code == 0 and "   1 rate      ATC_RAT_RLL_P    0.135" in out and "ATC_ANG" not in out
    assert "its groups of gains are rate, attitude" in tell(rig, "tune", "1", "rates")[1]
    done = tell(rig, "tune", "1", "rate", "atc_rat_rll_p", "0.2")
    assert done[:2] == (
        0,
        "vehicle 1: ATC_RAT_RLL_P = 0.2; was 0.135; range not checked: the autopilot reports none\n",
    )
    assert "0.2  was 0.135" in tell(rig, "tune", "1", "rate")[1]
    code, _, err = tell(rig, "tune", "1", "rate", "ATC_RAT_RLL_P", "0.9")
    assert code == 2 and "more than a factor of 2" in err
    assert tell(rig, "tune", "1", "rate", "ATC_RAT_RLL_P", "0.9", answer="y\n")[0] == 0
    assert tell(rig, "tune", "1", "rate", "ATC_RAT_RLL_P", "--undo")[1] == (
        "vehicle 1: ATC_RAT_RLL_P = 0.2; was 0.135\n"
    )
    assert tell(rig, "tune", "1", "--undo")[:2] == (0, "vehicle 1: ATC_RAT_RLL_P set back\n")
    assert server.params["ATC_RAT_RLL_P"][1] == pytest.approx(0.135)
    assert tell(rig, "tune", "1", "--undo")[:2] == (1, "vehicle 1: FAILED: nothing was changed\n")
    for words in (("rate", "ATC_RAT_RLL_P"), ("rate", "ATC_RAT_RLL_P", "much"), ("rate", "--undo")):
        assert tell(rig, "tune", "1", *words)[0] == 2


def test_a_gain_in_the_air_is_asked_for(tmp_path: Path, tell: Tell) -> None:
    peer = Calibrated()
    peer.armed, peer.alt_rel_mm = True, 20_000
    ParamServer(peer, COPTER)
    rig = ServiceRig(tmp_path, peer).heard()
    code, _, err = tell(rig, "tune", "1", "rate", "ATC_RAT_RLL_P", "0.14")
    assert code == 2 and "it is in the air" in err and peer.got("PARAM_SET") == []
    assert tell(rig, "tune", "1", "rate", "ATC_RAT_RLL_P", "0.14", "--yes")[0] == 0


def test_an_airframe_is_told_listed_and_chosen_by_name_or_number(tmp_path: Path, tell: Tell) -> None:
    copter, quad = Calibrated(), Calibrated(PX4)
    quad.system, quad.encoder = 2, Encoder(2, 1)
    one, two = ParamServer(copter, COPTER), ParamServer(quad, QUAD)
    rig = ServiceRig(tmp_path, copter, quad).heard()
    code, out, _ = tell(rig, "airframe", "1-2")
    assert code == 0 and "1 class     1 quad  (FRAME_CLASS)" in out and "4001 generic quadcopter X" in out
    assert "4014 S500" in tell(rig, "airframe", "2", "list")[1]
    code, _, err = tell(rig, "airframe", "2", "set", "s500")
    assert code == 2 and "all parameters but calibrations" in err and two.params["SYS_AUTOSTART"][1] == 4001
    assert tell(rig, "airframe", "2", "set", "s500", "--yes")[0] == 0 and two.params["SYS_AUTOSTART"][1] == 4014
    assert tell(rig, "airframe", "1", "set", "class=hexa", "type=1", "--yes")[0] == 0
    assert (one.params["FRAME_CLASS"][1], one.params["FRAME_TYPE"][1]) == (2, 1)
    for words in ("hexa", "class=wooden", "wings=2", "class=99"):
        assert tell(rig, "airframe", "1", "set", words, "--yes")[0] == 1
    assert tell(rig, "airframe", "1", "set")[0] == 2 and one.params["FRAME_CLASS"][1] == 2


def test_a_motor_turns_only_for_who_says_that_the_propellers_are_off(
    tmp_path: Path, tell: Tell, monkeypatch: pytest.MonkeyPatch
) -> None:
    peer = Motors()
    rig = ServiceRig(tmp_path, peer).heard()
    code, _, err = tell(rig, "motor-test", "1", "2")
    assert code == 2 and "are ALL its propellers OFF" in err and peer.orders() == []
    assert tell(rig, "motor-test", "1", "2", answer="n\n")[0] == 1 and peer.orders() == []
    began_s = rig.clock.now()
    code, out, _ = tell(rig, "motor-test", "1", "2", "--throttle", "10", "--seconds", "2", answer="y\n")
    motor = "motor B (2 in the test's order: clockwise from the front right)"
    assert code == 0 and rig.clock.now() - began_s >= 2.0
    assert f"vehicle 1: {motor}: accepted; the vehicle reports no outputs" in out
    assert [peer.orders()[0][f"param{i}"] for i in (1, 3, 4)] == [2, 10, 2]
    rig.run(5.0)
    for words in (("5",), ("13",), ("1", "--throttle", "31"), ("1", "--seconds", "4"), ("1", "--throttle", "nan")):
        assert tell(rig, "motor-test", "1", *words, "--yes")[0] == 1
    assert tell(rig, "motor-test", "1-2", "1", "--yes")[0] == 2 and len(peer.orders()) == 1
    looks = [0]

    def pause(client: RigClient) -> None:
        client.rig.run(0.2)
        looks[0] += 1
        if looks[0] == 3:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(RigClient, "pause", pause)
    tell(rig, "motor-test", "1", "1", "--seconds", "3", "--yes")
    rig.run(0.5)
    assert peer.orders()[-1]["param4"] == 0, "ctrl-c stops it"


# ---------------------------------------------------------------- what is carried, who is heard


def test_gimbals_and_cameras(tmp_path: Path, tell: Tell) -> None:
    peer = Carrier({2500: 3})
    rig = ServiceRig(tmp_path, peer).heard()
    assert "no gimbal was heard" in tell(rig, "gimbal", "1")[1]
    peer.beat(100, 30)
    peer.beat(154, 26)
    rig.run(0.3)
    assert "gimbal (component 154)" in tell(rig, "gimbal", "1")[1]
    code, out, _ = tell(rig, "gimbal", "1", "--pitch", "-30", "--yaw", "10", "--north")
    assert (code, out) == (0, f"vehicle 1: {UNSEEN_GIMBAL}\n")
    (turn,) = peer.orders(1000)
    assert (turn["param1"], turn["param2"], turn["param5"]) == (-30, 10, 28)
    assert tell(rig, "gimbal", "1", "--pitch", "-100")[0] == 1
    assert tell(rig, "gimbal", "1", "release")[:2] == (0, "vehicle 1: released\n")
    assert tell(rig, "camera", "1", "photo")[:2] == (0, f"vehicle 1: {UNSEEN_PICTURE}\n")
    assert len(peer.orders(2000)) == 1
    assert tell(rig, "camera", "1", "start")[:2] == (1, "vehicle 1: FAILED: refused: unsupported\n")
    assert tell(rig, "camera", "1", "stop")[0] == 0 and len(peer.orders(2501)) == 1


def test_a_place_to_look_at_is_above_home_or_the_sea(tmp_path: Path, tell: Tell) -> None:
    peer = Carrier()
    rig = ServiceRig(tmp_path, peer).heard()
    why = tell(rig, "roi", "1", "47.4", "-8.5", "10")
    assert why[:2] == (1, "vehicle 1: FAILED: it has not reported its home position yet\n")
    peer.say("HOME_POSITION", **home_position(488.0))
    rig.run(0.5)
    code, out, _ = tell(rig, "roi", "1", "47.4", "-8.5", "10")
    assert code == 0 and "ordered to look at" in out and "no gimbal was heard" in out
    assert tell(rig, "roi", "1", "47.4", "-8.5", "510", "--amsl")[0] == 0
    said = [(f["frame"], f["x"], f["y"], f["z"]) for f in peer.orders(195, "COMMAND_INT")]
    assert said == [(0, 474_000_000, -85_000_000, 498.0), (0, 474_000_000, -85_000_000, 510.0)]
    assert tell(rig, "roi", "1", "none")[0] == 0 and peer.orders(197)
    assert tell(rig, "roi", "1", "97.4", "8.5", "10")[0] == 1
    for words in (("47.4",), ("47.4", "8.5", "high"), ("1", "2", "3", "4")):
        assert tell(rig, "roi", "1", *words)[0] == 2


def test_traffic_says_what_where_and_who_heard_it(tmp_path: Path, tell: Tell) -> None:
    peer = obedient()
    rig = ServiceRig(tmp_path, peer).heard()
    assert tell(rig, "traffic")[:2] == (0, "no aircraft was heard within the last minute\n")
    peer.say("ADSB_VEHICLE", **HERE)
    rig.run(0.2)
    peer.after(0.8, lambda: peer.say("ADSB_VEHICLE", **(HERE | {"ICAO_address": 0xABC123})))
    code, out, _ = tell(rig, "traffic", "1")
    assert "ABC123" in out, "each comes in a message of its own, one after the other"
    assert code == 0 and "SWR123    ABCDEF" in out and "by 1, " in out and "+712 m from us" in out
    assert {f["param1"] for f in peer.got("COMMAND_LONG") if f["command"] == 511} >= {246}
    row, _ = report_of(tell(rig, "traffic", "--json")[1], "vehicle traffic")["data"]["traffic"]
    assert 300 < row["distance_m"] < 1000 and row["heard_by"] == 1


def test_remote_id_says_what_is_broadcast_and_why_it_does_not_arm(tmp_path: Path, tell: Tell) -> None:
    peer = obedient()
    rig = ServiceRig(tmp_path, peer).heard()
    assert tell(rig, "remote-id", "1")[:2] == (0, "vehicle 1: nothing was heard of Remote ID\n")

    def say(name: str, **fields: object) -> None:
        peer.out.append(Encoder(1, TRANSMITTER).encode(name, **fields))

    to: Fields = {"target_system": 0, "target_component": 0, "id_or_mac": NOBODY}
    say("OPEN_DRONE_ID_LOCATION", **(LOCATION | to))
    say("OPEN_DRONE_ID_ARM_STATUS", status=1, error=b"no \x1b[2Joperator id")
    rig.run(0.2)
    code, out, _ = tell(rig, "remote-id", "1")
    assert code == 0 and "NOT READY TO ARM: no ␛[2Joperator id; reported by component 236" in out
    assert "at           47.3977000 8.5456000, 535 m above the ellipsoid" in out and "NONE" in out


# ---------------------------------------------------------------- the mission's item


def test_the_item_of_a_mission_is_set_and_seen(tmp_path: Path, tell: Tell) -> None:
    peer = ArduPilotPeer(1)
    rig = ServiceRig(tmp_path, peer).heard()
    Path("a.wpl").write_text(WPL)
    assert tell(rig, "plan", "upload", "1", "a.wpl", "--yes")[0] == 0
    rig.run(3.0)
    assert "item 9 of 3 does not exist" in tell(rig, "plan", "current", "1", "9")[1]
    assert "item 0" in tell(rig, "plan", "current", "1", "0")[1]
    peer.armed, peer.alt_rel_mm = True, 20_000
    rig.run(1.5)
    code, _, err = tell(rig, "plan", "current", "1", "2")
    assert code == 2 and "it is in the air" in err


@pytest.mark.parametrize("words", ["motor-test 1", "plan current 1", "logs 1 get", "cancel"])
def test_a_number_of_thirty_digits_is_refused_in_a_line(tmp_path: Path, tell: Tell, words: str) -> None:
    rig = ServiceRig(tmp_path, gyros(1)).heard()
    code, _, err = tell(rig, *words.split(), "9" * 30, *(["--yes"] if words != "cancel" else []))
    assert code == 2
    assert err == "tui-gcs: a number of so many digits is none that a vehicle can take\n"
