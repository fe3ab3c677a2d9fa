"""Files and packages that the documents name are there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CORE = ROOT / "tui_gcs/core"
DOCUMENTS = [*sorted((ROOT / "docs").rglob("*.md")), ROOT / "CONTRIBUTING.md"]
PATH = re.compile(r"`((?:tui_gcs|sitl|tests|docs)/[\w./-]*)`")
WHERE = re.compile(r"^\| B\.6-\d+ \|.*\| ([^|]*) \|$", re.MULTILINE)
"""The last column of the catalogue of threats."""


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_paths_that_a_document_names_exist(path: Path) -> None:
    named = PATH.findall(path.read_text(encoding="utf-8"))
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_each_threat_names_the_package_that_answers_it() -> None:
    threats = (ROOT / "docs/threats.md").read_text(encoding="utf-8")
    places = {name for cell in WHERE.findall(threats) for name in re.findall(r"`([^`]+)`", cell)}
    packages = {name for name in places if not name.endswith(".py")}
    assert len(packages) > 15
    missing = {n for n in packages if not ((ROOT / n).is_dir() if n.startswith("tui_gcs/") else (CORE / n).is_dir())}
    assert missing == set()
    files = {name for name in places if name.endswith(".py")}
    assert {name for name in files if not list((ROOT / "tui_gcs").rglob(name))} == set()
