"""`tui-gcs planner log`: the newest lines that fit, from as many pieces as needed, and what is refused."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.main import main
from tui_gcs.cli.planner import log as verb
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol.bus import REQUEST, MemoryBus
from tui_gcs.core.protocol.common import Reply, decode, encode
from tui_gcs.core.protocol.planner_log import GetPlannerLog, PlannerLogLevel
from tui_gcs.core.protocol.services import ServiceReply
from tui_gcs.core.records.planner_log import PlannerLog


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[PlannerLog]:
    """A log of 3000 lines, 64 kB of them for one answer, behind the bus of a station."""
    held = PlannerLog(tmp_path / "run-planners.log", lambda: 1_790_000_000.0)
    for number in range(3000):
        level = PlannerLogLevel.ERROR if number % 1000 == 5 else PlannerLogLevel.STDOUT
        held.write("red" if number % 2 else "blue", "patrol", level, f"line {number} \x1b[31m")
    bus = MemoryBus()

    def answer(_key: str, payload: bytes, reply: Callable[[bytes], None]) -> None:
        request = decode(payload, GetPlannerLog)
        piece = held.after(request.at) if request.newer else held.before(request.at)
        reply(encode(ServiceReply(ok=True, planner_log=piece)))

    bus.answer(REQUEST.format(principal="*"), answer)
    monkeypatch.setattr(verb, "which", lambda _named: RunKind.SIM)
    monkeypatch.setattr(verb, "join", lambda _kind: bus)
    yield held
    held.close()


def test_the_newest_lines_that_fit_are_printed(log: PlannerLog, capsys: pytest.CaptureFixture[str]) -> None:
    log.left_out = 7
    assert main(["planner", "log", "--level", "error", "--lines", "2"]) == 0
    out, err = capsys.readouterr()
    want = "2026-09-21T14:13:20Z red patrol error    line {} ␛[31m"
    assert out.splitlines() == [want.format(1005), want.format(2005)]
    assert "7 lines were left out" in err


def test_teams_and_words_are_chosen(log: PlannerLog, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["planner", "log", "--team", "blue", "--words", "998"]) == 0
    assert [text.split()[5] for text in capsys.readouterr().out.splitlines()] == ["998", "1998", "2998"]


def test_the_report_holds_file_and_lines(log: PlannerLog, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["planner", "log", "--lines", "1", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["data"]["file"] == str(log.path)
    line = {"wall_s": 1_790_000_000.0, "team": "red", "planner": "patrol", "level": "stdout", "text": "line 2999 ␛[31m"}
    assert report["data"]["lines"] == [line]


def test_new_lines_are_followed_until_ctrl_c(
    log: PlannerLog, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def sleep(_seconds: float) -> None:
        if "new" in capsys.readouterr().out:
            raise KeyboardInterrupt
        log.write("red", "patrol", PlannerLogLevel.STDERR, "new")
        log.write("blue", "patrol", PlannerLogLevel.STDERR, "of another team")
        seen.append(1)
        assert len(seen) < 3

    seen: list[int] = []
    monkeypatch.setattr(verb.time, "sleep", sleep)
    assert main(["planner", "log", "--team", "red", "--follow"]) == 0
    assert len(seen) == 1


@pytest.mark.parametrize(
    ("words", "why"),
    [(["--lines", "-1"], "--lines: from 0 to 10000"), (["--follow", "--json"], "--follow does not end by itself")],
)
def test_what_makes_no_sense_is_refused(
    log: PlannerLog, capsys: pytest.CaptureFixture[str], words: list[str], why: str
) -> None:
    assert main(["planner", "log", *words]) == 2
    assert why in "".join(capsys.readouterr())


def test_a_station_without_a_log_says_so() -> None:
    bus = MemoryBus()
    refusal = Reply(ok=False, text="this station keeps no planner log")
    bus.answer(REQUEST.format(principal="*"), lambda _key, _data, reply: reply(encode(refusal)))
    with pytest.raises(CommandError, match="this station keeps no planner log"):
        verb.piece_of(bus, GetPlannerLog())
