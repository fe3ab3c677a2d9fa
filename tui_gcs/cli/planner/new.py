"""`tui-gcs planner new NAME`: writes a small planner that flies and passes every check, as a beginning."""

import argparse
import keyword
import re
import sys
from pathlib import Path

from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.planner.new_sources import PER_TEAM, PER_VEHICLE
from tui_gcs.planner import api
from tui_gcs.planner.runtime import registry

NAME = re.compile(r"[a-z][a-z0-9_-]{0,31}")


def run(arguments: argparse.Namespace) -> int:
    """Write the file; an existing file is not touched."""
    path = write(arguments.name, Path(arguments.dir), PER_VEHICLE if arguments.per_vehicle else PER_TEAM)
    lines = len(path.read_text().splitlines())
    text = f"{path}: {lines} lines that fly"
    if not arguments.json:
        sys.stdout.write(
            f"{text}. Next:\n"
            f"  tui-gcs planner check {path}\n"
            f"  tui-gcs planner watch {path}      flies on with every version you save\n"
            f"What a planner is given and may ask for: the top of {api.__file__}\n"
        )
    return finish(arguments, CommandReport(True, text=text, data={"file": str(path)}))


def write(name: str, folder: Path, text: str = PER_TEAM) -> Path:
    """Write the new file and return its path.

    Raises `CommandError` for an impossible name, a file that exists, or a folder that does not.
    """
    stem = name.replace("-", "_")
    if not NAME.fullmatch(name):
        text = "a planner's name is lower-case letters, digits, - and _, beginning with a letter, at most 32"
        raise CommandError(f"{name!r}: {text}")
    if name in registry.names() or keyword.iskeyword(stem) or stem in sys.stdlib_module_names:
        raise CommandError(f"{name!r}: is taken (a known planner, or a word of Python): choose another")
    path = folder / f"{stem}.py"
    source = text.replace("NAME", name).replace("CLASS", stem.title().replace("_", "")).replace("FILE", path.name)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(source)
    except FileExistsError:
        raise CommandError(f"{path}: is there already, and is not overwritten") from None
    except OSError as error:
        raise CommandError(f"{path}: cannot be written ({error.strerror})") from None
    return path
