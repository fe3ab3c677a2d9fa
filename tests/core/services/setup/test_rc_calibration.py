"""The pilot's transmitter: led through, judged, written, and set back."""

from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from tests.core.rigs.param_peer import INT8, INT16, INT32, REAL32, ParamServer
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Peer, ServiceRig
from tui_gcs.core.firmware.rc_setup import Stick, rc_parameters
from tui_gcs.core.services.parameters.param_change import ParamChange
from tui_gcs.core.services.setup.rc_calibration import RcCalibration, RcCalibrationService, RcStep

HIGH, LOW, MIDDLE = 1900, 1100, 1500
PUSHES = (Stick.THROTTLE, Stick.YAW, Stick.ROLL, Stick.PITCH)
CHANNELS = {Stick.ROLL: 1, Stick.PITCH: 2, Stick.THROTTLE: 3, Stick.YAW: 4}


def params(autopilot: int) -> dict[str, tuple[int, float]]:
    ardupilot = autopilot == ARDUPILOT
    names: dict[str, tuple[int, float]] = {}
    for n in range(1, 9):
        kind = INT16 if ardupilot else REAL32
        names |= {f"RC{n}_MIN": (kind, 1000), f"RC{n}_MAX": (kind, 2000), f"RC{n}_TRIM": (kind, 1500)}
        names |= {f"RC{n}_REVERSED": (INT8, 0)} if ardupilot else {f"RC{n}_REV": (REAL32, 1.0)}
    prefix, kind = ("RCMAP_", INT8) if ardupilot else ("RC_MAP_", INT32)
    names |= {f"{prefix}{stick.name}": (kind, number if ardupilot else 0) for stick, number in CHANNELS.items()}
    return names if ardupilot else names | {"RC_CHAN_CNT": (INT32, 0)}


class Transmitter(Peer):
    """A vehicle with a receiver: 8 channels at 10 Hz, once asked for."""

    def __init__(self, autopilot: int = ARDUPILOT) -> None:
        super().__init__(1, autopilot=autopilot)
        self.pulses = [MIDDLE] * 8
        self.on = True

    def tick(self, now: float) -> None:
        super().tick(now)
        if self.on:
            pulses = {f"chan{n}_raw": us for n, us in enumerate([*self.pulses, *[65535] * 10], 1)}
            self.say("RC_CHANNELS", time_boot_ms=round(now * 1000), chancount=8, rssi=255, **pulses)


def make(tmp_path: Path, autopilot: int = ARDUPILOT) -> tuple[ServiceRig, Transmitter, ParamServer, RcCalibration]:
    peer = Transmitter(autopilot)
    server = ParamServer(peer, params(autopilot))
    rig = ServiceRig(tmp_path, peer).heard()
    session = radios(rig).start(1)
    assert isinstance(session, RcCalibration), session
    rig.run(0.3)
    return rig, peer, server, session


def radios(rig: ServiceRig) -> RcCalibrationService:
    found: RcCalibrationService = rig.station.services.rc_calibrations
    return found


def put(rig: ServiceRig, peer: Transmitter, **pulses: int) -> None:
    """Channels as "c3=1900"."""
    for name, us in pulses.items():
        peer.pulses[int(name[1:]) - 1] = us
    rig.run(0.2)


def push_sticks(rig: ServiceRig, peer: Transmitter, up: dict[int, int] | None = None) -> None:
    """Centre, then throttle up, yaw right, roll right, pitch forward; `up`: which channels go down instead."""
    assert radios(rig).confirm(1) == ""
    for stick in PUSHES:
        channel = CHANNELS[stick]
        put(rig, peer, **{f"c{channel}": (up or {}).get(channel, HIGH)})
        assert radios(rig).confirm(1) == "", stick
        put(rig, peer, **{f"c{channel}": MIDDLE})


def move_all(rig: ServiceRig, peer: Transmitter, *channels: int) -> None:
    for channel in channels:
        for us in (LOW, HIGH, MIDDLE):
            put(rig, peer, **{f"c{channel}": us})


def finish(rig: ServiceRig, peer: Transmitter, session: RcCalibration, **rest: int) -> None:
    assert radios(rig).confirm(1) == "" and session.step is RcStep.REST
    put(rig, peer, **({"c3": LOW} | rest))
    assert radios(rig).confirm(1) == ""
    rig.until(lambda: session.over, 30.0)


def test_the_whole_way_on_ardupilot(tmp_path: Path) -> None:
    """Pitch forward makes short pulses there, so a long one is reversed."""
    rig, peer, server, session = make(tmp_path)
    push_sticks(rig, peer, {CHANNELS[Stick.PITCH]: LOW, CHANNELS[Stick.ROLL]: LOW})
    move_all(rig, peer, 1, 2, 3, 4, 6)
    finish(rig, peer, session, c1=1510)
    assert session.step is RcStep.DONE, session.error
    got = {name: value for name, (_, value) in server.params.items()}
    assert (got["RC1_MIN"], got["RC1_MAX"], got["RC1_TRIM"], got["RC1_REVERSED"]) == (LOW, HIGH, 1510, 1)
    assert got["RC2_REVERSED"] == 0
    assert got["RC3_TRIM"] == LOW, "the throttle rests at its low end"
    assert (got["RC6_MIN"], got["RC6_MAX"]) == (LOW, HIGH), "a switch that was moved"
    assert (got["RC5_MIN"], got["RC5_MAX"]) == (1000, 2000), "a channel that never moved stays as it is"
    assert not session.needs_reboot, "the sticks are where they were"


def test_the_whole_way_on_px4(tmp_path: Path) -> None:
    rig, peer, server, session = make(tmp_path, PX4)
    push_sticks(rig, peer)
    move_all(rig, peer, 1, 2, 3, 4)
    finish(rig, peer, session)
    got = {name: value for name, (_, value) in server.params.items()}
    assert {name: got[f"RC_MAP_{name}"] for name in ("ROLL", "PITCH", "THROTTLE", "YAW")} == {
        "ROLL": 1,
        "PITCH": 2,
        "THROTTLE": 3,
        "YAW": 4,
    }
    assert got["RC2_REV"] == 1 and got["RC_CHAN_CNT"] == 8
    assert session.change is not None and session.change.before["RC_MAP_ROLL"] == 0


def test_former_values_are_set_back(tmp_path: Path) -> None:
    rig, peer, server, session = make(tmp_path)
    before = {name: pair[1] for name, pair in server.params.items()}
    push_sticks(rig, peer)
    move_all(rig, peer, 1, 2, 3, 4)
    finish(rig, peer, session)
    assert {name: pair[1] for name, pair in server.params.items()} != before
    change = radios(rig).undo(1)
    assert isinstance(change, ParamChange)
    rig.until(lambda: change.over, 30.0)
    assert {name: pair[1] for name, pair in server.params.items()} == before


def test_former_values_outlive_a_reboot_and_a_calibration_that_wrote_nothing(tmp_path: Path) -> None:
    rig, peer, server, session = make(tmp_path)
    before = {name: pair[1] for name, pair in server.params.items()}
    push_sticks(rig, peer)
    move_all(rig, peer, 1, 2, 3, 4)
    finish(rig, peer, session)
    radios(rig)._rebooted(rig.vehicle())
    again = radios(rig).start(1)
    assert isinstance(again, RcCalibration)
    assert radios(rig).cancel(1) == "" and again.cancelled
    change = radios(rig).undo(1)
    assert isinstance(change, ParamChange)
    rig.until(lambda: change.over, 30.0)
    assert {name: pair[1] for name, pair in server.params.items()} == before


def test_what_is_not_plausible_is_done_again(tmp_path: Path) -> None:
    rig, peer, _, session = make(tmp_path)
    assert radios(rig).confirm(1) == ""
    assert "no channel moved" in radios(rig).confirm(1)
    put(rig, peer, c3=HIGH, c4=HIGH)
    assert "move this stick only" in radios(rig).confirm(1)
    put(rig, peer, c4=MIDDLE)
    assert radios(rig).confirm(1) == "" and session.sticks == {Stick.THROTTLE: 3}
    assert "no channel moved" in radios(rig).confirm(1), "that one is the throttle already"


def test_a_stick_that_was_not_moved_to_both_its_ends(tmp_path: Path) -> None:
    rig, peer, _, _ = make(tmp_path)
    push_sticks(rig, peer)
    move_all(rig, peer, 1, 2, 3)
    assert "yaw (channel 4) went from 1500 to 1900 only" in radios(rig).confirm(1)
    assert not peer.got("PARAM_SET")


def test_sticks_that_are_not_at_rest(tmp_path: Path) -> None:
    rig, peer, _, session = make(tmp_path)
    push_sticks(rig, peer)
    move_all(rig, peer, 1, 2, 3, 4)
    assert radios(rig).confirm(1) == ""
    assert radios(rig).confirm(1) == "the throttle is not fully down"
    put(rig, peer, c3=LOW, c1=HIGH)
    assert "roll (channel 1) does not rest" in radios(rig).confirm(1)
    assert session.step is RcStep.REST and not peer.got("PARAM_SET")


def test_without_a_receiver_or_armed(tmp_path: Path) -> None:
    rig, peer, _, session = make(tmp_path)
    assert radios(rig).start(1) == "its radio is being calibrated already"
    peer.on = False
    rig.run(3.0)
    assert "no channels" in radios(rig).confirm(1)
    peer.armed = True
    rig.run(2.0)
    assert radios(rig).confirm(1) == "it was armed meanwhile" and session.step is RcStep.FAILED
    assert radios(rig).start(1) == "it is armed"


def test_its_channels_keep_coming_fast_though_telemetry_has_them_slower(tmp_path: Path) -> None:
    """On a real ArduCopter the telemetry rates set them back to every 2 s, and "no channels" came."""
    rig, peer, _, _ = make(tmp_path)

    def asked() -> list[float]:
        orders = [f for f in peer.got("COMMAND_LONG") if f["command"] == 511 and f["param1"] == 65]
        return [f["param2"] for f in orders]

    before = len(asked())
    rig.run(30.0)
    assert asked()[before - 1] == 100_000 and len(asked()) == before
    assert radios(rig).cancel(1) == ""
    rig.run(20.0)
    assert asked()[-1] > 1_000_000, "telemetry as before"


def test_it_is_cancelled_and_left(tmp_path: Path) -> None:
    rig, _, _, session = make(tmp_path)
    assert radios(rig).cancel(1) == "" and session.over
    assert radios(rig).cancel(1) == "no radio is being calibrated"
    assert radios(rig).undo(1) == "nothing was written"
    again = radios(rig).start(1)
    assert isinstance(again, RcCalibration)
    again.confirmed_s -= 700.0
    rig.run(0.5)
    assert "nothing was confirmed" in again.error


def test_a_parameter_that_is_not_taken_is_reported(tmp_path: Path) -> None:
    rig, peer, server, session = make(tmp_path, PX4)
    push_sticks(rig, peer)
    move_all(rig, peer, 1, 2, 3, 4)
    peer.answers["PARAM_SET"] = lambda peer, fields: server.error(str(fields["param_id"]), 5)
    finish(rig, peer, session)
    assert session.step is RcStep.FAILED and "RC1_MIN was not set: it cannot be written" in session.error


@given(st.lists(st.lists(st.integers(0, 65535), max_size=20), max_size=30))
def test_any_pulses_of_a_receiver(frames: list[list[int]]) -> None:
    vehicle: Any = type("V", (), {"autopilot": 3})()
    words = rc_parameters(vehicle)
    assert words is not None
    session = RcCalibration(1, words)
    for pulses in frames:
        session.on_pulses(pulses)
        session.confirm()
    assert all(800 <= us <= 2200 for c in session.channels.values() for us in (c.least_us, c.now_us, c.most_us))
    assert all(isinstance(value, int) and value <= 2200 for value in session.wanted().values()) or not session.channels


def test_an_unknown_autopilot_has_no_words() -> None:
    stranger: Any = type("V", (), {"autopilot": 99})()
    assert rc_parameters(stranger) is None
