"""The pictures of the README and the manual are taken from the console by scripts that still work."""

import re
from pathlib import Path

import pytest

from tui_gcs.cli.main import main

DOCS = Path(__file__).parents[2] / "docs"
MAX_BYTES = 400_000


@pytest.fixture(autouse=True)
def scripts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))


@pytest.mark.parametrize("name", ["fly.svg", "plan.svg", "vehicles.svg", "flight.svg"])
def test_a_picture_is_small_and_asks_nobody_for_anything(name: str) -> None:
    picture = (DOCS / name).read_text(encoding="utf-8")
    assert len(picture.encode()) < MAX_BYTES
    assert set(re.findall(r"https?://[^\"')]*", picture)) <= {"http://www.w3.org/2000/svg"}
    assert "@import" not in picture
    assert "@font-face" not in picture


@pytest.mark.endurance
async def test_the_scripts_take_them_from_the_console(tmp_path: Path) -> None:
    import make_pictures
    import make_recording

    file = tmp_path / "field.toml"
    assert main(["scenario", "new", str(file), "--vehicles", "2"]) == 0
    # Two vehicles over a small zone: nothing is searched for long.
    file.write_text(file.read_text(encoding="utf-8").replace("radius_m = 80.0", "radius_m = 25.0"), encoding="utf-8")
    await make_pictures.main(tmp_path, 5.0, str(file))
    for name, word in (("fly.svg", "field"), ("plan.svg", "round"), ("vehicles.svg", "vehicles")):
        assert word in (tmp_path / name).read_text(encoding="utf-8")
    moving = await make_recording.record(3, str(file))
    assert moving.count("@keyframes") > 1
    assert "step-end infinite" in moving
    assert "field" in moving


def test_a_row_is_drawn_once_while_it_stays_the_same() -> None:
    import make_recording

    frames = [{0: "a", 1: "x"}, {0: "a", 1: "y"}, {0: "a", 1: "y"}]
    assert make_recording.runs(frames) == {(0, 3): ["a"], (0, 1): ["x"], (1, 3): ["y"]}
    picture = make_recording.animated(frames, {"fill: #fff": "s0"})
    assert picture.count(">a<") == picture.count(">y<") == 1
    assert "33.333% { visibility: visible }" in picture
