"""A run whose station is silent."""

import pytest

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.flights.station_keeper import START_GAP_S, StationKeeper


class Supervised:
    """A supervisor that may be dead, on a clock that the test sets."""

    def __init__(self) -> None:
        self.now_s, self.lives, self.started = 100.0, True, 0
        self.keeper = StationKeeper(lambda: self.lives, self.start, lambda: self.now_s)

    def start(self) -> None:
        self.started += 1

    def after(self, seconds: float, *, in_flight: bool = True) -> str:
        """What is shown when the station was silent for so much longer."""
        self.now_s += seconds
        return self.keeper.look(in_flight=in_flight)


def test_silence_is_shown_until_the_station_is_heard() -> None:
    station = Supervised()
    assert station.after(2.0) == ""
    assert station.after(23.0) == "STATION SILENT for 25 s"
    station.keeper.heard()
    assert station.after(0.1) == ""


def test_a_supervisor_that_lives_is_left_to_start_its_station() -> None:
    station = Supervised()
    station.after(60.0)
    assert not station.started


def test_without_a_supervisor_the_station_is_started_again_for_vehicles_in_the_air() -> None:
    station = Supervised()
    station.lives = False
    station.after(5.0, in_flight=False)
    assert not station.started
    for _ in range(3):
        station.after(1.0)
    assert station.started == 1, "it has its time to come up"
    station.after(START_GAP_S)
    assert station.started == 2


def test_a_start_that_fails_is_told_and_tried_again(capsys: pytest.CaptureFixture[str]) -> None:
    station = Supervised()
    station.lives = False

    def fails() -> None:
        raise CommandError("port 14550 is busy")

    keeper = StationKeeper(lambda: False, fails, lambda: station.now_s)
    for _ in range(2):
        station.now_s += START_GAP_S
        assert keeper.look(in_flight=True)
    assert capsys.readouterr().err.count("cannot be started again: port 14550 is busy") == 2
