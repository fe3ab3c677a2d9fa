"""Pictures of screens as plain text, committed in `snapshots`."""

import os
from pathlib import Path

SNAPSHOTS = Path(__file__).parents[1] / "snapshots"


def same_as_snapshot(name: str, text: str) -> bool:
    """Compare with the committed picture; `UPDATE_SNAPSHOTS=1` takes the present one instead."""
    path = SNAPSHOTS / f"{name}.txt"
    if os.environ.get("UPDATE_SNAPSHOTS"):
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return path.read_text(encoding="utf-8") == text
