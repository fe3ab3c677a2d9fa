"""`tui-gcs run`: what it says before its vehicles fly."""

from pathlib import Path

import pytest
import tomlkit

from tests.core.rigs.rig import toml
from tui_gcs.cli import run
from tui_gcs.cli.main import main


@pytest.fixture(autouse=True)
def nothing_flies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A command up to the start of its station."""
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setattr(run, "start", lambda kind, arguments: None)
    monkeypatch.setattr(run, "_fly", lambda scenario, kind, arguments: 0)


@pytest.mark.parametrize(
    ("return_pct", "reserve_s", "line"),
    [
        (None, None, "returns at 15 %, or with 60 s to spare"),
        (30.0, 90.0, "returns at 30 %, or with 90 s to spare"),
        (0.0, 90.0, "nothing is done (return_pct is 0)"),
    ],
)
def test_it_says_what_is_done_at_a_low_battery(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    return_pct: float | None,
    reserve_s: float | None,
    line: str,
) -> None:
    document = tomlkit.parse(toml())
    del document["battery"]
    if return_pct is not None:
        document["battery"] = {"return_pct": return_pct, "reserve_s": reserve_s}
    path = tmp_path / "field.toml"
    path.write_text(tomlkit.dumps(document))
    assert main(["run", str(path), "--kind", "sim", "--link", "udpin:127.0.0.1:14550"]) == 0
    assert f"tui-gcs: a vehicle with a low battery: {line}\n" in capsys.readouterr().err
