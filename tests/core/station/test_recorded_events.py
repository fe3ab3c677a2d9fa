"""A replay reports what the station's journal has of the flight, and goes to its alarms."""

from pathlib import Path

import msgspec

from tests.core.station.test_replay_control import control, replay
from tests.core.station.test_replay_player import START_S, Console, heartbeats
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.replay import ReplayAct

HOLDS_ALONE = ("alarm", 4, "holds alone: vehicle 7")


def line(at_s: float, cls: str, severity: int, text: str) -> str:
    event = m.JournalEvent(1, 900.0, START_S + at_s, m.EventClass(cls), severity, cls, text)
    return msgspec.json.encode(event).decode() + "\n"


def flight(folder: Path, *events: tuple[float, str, int, str], more: str = "") -> Console:
    """A paused replay of 30 s of one vehicle, with a journal of events: seconds, class, severity and text."""
    log = heartbeats(folder / "a.tlog", [float(second) for second in range(31)])
    log.with_suffix(".jsonl").write_text("".join(line(*event) for event in events) + more)
    console = Console(log)
    control(console, ReplayAct.PAUSE)
    return console


def texts(console: Console) -> list[str]:
    return [event.text for event in console.ask(m.GetEvents(after=0)).events]


def test_the_next_alarm_is_one_that_only_the_station_could_find(tmp_path: Path) -> None:
    console = flight(tmp_path, (12.0, *HOLDS_ALONE), (20.0, "alarm", 6, "over: holds alone: vehicle 7"))
    control(console, ReplayAct.NEXT_ALARM)
    assert 12.0 <= console.player.at_s <= 13.0
    assert "holds alone: vehicle 7" in texts(console)
    assert replay(console).said == "holds alone: vehicle 7"
    control(console, ReplayAct.GO_TO, 25.0)
    control(console, ReplayAct.PREVIOUS_ALARM)
    assert 12.0 <= console.player.at_s <= 13.0, "what is over is no alarm"
    assert replay(console).said == "holds alone: vehicle 7"
    control(console, ReplayAct.PAUSE)
    console.run(8.0)
    assert replay(console).said == "", "it was some seconds ago"


def test_orders_and_planners_are_events_of_the_replay_and_those_of_vehicles_are_not_twice(tmp_path: Path) -> None:
    console = flight(
        tmp_path,
        (3.0, "operator", 6, "hold: vehicle 7"),
        (4.0, "vehicle", 6, "from the journal"),
        (5.0, "planner", 4, "planner worker is gone"),
    )
    control(console, ReplayAct.GO_TO, 10.0)
    assert {"hold: vehicle 7", "planner worker is gone"} <= set(texts(console))
    assert "from the journal" not in texts(console)
    control(console, ReplayAct.GO_TO, 1.0)
    assert "hold: vehicle 7" not in texts(console), "it did not happen yet"


def test_an_alarm_that_telemetry_shows_too_is_reported_once(tmp_path: Path) -> None:
    lost = ("alarm", 3, "LOST in the air: vehicle 7")
    log = heartbeats(tmp_path / "a.tlog", [0.0, 1.0, 9.0, 10.0, 11.0], 81 | 128)
    log.with_suffix(".jsonl").write_text(line(4.5, *lost))
    console = Console(log)
    console.run(12.0)
    assert texts(console).count(lost[2]) == 1
    assert not [text for text in texts(console) if text.startswith("over:")], "the journal does not say so"


def test_a_damaged_or_hostile_journal_harms_no_replay(tmp_path: Path) -> None:
    console = flight(tmp_path, (2.0, "alarm", 4, "\x1b[2J\u202ehidden"), more='{"cls":"alarm", half a line\n\x00\xff\n')
    control(console, ReplayAct.GO_TO, 5.0)
    (text,) = [text for text in texts(console) if "hidden" in text]
    assert "\x1b" not in text and "\u202e" not in text
