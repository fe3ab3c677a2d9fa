"""Our signer and verifier in conversation with simulated autopilots, whose signing shares no code with ours.

The station beats at 1 Hz to whoever holds the key, whatever its frames are worth: autopilots count their time from what
they hear, so a vehicle that was switched off is believed only after it heard us.
"""

from collections import Counter

import pytest

from sitl.launch.fleet import SimFleet, VehicleSpec
from sitl.links.signing import SigningSpec
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.signing import TICKS_PER_S, SignatureResult, SignatureVerifier, SigningClock, sign, ticks

KEY = bytes(range(32))
WALL_S = 1_790_000_000.0
NOW = ticks(WALL_S)
REBOOT = 246
HOUR = 3600


class Conversation:
    """One vehicle and one station, in virtual time."""

    def __init__(self, signing: SigningSpec) -> None:
        self.fleet = SimFleet([VehicleSpec(1, 52.0, -0.6, 110.0, signing=signing)], boot_s=1.0)
        self.wall_offset_s = WALL_S
        self.encoder = Encoder(255, 190)
        self.clock = SigningClock(self.wall_s, 0.0)
        self.verifier = SignatureVerifier(KEY)

    @property
    def wall_s(self) -> float:
        return self.wall_offset_s + self.fleet.now_s

    def say(self, name: str, **fields: object) -> None:
        timestamp = self.clock.next(self.wall_s, self.fleet.now_s)
        self.fleet.receive(0, sign(self.encoder.encode(name, **fields), KEY, 0, timestamp))

    def run(self, seconds: float, *, beats: bool = True) -> Counter[SignatureResult]:
        """What the vehicle's frames were worth."""
        verdicts: Counter[SignatureResult] = Counter()
        for step in range(round(seconds * 10)):
            if beats and step % 10 == 0:
                beat = {"type": 6, "autopilot": 8, "base_mode": 0, "custom_mode": 0, "system_status": 0}
                self.say("HEARTBEAT", **beat, mavlink_version=3)
            self.fleet.step(0.1)
            for _, data in self.fleet.drain():
                if data[0] != 0xFD:
                    continue  # ArduPilot's boot text
                verdict = self.verifier.check(data, self.wall_s)
                verdicts[verdict] += 1
                if verdict is SignatureResult.GOOD:
                    timestamp = int.from_bytes(data[-12:-6], "little")
                    self.clock.follow(timestamp, self.wall_s, self.fleet.now_s)
        return verdicts

    def command(self, number: int, *p: float) -> bool:
        """Whether it is acknowledged, believably."""
        self.fleet.drain()
        values = {f"param{n + 1}": value for n, value in enumerate((*p, *(0.0,) * (7 - len(p))))}
        self.say("COMMAND_LONG", target_system=1, target_component=1, command=number, confirmation=0, **values)
        return any(
            data[7:10] == b"\x4d\0\0" and self.verifier.check(data, self.wall_s) is SignatureResult.GOOD
            for _, data in self.fleet.drain()
        )

    def restart_station(self) -> None:
        """As after a crash: what was stored a second ago is all that is left."""
        stored, streams = self.clock.last, self.verifier.streams()
        self.run(1.0)
        self.clock = SigningClock(self.wall_s, self.fleet.now_s, stored)
        self.verifier = SignatureVerifier(KEY)
        self.verifier.restore(streams)

    def all_is_well(self) -> None:
        """Everything is believed on both sides."""
        assert set(self.run(5.0)) == {SignatureResult.GOOD}
        assert self.command(176, 1, 4)


@pytest.fixture(params=["ardupilot", "px4"])
def talk(request: pytest.FixtureRequest) -> Conversation:
    conversation = Conversation(SigningSpec(KEY, NOW - 10 * TICKS_PER_S, px4=request.param == "px4"))
    conversation.run(3.0)
    return conversation


def test_both_believe_each_other(talk: Conversation) -> None:
    talk.all_is_well()
    assert set(talk.run(120.0)) == {SignatureResult.GOOD}
    talk.all_is_well()


@pytest.mark.parametrize("px4", [False, True])
def test_a_vehicle_that_was_switched_off_for_days_is_believed_once_it_heard_us(px4: bool) -> None:
    talk = Conversation(SigningSpec(KEY, NOW - 3 * 24 * HOUR * TICKS_PER_S, px4=px4))
    assert set(talk.run(20.0, beats=False)) == {SignatureResult.TOO_OLD_NEW_STREAM}
    talk.run(1.0)
    talk.all_is_well()


def test_a_restarted_station_is_deaf_for_a_vehicle_that_does_not_hear_it(talk: Conversation) -> None:
    """Its time counts frames: without us it takes an hour to pass the margin that is added to what was stored."""
    talk.restart_station()
    assert set(talk.run(20.0, beats=False)) == {SignatureResult.OLD}
    talk.run(1.0)
    talk.all_is_well()


def test_a_vehicle_that_reboots(talk: Conversation) -> None:
    talk.run(65.0)
    assert talk.command(REBOOT, 1)
    talk.run(2.0)
    talk.all_is_well()


def test_a_station_that_dies_and_starts_again_and_again(talk: Conversation) -> None:
    for _ in range(5):
        talk.restart_station()
        talk.run(2.0)
        talk.all_is_well()


@pytest.mark.parametrize("step_s", [HOUR, -HOUR, 10 * 365 * 24 * HOUR])
def test_our_wall_clock_is_set_while_we_talk(talk: Conversation, step_s: float) -> None:
    talk.wall_offset_s += step_s
    talk.all_is_well()
    talk.wall_offset_s -= step_s
    talk.all_is_well()


def test_a_vehicle_an_hour_ahead_is_quarantined_until_its_time_has_come() -> None:
    talk = Conversation(SigningSpec(KEY, NOW + HOUR * TICKS_PER_S))
    assert set(talk.run(5.0)) == {SignatureResult.AHEAD}
    assert talk.clock.next(talk.wall_s, talk.fleet.now_s) < NOW + 6 * TICKS_PER_S, "it does not pull us along"
    talk.wall_offset_s += HOUR + 120
    assert talk.run(3.0)[SignatureResult.GOOD] > 0
    talk.all_is_well()
