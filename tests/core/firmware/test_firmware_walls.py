"""`core/firmware` is the only place that knows an autopilot's name, its modes and their numbers."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import tui_gcs.core
from tui_gcs.core.firmware.ardupilot import ArduCopter
from tui_gcs.core.firmware.base import Firmware
from tui_gcs.core.firmware.px4 import Px4Multicopter

CORE = Path(tui_gcs.core.__file__).parent
NAMES = re.compile(r"AUTOPILOT_(ARDUPILOT|PX4)|\b(GUIDED|BRAKE|OFFBOARD|LOITER|POSHOLD|STABILIZE|QLAND)\b")
MAY_KNOW = {"mavlink/enum_names.py", "mavlink/mode_names.py", "mavlink/high_latency.py"}
"""The numbers of MAVLink and of the autopilots' modes, and their names, are written down there."""


def words(path: Path) -> Iterator[tuple[int, str]]:
    """Names and strings of a file's code; its docstrings say what they like."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.lineno, node.id
        elif isinstance(node, ast.alias):
            yield node.lineno, node.name
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
            yield node.lineno, node.value


@pytest.mark.long
def test_no_other_part_of_the_core_names_autopilots_or_modes() -> None:
    found = [
        f"{path.relative_to(CORE)}:{line} {word!r}"
        for path in sorted(CORE.rglob("*.py"))
        if "firmware" not in path.parts and str(path.relative_to(CORE)) not in MAY_KNOW
        for line, word in words(path)
        if NAMES.search(word)
    ]
    assert found == []


def test_the_search_finds_what_it_is_for() -> None:
    assert any(NAMES.search(word) for _, word in words(CORE / "firmware" / "ardupilot.py"))
    assert any(NAMES.search(word) for _, word in words(CORE / "firmware" / "streams.py"))


BY_ITSELF = {"request_prearm_reasons", "tick", "release"}
"""What an autopilot may leave as it is: it sends nothing."""


@pytest.mark.parametrize("kind", [ArduCopter, Px4Multicopter])
def test_every_kind_can_all_that_the_station_wants(kind: type) -> None:
    wanted = {name for name in vars(Firmware) if not name.startswith("_")} - BY_ITSELF
    inherited = {name for name in wanted if getattr(kind, name) is getattr(Firmware, name)}
    assert inherited <= {"setpoint_gap_s"}
