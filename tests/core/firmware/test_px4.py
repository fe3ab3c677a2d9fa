"""What is sent to a PX4, and when: against a scripted one that answers as the real one does (docs/autopilots.md)."""

import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.service_rig import PX4, Peer, ServiceRig
from tui_gcs.core.firmware.base import Firmware
from tui_gcs.core.guard.permission import PASS
from tui_gcs.core.uplink.actions import Outcome, VehicleAction

HOLD, TAKEOFF, LAND, OFFBOARD, POSCTL = 0x03040000, 0x02040000, 0x06040000, 0x060000, 0x030000
SET_MODE, REPOSITION, TAKE_OFF = 176, 192, 22
SETPOINT = "SET_POSITION_TARGET_GLOBAL_INT"
HOME_AMSL_M = 488.0
ACCEPTED, TEMPORARILY_REJECTED = 0, 1
Fields = dict[str, Any]


class Pilot(Peer):
    """A PX4 in the air at home, in Hold; it obeys mode changes at once and shows them with its next heartbeat."""

    obeys = True
    failsafe = 5

    def __init__(self, **how: Any) -> None:
        answers = {
            "PARAM_REQUEST_READ": Pilot.tell_parameter,
            "COMMAND_LONG": Pilot.command,
            "COMMAND_INT": lambda peer, fields: peer.ack(fields["command"]),
        }
        super().__init__(autopilot=PX4, answers=answers, custom_mode=HOLD, **how)
        self.home_m = HOME_AMSL_M

    def tell_parameter(self, fields: Fields) -> None:
        if fields["param_id"] != "COM_OBL_RC_ACT" or self.failsafe is None:
            return
        value = struct.unpack("<f", struct.pack("<i", self.failsafe))[0]
        self.say(
            "PARAM_VALUE", param_id="COM_OBL_RC_ACT", param_value=value, param_type=6, param_count=1, param_index=0
        )

    def command(self, fields: Fields) -> None:
        if fields["command"] == 512 and fields["param1"] == 242:
            self.say_home()
        if fields["command"] == SET_MODE:
            self.ack(SET_MODE)  # its receiver's word, whatever its commander thinks
            if self.obeys:
                self.custom_mode = int(fields["param2"]) << 16 | int(fields["param3"]) << 24
            self.ack(SET_MODE, ACCEPTED if self.obeys else TEMPORARILY_REJECTED)
            return
        if fields["command"] == 512 and fields["param1"] == 148:
            self.say_version()
        self.ack(fields["command"])

    def say_home(self) -> None:
        rest = dict.fromkeys(("x", "y", "z", "approach_x", "approach_y", "approach_z", "time_usec"), 0)
        place = {"latitude": 473_978_000, "longitude": 85_456_000, "altitude": round(self.home_m * 1e3)}
        self.say("HOME_POSITION", q=[1.0, 0.0, 0.0, 0.0], **place, **rest)

    def say_version(self) -> None:
        numbers = ("capabilities", "flight_sw_version", "middleware_sw_version", "os_sw_version", "board_version")
        custom = {f"{part}_custom_version": [0] * 8 for part in ("middleware", "os", "flight")}
        ids = {"vendor_id": 0, "product_id": 0, "uid": 41}
        self.say("AUTOPILOT_VERSION", **dict.fromkeys(numbers, 0), **ids, **custom)

    def fly(self) -> None:
        """It is in the air from now on."""
        self.armed = True
        self.say("EXTENDED_SYS_STATE", vtol_state=0, landed_state=2)


class Flown(ServiceRig):
    """A station and one PX4 that is flown by its `Firmware` alone."""

    def __init__(self, tmp_path: Path, pilot: Pilot, **how: Any) -> None:
        super().__init__(tmp_path, pilot, **how)
        self.pilot = pilot
        self.heard()
        self.until(lambda: self.vehicle().identity.identified, 5.0)
        self.run(3.0)

    @property
    def firmware(self) -> Firmware:
        return self.station.comms.firmware.of(self.vehicle())

    def flying(self) -> "Flown":
        self.pilot.fly()
        self.until(lambda: self.vehicle().telemetry.airborne, 3.0)
        return self

    def follow(self, seconds: float, each: Callable[[], None] = lambda: None) -> "Flown":
        """A reference that moves east at 5 m/s, said as steering does."""
        for i in range(round(seconds / 0.1)):
            self.firmware.follow(self.vehicle(), (0.5 * i, 0.0, 20.0), (5.0, 0.0, 0.0), PASS)
            self.run(0.1)
            each()
        return self

    def orders(self, command: int) -> list[Fields]:
        """What was ordered, by either message."""
        return [f for _, name, f in self.pilot.heard if name.startswith("COMMAND_") and f.get("command") == command]

    def setpoints(self, since_s: float = 0.0) -> list[Fields]:
        return [f for t, name, f in self.pilot.heard if name == SETPOINT and t > since_s]


@pytest.fixture
def flown(tmp_path: Path) -> Callable[..., Flown]:
    return lambda **how: Flown(tmp_path, Pilot(**how))


Make = Callable[..., Flown]


# ---------------------------------------------------------------- heights


def test_take_off_is_told_the_height_above_sea_level_and_no_place(flown: Make) -> None:
    rig = flown()
    rig.station.comms.commands.submit(rig.firmware.take_off(rig.vehicle(), 27.0, lambda action, outcome, why: None))
    rig.run(0.1)
    (order,) = rig.orders(TAKE_OFF)
    assert order["param7"] == pytest.approx(HOME_AMSL_M + 27.0, abs=0.01)
    assert all(math.isnan(order[f"param{i}"]) for i in (4, 5, 6))


def test_a_place_is_command_int_above_sea_level_with_flag_one_and_our_speed(flown: Make) -> None:
    rig = flown().flying()
    rig.firmware.go_to(rig.vehicle(), (30.0, 40.0, 25.0), 6.0, PASS, anew=True)
    rig.run(0.1)
    (order,) = rig.pilot.got("COMMAND_INT")
    assert (order["command"], order["frame"], order["param1"], order["param2"]) == (REPOSITION, 0, 6.0, 1.0)
    assert order["z"] == pytest.approx(HOME_AMSL_M + 25.0, abs=0.01)
    lat_deg, lon_deg = rig.station.comms.command_encoder.degrees((30.0, 40.0, 25.0))
    assert (order["x"], order["y"]) == (round(lat_deg * 1e7), round(lon_deg * 1e7))
    assert math.isnan(order["param4"]), "its nose stays where it points"


@pytest.mark.parametrize(
    ("home_m", "why"), [(1488.0, "heights contradict each other"), (None, "has not reported its home position")]
)
def test_without_a_plausible_height_of_home_nothing_is_flown(flown: Make, home_m: float | None, why: str) -> None:
    rig = flown()
    ended: list[tuple[Outcome, str]] = []
    if home_m is None:
        rig.vehicle().telemetry.home_m = None
    else:
        rig.pilot.home_m = home_m
        rig.pilot.say_home()
        rig.run(0.1)
    assert why in rig.firmware.start_problem(rig.vehicle())

    def done(action: VehicleAction, outcome: Outcome, text: str) -> None:
        ended.append((outcome, text))

    rig.station.comms.commands.submit(rig.firmware.take_off(rig.vehicle(), 27.0, done))
    rig.firmware.go_to(rig.vehicle(), (30.0, 40.0, 25.0), 6.0, PASS, anew=True)
    rig.run(0.02)
    assert rig.orders(TAKE_OFF) == rig.orders(REPOSITION) == []
    assert ended[0][0] is Outcome.REFUSED and why in ended[0][1]


# ---------------------------------------------------------------- a place


def test_a_place_is_said_once_and_again_only_if_it_stands_still_elsewhere(flown: Make) -> None:
    """Outside of its own fence: accepted, and not flown to."""
    rig = flown().flying()
    for _ in range(50):
        rig.firmware.go_to(rig.vehicle(), (30.0, 40.0, 25.0), 6.0, PASS, anew=False)
        rig.run(0.2)
    assert 3 <= len(rig.orders(REPOSITION)) <= 5, "every 3 s, not 5 times a second"
    before = len(rig.orders(REPOSITION))
    rig.firmware.go_to(rig.vehicle(), (31.0, 40.0, 25.0), 6.0, PASS, anew=False)
    rig.run(0.1)
    assert len(rig.orders(REPOSITION)) == before + 1, "another place at once"


# ---------------------------------------------------------------- OFFBOARD


def test_offboard_is_entered_after_a_second_of_stream_and_believed_from_the_heartbeat(flown: Make) -> None:
    rig = flown().flying()
    begun_s = rig.clock.now()
    rig.follow(0.9)
    assert rig.orders(SET_MODE) == [], "not before the stream has run for a second"
    rig.follow(1.6)
    (order,) = rig.orders(SET_MODE)
    assert (order["param1"], order["param2"], order["param3"]) == (1, 6, 0)
    assert rig.vehicle().telemetry.custom_mode == OFFBOARD and rig.firmware.is_steerable(rig.vehicle())
    said = rig.setpoints(begun_s)
    assert len(said) == pytest.approx(25, abs=2), "ten a second"
    assert {(f["coordinate_frame"], f["type_mask"]) for f in said} == {(5, 0xC00)}, "and acceleration"
    vehicle = rig.vehicle()
    assert said[-1]["alt"] == pytest.approx(
        vehicle.telemetry.alt_amsl_m - vehicle.telemetry.alt_rel_m + 20.0, abs=0.1
    ), "above sea"


def test_the_first_ack_of_offboard_is_not_believed_and_a_refusal_is_told(flown: Make) -> None:
    rig = flown()
    rig.pilot.obeys = False
    rig.flying().follow(12.0)
    assert len(rig.orders(SET_MODE)) == 3, "three tries, then no more"
    assert "mode OFFBOARD: refused (temporarily rejected)" in rig.texts("vehicle 1")
    assert not rig.firmware.is_steerable(rig.vehicle())


def test_out_of_offboard_the_mode_comes_first_and_the_stream_says_stop_until_it_shows(flown: Make) -> None:
    rig = flown().flying().follow(3.0)
    rig.pilot.obeys = False
    left_s = rig.clock.now()
    rig.station.comms.commands.submit(rig.firmware.hold(rig.vehicle(), lambda: (15.0, 0.0, 20.0)))
    rig.run(3.0)
    assert rig.orders(SET_MODE)[-1]["param2"] == 4, "Hold is asked for"
    stops = rig.setpoints(left_s)
    assert len(stops) >= 25, "the stream goes on while it is in OFFBOARD, or it would fall into its failsafe"
    assert {(f["type_mask"], f["vx"]) for f in stops} == {(0xDF8, 0.0)}, "and says stop"
    assert len({(f["lat_int"], f["lon_int"]) for f in stops}) == 1
    rig.pilot.obeys = True
    rig.run(2.0)
    assert rig.vehicle().telemetry.custom_mode == HOLD
    quiet_s = rig.clock.now()
    rig.run(5.0)
    assert rig.setpoints(quiet_s) == [], "a stream left running would take it back"


@pytest.mark.parametrize("how", ["go to", "land"])
def test_whatever_ends_offboard_ends_the_stream(flown: Make, how: str) -> None:
    rig = flown().flying().follow(3.0)
    if how == "land":
        rig.station.comms.commands.submit(rig.firmware.land(rig.vehicle()))
    else:
        rig.firmware.go_to(rig.vehicle(), (15.0, 0.0, 20.0), 5.0, PASS, anew=True)
        rig.pilot.custom_mode = HOLD
    rig.run(2.5)
    assert rig.vehicle().telemetry.custom_mode == (LAND if how == "land" else HOLD)
    quiet_s = rig.clock.now()
    rig.run(3.0)
    assert rig.setpoints(quiet_s) == []


def test_a_pilot_who_takes_it_out_of_offboard_is_not_fought(flown: Make) -> None:
    rig = flown().flying().follow(3.0)
    asked = len(rig.orders(SET_MODE))
    rig.pilot.custom_mode = POSCTL
    rig.follow(5.0)
    assert len(rig.orders(SET_MODE)) == asked
    assert not rig.firmware.is_steerable(rig.vehicle())
    rig.firmware.release(rig.vehicle())
    quiet_s = rig.clock.now()
    rig.run(3.0)
    assert rig.setpoints(quiet_s) == []


def test_a_hold_that_is_taken_back_at_once_is_not_somebody_elses_doing(flown: Make) -> None:
    """One veto of the guard, then the next set-point passes: Hold shows when the stream has begun again (flown)."""
    rig = flown().flying().follow(3.0)
    rig.station.comms.commands.submit(rig.firmware.hold(rig.vehicle(), lambda: (15.0, 0.0, 20.0)))
    rig.follow(0.1)
    rig.station.comms.commands.cancel(rig.vehicle().id, "hold")
    out = []
    rig.follow(
        6.0, lambda: out.append(rig.vehicle().telemetry.custom_mode) if rig.firmware.is_steerable(rig.vehicle()) else 0
    )
    assert HOLD in out and len(out) == 60, "it was in Hold, and ours all the time"
    assert rig.vehicle().telemetry.custom_mode == OFFBOARD


def test_after_an_offboard_flight_it_is_put_into_hold_before_it_is_armed(flown: Make) -> None:
    rig = flown()
    rig.pilot.custom_mode = OFFBOARD
    rig.until(lambda: rig.vehicle().telemetry.custom_mode == OFFBOARD, 2.0)
    assert not rig.firmware.is_prepared(rig.vehicle())
    rig.station.comms.commands.submit(rig.firmware.prepare(rig.vehicle(), lambda action, outcome, why: None))
    rig.until(lambda: rig.firmware.is_prepared(rig.vehicle()), 2.0)


# ---------------------------------------------------------------- when the set-points stop


@pytest.mark.parametrize(
    ("failsafe", "accepted", "word"),
    [
        (5, True, "Hold"),
        (3, True, "RTL"),
        (0, True, "Position mode, without a pilot SINKS"),
        (2, False, "Manual mode, without a pilot FALLS"),
        (4, False, "lands where it is"),
        (6, False, "TERMINATES"),
        (7, False, "DISARMS"),
        (99, False, "99"),
        (None, False, "not read yet"),
    ],
)
def test_what_it_does_without_set_points_is_read_shown_and_accepted_or_not(
    flown: Make, monkeypatch: pytest.MonkeyPatch, failsafe: int | None, accepted: bool, word: str
) -> None:
    monkeypatch.setattr(Pilot, "failsafe", failsafe)
    rig = flown()
    problem = rig.firmware.start_problem(rig.vehicle())
    assert (problem == "") is accepted, problem
    assert word in rig.firmware.if_silent(rig.vehicle())
    assert accepted or "COM_OBL_RC_ACT" in problem


def test_a_parameter_that_changes_in_flight_and_a_reboot_are_noticed(flown: Make) -> None:
    rig = flown()
    rig.pilot.failsafe = 7  # type: ignore[misc]
    rig.pilot.tell_parameter({"param_id": "COM_OBL_RC_ACT"})
    rig.run(0.1)
    assert "DISARMS" in rig.firmware.start_problem(rig.vehicle())
    rig.pilot.failsafe = None  # type: ignore[misc]
    rig.station.comms.firmware.forget(rig.vehicle())
    rig.run(0.1)
    assert "not read yet" in rig.firmware.start_problem(rig.vehicle())
