"""Describes planners in a process of its own, so that the caller runs none of their code.

`python -m tui_gcs.planner.runtime.describe` prints all known planners as JSON, `… describe FILE.py` the one in a file.
"""

import os
import selectors
import subprocess
import sys
import time
from hashlib import sha256
from pathlib import Path

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.planning import PlannerInfo

LOAD_LIMIT_S = 15.0
"""A file that takes longer to load is refused."""
# A foreign planner may print without end.
MAX_OUTPUT_BYTES = 1_000_000
MAX_ERROR_BYTES = 10_000
# The exit code with one line of reason, as of all commands.
EXIT_CANNOT = 2


class DescribeError(Exception):
    """A planner file cannot be used; the text is one line."""


def describe_file(path: str) -> PlannerInfo:
    """Return what the planner in a file declares, with the file's absolute path and the sha256 of its content.

    Raises:
        DescribeError: one line, with file and line of the mistake where there is one.
    """
    try:
        file = Path(path).resolve()
    except (OSError, RuntimeError):  # a link to itself
        raise DescribeError(f"{clean(path)}: cannot be read") from None
    try:
        infos = _run([str(file)])
    except subprocess.TimeoutExpired:
        raise DescribeError(f"{clean(path)}: does not finish loading within {LOAD_LIMIT_S:.0f} s") from None
    if len(infos) != 1:
        raise DescribeError(f"{clean(path)}: cannot be described")
    return infos[0]


def command(*arguments: str) -> list[str]:
    """Return the command line of the process that describes planners."""
    return [sys.executable, "-m", "tui_gcs.planner.runtime.describe", *arguments]


def parse(output: bytes) -> tuple[PlannerInfo, ...]:
    """Return the planners in that process's output. Raises DescribeError."""
    try:
        return msgspec.json.decode(output[:MAX_OUTPUT_BYTES], type=tuple[PlannerInfo, ...])
    except msgspec.MsgspecError as error:
        raise DescribeError(f"planners cannot be described: {clean(str(error))}") from None


def _run(arguments: list[str]) -> tuple[PlannerInfo, ...]:
    pipe = subprocess.PIPE
    with subprocess.Popen(command(*arguments), stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe) as process:
        try:
            output, errors = _read_output(process)
        finally:
            process.kill()
    if process.returncode:
        lines = errors.decode("utf-8", "replace").strip().splitlines() or ["it does not say why"]
        raise DescribeError(str(clean(lines[-1], 300)))
    return parse(output)


def _read_output(process: subprocess.Popen[bytes]) -> tuple[bytes, bytes]:
    """Return the beginning of the process's output and the end of its errors, however long. Raises TimeoutExpired."""
    assert process.stdout is not None and process.stderr is not None  # noqa: S101 - pipes, see above
    output, errors, end_s = b"", b"", time.monotonic() + LOAD_LIMIT_S
    with selectors.DefaultSelector() as pipes:
        pipes.register(process.stdout, selectors.EVENT_READ)
        pipes.register(process.stderr, selectors.EVENT_READ)
        while pipes.get_map():
            left_s = end_s - time.monotonic()
            if left_s <= 0.0:
                raise subprocess.TimeoutExpired(process.args, LOAD_LIMIT_S)
            for key, _ in pipes.select(left_s):
                data = os.read(key.fd, 65536)
                if not data:
                    pipes.unregister(key.fileobj)
                elif key.fileobj is process.stdout:
                    output = (output + data)[: MAX_OUTPUT_BYTES + 1]
                else:
                    errors = (errors + data)[-MAX_ERROR_BYTES:]
    # Both pipes are closed; a process that closed them itself may still run.
    process.wait(max(end_s - time.monotonic(), 0.1))
    return output, errors


def main(arguments: list[str]) -> int:
    """Print descriptions on a copy of stdout; what planners print goes to stderr."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    from tui_gcs.planner.runtime import registry
    from tui_gcs.planner.runtime.planner_errors import PlannerError
    from tui_gcs.planner.runtime.planner_file import read_source

    infos = []
    try:
        if arguments:
            path = Path(arguments[0])
            digest = sha256(read_source(path)).hexdigest()
            infos.append(registry.file_info(path, digest))
        else:
            infos += registry.infos(registry.names()).values()
    except PlannerError as error:
        sys.stderr.write(f"{error}\n")
        return EXIT_CANNOT
    out.write(msgspec.json.encode(infos))
    out.close()
    return 0


if __name__ == "__main__":
    code = main(sys.argv[1:])
    sys.stderr.flush()
    os._exit(code)
