"""Bad input B.6-38…51: acknowledgements, commands to us, control. One test for each case of the catalogue."""

from collections.abc import Callable

import pytest

from tests.hostile.oracle import Oracle
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.records.event_log import ALERT
from tui_gcs.core.uplink.actions import Outcome, RetryClass, VehicleAction

pytestmark = pytest.mark.long  # nearly each is a flight

Attack = Callable[..., Oracle]
HOME: Address = ("sim", 0)
ARM, CALIBRATE, GET_HOME = 400, 241, 410
ACCEPTED, IN_PROGRESS, NOT_IN_CONTROL = 0, 5, 10
OURS = {"target_system": 254, "target_component": 190}
REQUEST_CONTROL = 32100
NO_PARAMETERS = {f"param{i}": 0.0 for i in range(1, 8)}


class Asked:
    """A command of ours that reaches no vehicle: the attack is all the answer it gets."""

    def __init__(
        self, oracle: Oracle, name: str = "arm", retry: RetryClass = RetryClass.START, *, command: int = ARM
    ) -> None:
        self.sent: list[float] = []
        self.ended: list[tuple[Outcome, str]] = []
        self.shown = False
        clock = oracle.flight.clock
        self.action = VehicleAction(
            1,
            name,
            retry,
            send=lambda copy: self.sent.append(clock.now()),
            confirmed=lambda v: self.shown,
            command=command,
            confirm_s=3.0,
            on_done=lambda action, outcome, why: self.ended.append((outcome, why)),
        )
        oracle.flight.station.comms.commands.submit(self.action)


def ack(oracle: Oracle, result: int = ACCEPTED, *, command: int = ARM, to: dict[str, int] = OURS, **who: int) -> None:
    """A COMMAND_ACK arrives from vehicle 1's own address."""
    more = {"progress": 0, "result_param2": 0} | to
    system, component = who.get("system", 1), who.get("component", 1)
    oracle.say("COMMAND_ACK", system, component, HOME, command=command, result=result, **more)


def test_b6_38_an_ack_for_nothing_we_asked_is_ignored(attack: Attack) -> None:
    oracle = attack()
    for _ in range(5):
        ack(oracle, command=GET_HOME)
        oracle.run(0.2)
    oracle.holds(counted="ack for nothing asked")


def test_b6_39_an_ack_of_another_system_or_component_is_ignored(attack: Attack) -> None:
    oracle = attack()
    for who in ({"component": 42}, {"system": 77}):
        asked = Asked(oracle)
        oracle.run(0.2)
        ack(oracle, **who)
        oracle.run(6.0)
        assert asked.ended == [(Outcome.EXPIRED, "")], who
    oracle.holds()


def test_b6_40_an_ack_for_another_station_does_not_complete_ours(attack: Attack) -> None:
    oracle = attack()
    asked = Asked(oracle)
    oracle.run(0.2)
    ack(oracle, to={"target_system": 250, "target_component": 190})
    oracle.run(6.0)
    assert asked.ended == [(Outcome.EXPIRED, "")] and len(asked.sent) == 3
    oracle.holds(counted="ack for another station")


def test_b6_41_accepted_and_not_shown_ends_as_that_with_an_alarm(attack: Attack) -> None:
    oracle = attack()
    asked = Asked(oracle)
    oracle.run(0.2)
    ack(oracle)
    oracle.run(3.5)
    assert [outcome for outcome, _ in asked.ended] == [Outcome.NOT_CONFIRMED]
    oracle.holds(told="arm: accepted, not confirmed")
    assert [event.severity for event in oracle.told("not confirmed")] == [ALERT]


def test_b6_42_unknown_results_and_garbage_in_the_rest(attack: Attack) -> None:
    oracle = attack()
    for result in (11, 255):
        asked = Asked(oracle)
        oracle.run(0.1)
        ack(oracle, result, to=OURS | {"progress": 255, "result_param2": -(2**31)})
        oracle.run(1.0)
        assert asked.ended == [(Outcome.REFUSED, f"unknown result {result}")]
        assert oracle.told(f"unknown result {result}")
    oracle.holds(told="unknown result")


def test_b6_43_in_progress_for_ever_ends_after_a_minute(attack: Attack) -> None:
    oracle = attack()
    asked = Asked(oracle, "calibrate", RetryClass.SET, command=CALIBRATE)
    for _ in range(59):
        ack(oracle, IN_PROGRESS, command=CALIBRATE)
        oracle.run(1.0)
    assert asked.ended == [] and len(asked.sent) == 1
    for _ in range(3):
        ack(oracle, IN_PROGRESS, command=CALIBRATE)
        oracle.run(1.0)
    assert asked.ended == [(Outcome.NOT_CONFIRMED, "still in progress")]
    oracle.holds(told="still in progress")


def test_b6_44_a_hundred_copies_of_an_ack_are_one_completion(attack: Attack) -> None:
    oracle = attack()
    asked = Asked(oracle)
    for _ in range(50):
        ack(oracle)
    oracle.run(0.1)
    asked.shown = True
    for _ in range(50):
        ack(oracle)
    oracle.run(1.0)
    assert asked.ended == [(Outcome.CONFIRMED, "")]
    oracle.holds(counted="repeated ack")


def test_b6_45_a_late_ack_is_reported_as_late_and_is_not_the_next_commands(attack: Attack) -> None:
    oracle = attack()
    first = Asked(oracle)
    oracle.run(16.0)
    assert first.ended == [(Outcome.EXPIRED, "")]
    ack(oracle, 4)
    oracle.run(0.1)
    second = Asked(oracle)
    oracle.run(2.5)
    assert len(second.sent) == 3 and second.ended == []
    oracle.run(3.0)
    assert second.ended == [(Outcome.EXPIRED, "")]
    oracle.holds(counted="late ack", told="arm: failed, .* after it was given up: not counted")


def test_b6_45_a_late_refusal_does_not_end_a_command_that_is_under_way_already(attack: Attack) -> None:
    """It cannot be matched to a copy: so all copies are sent, and the vehicle's state decides."""
    oracle = attack()
    first = Asked(oracle)
    oracle.run(6.0)
    assert first.ended == [(Outcome.EXPIRED, "")]
    second = Asked(oracle)
    ack(oracle, 4)
    oracle.run(2.5)
    assert len(second.sent) == 3 and second.ended == []
    second.shown = True
    oracle.run(0.1)
    assert second.ended == [(Outcome.CONFIRMED, "")]
    oracle.holds()


def test_b6_46_unrelated_acks_do_not_renew_the_tries(attack: Attack) -> None:
    oracle = attack()
    asked = Asked(oracle, "calibrate", RetryClass.SET, command=CALIBRATE)

    def unrelated() -> None:
        ack(oracle, command=GET_HOME)

    oracle.run(10.0, unrelated)
    assert len(asked.sent) == 5 and asked.sent[-1] - asked.sent[0] < 3.0
    assert asked.ended == [(Outcome.EXPIRED, "")]
    oracle.holds(counted="ack for nothing asked")


def test_b6_47_another_station_in_control_is_reported(attack: Attack) -> None:
    oracle = attack()
    asked = Asked(oracle)
    oracle.run(0.1)
    ack(oracle, NOT_IN_CONTROL)
    oracle.run(1.0)
    assert asked.ended == [(Outcome.REFUSED, "another station has control")]
    oracle.holds(told="another station has control")


def control_status(oracle: Oracle, gcs: int, *, flags: int = 1, component: int = 1) -> None:
    oracle.say("CONTROL_STATUS", 1, component, flags=flags, gcs_main=gcs, gcs_secondary=[0] * 10)


def test_b6_48_control_status_of_a_stranger_is_ignored_and_flapping_is_reported_once_a_second(attack: Attack) -> None:
    oracle = attack()
    control = oracle.flight.station.services.control
    control_status(oracle, 66, component=25)
    control_status(oracle, 67, flags=0)
    oracle.run(0.2)
    assert control.in_control(1) == -1
    numbers = iter(range(10_000))
    oracle.run(5.0, lambda: control_status(oracle, 1 + next(numbers) % 250))
    control_status(oracle, 42)
    oracle.run(0.1)
    assert control.in_control(1) == 42
    oracle.holds(counted="control status of who does not manage the system", told="GCS .* has control")
    assert len(oracle.told("has control")) <= 6


def answers(address: Address, message: str) -> bool:
    return address == HOME and message == "COMMAND_ACK"


def command(oracle: Oracle, number: int) -> None:
    oracle.say("COMMAND_LONG", 1, command=number, confirmation=0, **NO_PARAMETERS, **OURS)


def test_b6_49_a_vehicle_that_commands_us_is_refused(attack: Attack) -> None:
    oracle = attack()
    place = {"frame": 0, "current": 0, "autocontinue": 0, "x": 0, "y": 0, "z": 0.0}
    parameters = {f"param{i}": 0.0 for i in range(1, 5)}

    def command_us() -> None:
        command(oracle, ARM)
        oracle.say("COMMAND_INT", 1, command=192, **parameters, **place, **OURS)

    oracle.run(4.0, command_us)
    reported = [frame for frame in oracle.sent() if frame[2] == "COMMAND_ACK"]
    assert 3 <= len(reported) <= 5, "one a second at most"
    assert {payload[2] for *_, payload in reported} == {3}, "UNSUPPORTED"
    oracle.holds(counted="command to us", told="commands us", sends=answers)


def test_b6_50_what_would_steer_or_change_a_vehicle_is_not_for_us_and_goes_nowhere(attack: Attack) -> None:
    oracle = attack()
    for _ in range(20):
        oracle.say("MANUAL_CONTROL", 1, target=254, x=1000, y=0, z=1000, r=0, buttons=0)
        oracle.say("SET_MODE", 1, target_system=2, base_mode=1, custom_mode=9)
        channels = {f"chan{i}_raw": 1900 for i in range(1, 9)}
        oracle.say("RC_CHANNELS_OVERRIDE", 1, target_system=2, target_component=1, **channels)
        parameter = {"param_id": "ANGLE_MAX", "param_value": 1.0, "param_type": 9}
        oracle.say("PARAM_SET", 1, target_system=2, target_component=1, **parameter)
        oracle.run(0.1)
    oracle.holds()


def test_b6_51_a_flood_of_requests_for_control_is_denied_once_a_second(attack: Attack) -> None:
    oracle = attack()
    oracle.run(5.0, lambda: command(oracle, REQUEST_CONTROL))
    reported = [payload for _, _, name, payload in oracle.sent() if name == "COMMAND_ACK"]
    assert 4 <= len(reported) <= 6 and {payload[2] for payload in reported} == {2}, "DENIED"
    oracle.holds(counted="command to us", told="asks us for control: denied", sends=answers)
    assert len(oracle.told("asks us for control")) == 1
