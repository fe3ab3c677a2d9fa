"""Reads files of all formats and writes converted ones, for `check` and `convert`."""

import argparse
import errno
import os
import stat
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tui_gcs.cli.exit_codes import CommandError

if TYPE_CHECKING:
    from tui_gcs.core.formats.base_map_files import BaseMap
    from tui_gcs.core.formats.content import Content, Written
    from tui_gcs.core.formats.conversion import BaseScenario, ConversionOptions
    from tui_gcs.core.geometry.elevation import Elevation

MAX_CELLS = 300
SCENARIO = ".toml"


def tell(written: "Written", name: str = "") -> None:
    """Print what was noted and what was lost, a line each."""
    from tui_gcs.core.base.text import clean

    for note in written.notes:
        sys.stdout.write(f"{name}note: {clean(note, MAX_CELLS)}\n")
    for lost in written.left_out:
        sys.stdout.write(f"{name}left out: {clean(lost, MAX_CELLS)}\n")


def written_text(target: Path, written: "Written", kind: str) -> str:
    """Return the line about a file that was written; `kind` is what kind of file."""
    from tui_gcs.core.base.text import clean

    lost = f"; left out: {len(written.left_out)}" if written.left_out else ""
    return f"{clean(str(target), MAX_CELLS)} written: {kind}{lost}"


def written_data(target: Path, written: "Written") -> dict[str, object]:
    """Return what is reported in JSON of a file that was written."""
    return {"file": str(target), "notes": written.notes, "left_out": written.left_out}


def missions_in(path: Path) -> bytes | None:
    """Return the content of the missions screen's own file, or None if it is another JSON file.

    Raises `CommandError`.
    """
    if not path.name.lower().endswith(".json"):
        return None
    from tui_gcs.core.base.text import clean
    from tui_gcs.core.formats.bounded import data_of
    from tui_gcs.core.formats.content import FormatError
    from tui_gcs.core.missions.draft_file import MAX_BYTES, are_missions

    try:
        data = data_of(path, MAX_BYTES)
    except FormatError as error:
        raise CommandError(f"{clean(str(path), MAX_CELLS)}: {clean(str(error), MAX_CELLS)}") from None
    return data if are_missions(data) else None


def elevation_of(text: str | None) -> "Elevation | None":
    """Read the terrain file or folder that the operator named, if he named one. Raises `CommandError`."""
    if text is None:
        return None
    from tui_gcs.core.base.text import clean
    from tui_gcs.core.formats.content import FormatError
    from tui_gcs.core.formats.elevation_files import read_elevation

    try:
        return read_elevation(Path(text))
    except FormatError as error:
        raise CommandError(f"--terrain {clean(text, MAX_CELLS)}: {clean(str(error), MAX_CELLS)}") from None


def base_map_of(text: str | None) -> "BaseMap | None":
    """Open the base map that the operator named, if he named one. Raises `CommandError`."""
    if text is None:
        return None
    from tui_gcs.core.base.text import clean
    from tui_gcs.core.formats.base_map_files import read_base_map
    from tui_gcs.core.formats.content import FormatError

    try:
        return read_base_map(Path(text))
    except FormatError as error:
        raise CommandError(f"--base-map {clean(text, MAX_CELLS)}: {clean(str(error), MAX_CELLS)}") from None


def options_for(arguments: argparse.Namespace, title: str) -> "ConversionOptions":
    """Return the conversion's options that the file itself does not contain. Raises `CommandError`."""
    from tui_gcs.core.formats.conversion import ConversionOptions
    from tui_gcs.core.geometry.zones import Role
    from tui_gcs.core.plans.model import PlanKind

    base = read_base(Path(arguments.base)) if arguments.base is not None else None
    if not -10_000 <= (arguments.height or 0.0) <= 83_000:  # NaN, too
        raise CommandError(f"--height {arguments.height:g}: no height")
    read = read_base(Path(arguments.source)) if arguments.source.endswith(SCENARIO) else base
    return ConversionOptions(
        title=title,
        kind=PlanKind[arguments.kind.upper()] if arguments.kind is not None else None,
        height_m=arguments.height,
        round_index=round_of(read, arguments.round),
        role=Role(arguments.role) if arguments.role is not None else None,
        base=base,
    )


def round_of(base: "BaseScenario | None", wanted: str | None) -> int | None:
    """Return the index of a round by its number from 1 or by its name. Raises `CommandError`."""
    if wanted is None:
        return None
    if base is None:
        raise CommandError(f"--round {wanted}: there is no scenario that has rounds")
    names = [each.name for each in base.scenario.rounds]
    if wanted in names:
        return names.index(wanted)
    if wanted.isascii() and wanted.isdigit() and 1 <= int(wanted[:6]) <= len(names):
        return int(wanted) - 1
    raise CommandError(f"--round {wanted}: no such round; there are: {', '.join(names)}")


def read_any(
    path: Path, kind: str | None = None, home_line: str = "auto", *, px4: bool = False
) -> "Content | BaseScenario":
    """Return the content of a file; `px4` if a PX4 is to fly it. Raises `CommandError` with one line."""
    from tui_gcs.core.base.text import clean
    from tui_gcs.core.formats.bounded import data_of
    from tui_gcs.core.formats.content import FormatError
    from tui_gcs.core.formats.file_types import read_file
    from tui_gcs.core.formats.wpl import HomeLine
    from tui_gcs.core.plans.model import PlanKind

    if path.name.lower().endswith(SCENARIO):
        return read_base(path)
    try:
        wanted = PlanKind[kind.upper()] if kind is not None else None
        home = HomeLine.AMSL if px4 and home_line == "auto" else HomeLine(home_line)
        return read_file(data_of(path), wanted, home, path)
    except FormatError as error:
        raise CommandError(f"{clean(str(path), MAX_CELLS)}: {clean(str(error), MAX_CELLS)}") from None


def read_base(path: Path) -> "BaseScenario":
    """Return a scenario and its text. Raises `CommandError`."""
    from tui_gcs.core.scenario.load import ScenarioError, parse, read_text

    try:
        text = read_text(path)
        scenario = parse(text, str(path))
    except ScenarioError as error:
        raise CommandError(error.problems[0]) from None
    from tui_gcs.core.formats.conversion import BaseScenario

    return BaseScenario(scenario, text)


def may_write(target: Path, *, force: bool) -> None:
    """Check before anything is read whether the target may be written. Raises `CommandError`."""
    try:
        info = target.lstat()
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        raise CommandError(f"{target}: {error}") from None
    if not stat.S_ISREG(info.st_mode):
        raise CommandError(f"{target}: not a plain file; give another name")
    if not force:
        raise CommandError(f"{target}: is there already; --force overwrites it")


def put(target: Path, data: bytes, *, force: bool) -> None:
    """Write the file as a whole or not at all; replace another file only with `force`. Raises `CommandError`."""
    new = target.with_name(f".{target.name[:100]}.{os.getpid()}.new")
    try:
        with new.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if force:
            new.replace(target)
        else:
            _link(new, target)
    except OSError as error:
        raise CommandError(f"{target}: cannot be written ({error.strerror})") from None
    finally:
        new.unlink(missing_ok=True)


def _link(new: Path, target: Path) -> None:
    """Give the new file its name; this fails where a file of that name exists by now. Raises OSError."""
    try:
        os.link(new, target)
    except OSError as error:
        if error.errno not in (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS) or target.exists():
            raise
        new.replace(target)  # memory cards have no links
