"""No source names a document that is not in the repository."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCES = [path for top in ("tui_gcs", "sitl", "tests") for path in sorted((ROOT / top).rglob("*.py"))]
NAMED = re.compile(r"(?<![\w/{}*-])((?:[\w-]+/)*[\w-]+\.md)\b")


def test_documents_that_sources_name_are_there() -> None:
    missing = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in SOURCES
        if path.parent.name != "docs"
        for name in NAMED.findall(path.read_text(encoding="utf-8"))
        if not (ROOT / name).is_file()
    ]
    assert missing == []
