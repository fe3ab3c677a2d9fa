"""What planners declare, found out in a process of its own: whoever asks runs none of their code.

`python -m tui_gcs.planner.describe` prints all known ones as JSON, `… describe FILE.py` the one in a file.
"""

import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import msgspec

from tui_gcs.core.messages_planning import PlannerInfo
from tui_gcs.core.text import clean

LIMIT_S = 15.0
"""A file that takes longer to load is none to fly with."""
MOST_BYTES = 1_000_000
CANNOT = 2


class DescribeError(Exception):
    """A planner file that cannot be used: one line."""


def describe_file(path: str) -> PlannerInfo:
    """What the planner in a file declares; its path is absolute, its sha256 that of the content described.

    Raises:
        DescribeError: one line, with file and line of the mistake where there is one.
    """
    file = Path(path).resolve()
    try:
        infos = _ask([str(file)])
    except subprocess.TimeoutExpired:
        raise DescribeError(f"{path}: does not finish loading within {LIMIT_S:.0f} s") from None
    if len(infos) != 1:
        raise DescribeError(f"{path}: cannot be described")
    return infos[0]


def command(*arguments: str) -> list[str]:
    """The command line of the process that describes."""
    return [sys.executable, "-m", "tui_gcs.planner.describe", *arguments]


def parse(output: bytes) -> tuple[PlannerInfo, ...]:
    """What it printed. Raises DescribeError."""
    try:
        return msgspec.json.decode(output[:MOST_BYTES], type=tuple[PlannerInfo, ...])
    except msgspec.MsgspecError as error:
        raise DescribeError(f"planners cannot be described: {clean(str(error))}") from None


def _ask(arguments: list[str]) -> tuple[PlannerInfo, ...]:
    done = subprocess.run(
        command(*arguments), capture_output=True, timeout=LIMIT_S, check=False, stdin=subprocess.DEVNULL
    )
    if done.returncode:
        lines = done.stderr.decode("utf-8", "replace").strip().splitlines() or ["it does not say why"]
        raise DescribeError(str(clean(lines[-1], 300)))
    return parse(done.stdout)


def main(arguments: list[str]) -> int:
    """Describe, on a stream of our own: what the planners print goes to stderr."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    from tui_gcs.planner import registry
    from tui_gcs.planner.planner_file import read_source

    infos = []
    try:
        if arguments:
            path = Path(arguments[0])
            digest = sha256(read_source(path)).hexdigest()
            infos.append(registry.file_info(path, digest))
        else:
            infos += registry.infos(registry.names()).values()
    except registry.PlannerError as error:
        sys.stderr.write(f"{error}\n")
        return CANNOT
    out.write(msgspec.json.encode(infos))
    out.close()
    return 0


if __name__ == "__main__":
    code = main(sys.argv[1:])
    sys.stderr.flush()
    os._exit(code)
