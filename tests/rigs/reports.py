"""Reads what commands print with `--json`: one document of the documented shape, and nothing beside it."""

import re
from pathlib import Path
from typing import Any

import msgspec

from tui_gcs.cli.command_report import CommandReport
from tui_gcs.core.protocol.common import StationStatus, VehicleRow
from tui_gcs.core.protocol.services import VehicleInfo

PAGE = Path(__file__).parents[2] / "docs/reference/json.md"
SECTION = "## Data of each command"
ROW = re.compile(r"^\| `([^|]+)` \|(.*?)\|(.*?)\|$", re.MULTILINE)


class Keys(msgspec.Struct):
    """The keys that a command's document may have."""

    data: set[str]
    vehicle_data: set[str]


def documented() -> dict[str, Keys]:
    """The keys in `data` and in each vehicle's `data`, by command, as the page of the manual lists them."""
    found: dict[str, Keys] = {}
    for commands, data, vehicle_data in ROW.findall(PAGE.read_text(encoding="utf-8").partition(SECTION)[2]):
        for command in commands.split("`, `"):
            found[command] = Keys(_keys(data), _keys(vehicle_data))
    return found


STRUCTS: dict[str, tuple[str, ...]] = {
    "StationStatus": StationStatus.__struct_fields__,
    "VehicleInfo": VehicleInfo.__struct_fields__,
    "VehicleRow": VehicleRow._fields,
}
"""The fields of structs that the page names."""


def _keys(cell: str) -> set[str]:
    names = re.findall(r"`(\w+)`", cell)
    return {key for name in names for key in STRUCTS.get(name, (name,))}


def report_of(text: str, command: str = "") -> dict[str, Any]:
    """Return the document that is all of `text`; it has no field but the documented ones.

    With a command, `data` has no keys but those that the manual lists for it.
    """
    report = msgspec.json.decode(text, type=CommandReport)
    assert text.endswith("\n")
    assert bool(report.code) is not report.ok
    assert report.ok <= all(entry.ok for entry in report.vehicles)
    assert all(bool(entry.code) is not entry.ok for entry in report.vehicles)
    ids = [entry.vehicle for entry in report.vehicles]
    assert len(ids) == len(set(ids)), "one entry for each vehicle"
    if command:
        keys = documented()[command]
        assert set(report.data) <= keys.data, command
        for entry in report.vehicles:
            assert set(entry.data) <= keys.vehicle_data, command
    document: dict[str, Any] = msgspec.json.decode(text)
    return document
