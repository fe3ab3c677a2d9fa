"""R20: files of 64 MB are refused soon, and not read into memory. Whole commands, each a process of its own."""

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

from tests.bench.headless import COMMAND
from tests.bench.row import NotMeasured, Row

SIZE = 64 << 20
MAX_CPU_S, MAX_MB = 1.0, 256.0
CONTENTS = {
    "zeros": b"\0" * 1024,
    "noise": os.urandom(1 << 20),
    "digits": b"1" * 1024,
    "lines": b"47.1\t8.1\t20\n",
    "brackets": b"[" * 1024,
    "tags": b"<a>" * 1024,
}
SUFFIXES = ("plan", "waypoints", "fence", "rally", "kml", "kmz", "geojson", "param", "json", "toml", "tlog", "csv")


def big_files(folder: Path) -> Iterator[Row]:
    """Every kind of file that is read, with every content; the numbers are CPU time and peak memory of the process."""
    took_s: dict[str, float] = {}
    used_mb: dict[str, float] = {}
    for content, piece in CONTENTS.items():
        for suffix in SUFFIXES:
            file = folder / f"{content}.{suffix}"
            with file.open("wb") as out:
                # In pieces: the kernel counts the memory of this process as the child's, until the child is exec'd.
                out.writelines(piece for _ in range(SIZE // len(piece)))
            took_s[file.name], used_mb[file.name] = refused([*COMMAND, "check", str(file)])
            file.unlink()
    slowest, biggest = max(took_s, key=took_s.__getitem__), max(used_mb, key=used_mb.__getitem__)
    yield Row("R20 files of 64 MB that were refused", len(took_s), "", 1, at_least=True)
    yield Row(f"R20 CPU time at most ({slowest})", took_s[slowest], "s", MAX_CPU_S)
    yield Row(f"R20 peak memory at most ({biggest})", used_mb[biggest], "MB", MAX_MB)


def refused(command: list[str]) -> tuple[float, float]:
    """CPU time in seconds and peak memory in MB of a command that must end with an error of its own."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert process.stdout is not None
    said = process.stdout.read()
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    process.stdout.close()
    if process.returncode not in (1, 2) or b"Traceback" in said:
        raise NotMeasured(f"{command[-2:]} ended with {process.returncode}: {said[-200:]!r}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0
