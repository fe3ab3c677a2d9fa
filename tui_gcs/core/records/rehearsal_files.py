"""Files in the folder of a rehearsal: the scenario as it was flown, the result of each gate, the report.

`tui-gcs rehearse` writes them beside the recording. The console reads them to show which gate failed, and what was
changed in the scenario since.
"""

from dataclasses import dataclass
from difflib import SequenceMatcher
from pathlib import Path

import msgspec

from tui_gcs.core.base.regular_file import open_plain
from tui_gcs.core.base.text import clean

SCENARIO_NAME, RESULT_NAME, REPORT_NAME = "scenario.toml", "result.json", "report.html"
"""The names of the files; a report is written only where one was asked for."""
FILE_NAMES = (SCENARIO_NAME, RESULT_NAME, REPORT_NAME)
MAX_BYTES = 4_000_000
"""A larger file was not written by this program, and is not read."""
MAX_CHANGES, MAX_CELLS = 200, 160


class GateResult(msgspec.Struct, frozen=True):
    """One gate of a rehearsal: the value that was measured, and its limit. None where nothing was measured."""

    name: str
    ok: bool
    value: float | None = None
    limit: float | None = None
    why: str = ""


class _Data(msgspec.Struct):
    checks: tuple[GateResult, ...] = ()


class _Document(msgspec.Struct):
    """The part of a result that is read; the file holds what `--json` prints."""

    data: _Data


@dataclass(frozen=True)
class ScenarioChange:
    """One line of a scenario's text that was changed, added or removed."""

    sign: str
    """`~` changed, `+` added, `-` removed."""
    line: int
    """Number of the line in the newer text; for a removed line in the older one. It begins at 1."""
    text: str


def read_gates(folder: Path) -> tuple[GateResult, ...]:
    """Return the gates of the rehearsal in `folder`, the failed ones first; none where they were not written."""
    data = _read(folder / RESULT_NAME)
    try:
        gates = msgspec.json.decode(data, type=_Document).data.checks if data else ()
    except msgspec.MsgspecError:
        return ()
    return tuple(sorted(gates, key=lambda gate: gate.ok))


def read_scenario_text(folder: Path) -> str | None:
    """Return the text of the scenario that was flown in `folder`; None where it was not kept."""
    try:
        return _read(folder / SCENARIO_NAME).decode() or None
    except UnicodeDecodeError:
        return None


def scenario_changes(before: str, now: str) -> tuple[ScenarioChange, ...]:
    """Return what differs between two texts of a scenario, line by line; at most `MAX_CHANGES` lines."""
    old, new = before.splitlines(), now.splitlines()
    found: list[ScenarioChange] = []
    for kind, a, b, c, d in SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if kind == "equal":
            continue
        pairs = min(b - a, d - c)
        for i in range(pairs):
            found.append(ScenarioChange("~", c + i + 1, _shown(f"{old[a + i].strip()}  ->  {new[c + i].strip()}")))
        found += [ScenarioChange("-", at + 1, _shown(old[at].strip())) for at in range(a + pairs, b)]
        found += [ScenarioChange("+", at + 1, _shown(new[at].strip())) for at in range(c + pairs, d)]
    return tuple(found[:MAX_CHANGES])


def _shown(text: str) -> str:
    return clean(text, MAX_CELLS)


def _read(path: Path) -> bytes:
    """Return the contents of a file; nothing of one that is missing, too large or no plain file."""
    try:
        with open_plain(path) as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError):
        return b""
    return data if len(data) <= MAX_BYTES else b""
