"""Files on our own disk against B.6-97 (scenarios), 98 (places of ours) and 99 (recordings)."""

import time
from pathlib import Path

import pytest

from tests.cli.test_main import DATA, SCENARIO, refused
from tui_gcs.core.judging.tlog_summary import summarize
from tui_gcs.core.records.tlog_reader import TlogError, read_tlog
from tui_gcs.core.scenario.load import ScenarioError, load

EVIL_SCENARIOS = {
    "large": b"# " + b"a" * (1 << 24),
    "deep": b"a = " + b"[" * 100_000,
    "deep, in short lines": b"a = " + b"[\n" * 20_000,
    "a number of 5000 digits": b"format = " + b"9" * 5000,
    "no number": SCENARIO.read_bytes().replace(b"speed_m_s = 8.0", b"speed_m_s = nan"),
    "endless": SCENARIO.read_bytes().replace(b"speed_m_s = 8.0", b"speed_m_s = inf"),
    "a key twice": b"format = 1\nformat = 1\n",
    "a lone surrogate": b'name = "\xed\xa0\x80"\n',
    "UTF-16": "format = 1\n".encode("utf-16"),
    "empty": b"",
    "zeros": bytes(4096),
}


@pytest.mark.parametrize("data", EVIL_SCENARIOS.values(), ids=list(EVIL_SCENARIOS))
def test_b6_97_a_scenario_that_is_none_is_one_clear_error_at_once(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "evil.toml"
    path.write_bytes(data)
    began_s = time.process_time()
    with pytest.raises(ScenarioError) as error:
        load(path)
    assert time.process_time() - began_s < 1.0
    assert "evil.toml" in str(error.value) and "Traceback" not in str(error.value)
    assert max(map(len, str(error.value).splitlines())) < 400
    assert path.read_bytes() == data


def test_b6_98_a_folder_of_ours_that_is_a_link_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the user names may be a link of his; the folder below it that we made may not."""
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "named").mkdir()
    (tmp_path / "named/live").symlink_to(tmp_path / "elsewhere")
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "named"))
    reported = refused("keys", "list")
    assert "live" in reported and "link" in reported
    assert not list((tmp_path / "elsewhere").iterdir())


@pytest.mark.parametrize("share", [0.0, 0.001, 0.25, 0.5, 0.999])
def test_b6_99_of_a_recording_cut_anywhere_the_valid_part_is_given(tmp_path: Path, share: float) -> None:
    whole = (DATA / "px4-8.tlog").read_bytes()
    cut = tmp_path / "cut.tlog"
    cut.write_bytes(whole[: round(share * len(whole))])
    try:
        frames = [frame.raw for _, frame in read_tlog(cut)]
    except TlogError as error:
        assert share == 0.0 and "cut.tlog" in str(error)
        return
    rest = [frame.raw for _, frame in read_tlog(DATA / "px4-8.tlog")][: len(frames)]
    assert frames == rest
    assert len(frames) >= share * 0.98 * len(rest)
    assert summarize(cut).frames == len(frames)
