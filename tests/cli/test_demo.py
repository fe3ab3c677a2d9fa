"""`tui-gcs demo` where a SIM station runs already: it attaches to that one, and ignores no option."""

import sys
from unittest.mock import patch

import pytest

from tui_gcs.cli.main import main
from tui_gcs.core.protocol.common import RunKind


@pytest.fixture
def attached(monkeypatch: pytest.MonkeyPatch) -> list[RunKind]:
    """The kinds of station to which consoles were attached; one runs, and there is a terminal."""
    kinds: list[RunKind] = []
    monkeypatch.setattr("tui_gcs.cli.demo.running", lambda kind: True)
    monkeypatch.setattr("tui_gcs.cli.demo.need_terminal", lambda: None)
    monkeypatch.setattr("tui_gcs.cli.console.attach", lambda kind, *_, **__: kinds.append(kind) or 0)
    return kinds


def demo(*options: str) -> int:
    """Run it as on a terminal; without one it would fly headless."""
    with patch.object(sys.stdout, "isatty", return_value=True):
        return main(["demo", *options])


def test_it_attaches_to_the_station_that_runs(attached: list[RunKind]) -> None:
    assert demo("--plain") == 0
    assert attached == [RunKind.SIM]


@pytest.mark.parametrize(
    ("option", "value"),
    [("--seed", "0"), ("--planner", "mine.py"), ("--scenario", "mine.toml"), ("--fault", "loss=0.1")],
)
def test_what_only_a_new_station_takes_is_refused(
    attached: list[RunKind], option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert demo(option, value) == 2
    assert f"a SIM station runs already: {option} is for a new one" in capsys.readouterr().err
    assert not attached
