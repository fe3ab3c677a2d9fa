"""R19: what a station opens, starts and connects to because of hostile frames, as the kernel sees it (`strace`)."""

import re
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.bench.row import NotMeasured, Row
from tests.bench.station import LiveStation, live_station
from tests.hostile.test_terminal import wicked_frames
from tui_gcs.core.mavlink.encode import Encoder

ROUNDS, GAP_S = 5, 0.002
TRACED = "%file,execve,connect,socket"
WRITES = re.compile(
    r'\b(?:open|openat|openat2)\([^"]*"([^"]*)", [^)]*(?:O_WRONLY|O_RDWR|O_CREAT)'
    r'|\b(?:rename|renameat2?|mkdir|mkdirat|unlink|unlinkat|symlink|link|truncate|chmod|rmdir)\([^"]*"([^"]*)"'
)
"""A call that changes a file, with its path."""
NETWORK = re.compile(r"\bconnect\(\d+, \{sa_family=AF_INET")
HARMLESS = ("/dev/null",)
UP = ("ready", "running")


def system_calls(folder: Path) -> Iterator[Row]:
    """Control bytes in every text field, and addresses of files to fetch, from a vehicle that the station hears."""
    if shutil.which("strace") is None:
        raise NotMeasured("strace is not installed")
    trace = folder / "trace"
    with live_station() as station:
        station.until(lambda status: all(team.worker in UP for team in status.teams), 30.0, "planners have started")
        sent = traced(station, trace)
    lines = trace.read_text(errors="replace").splitlines()
    written = [first or second for line in lines for first, second in WRITES.findall(line)]
    outside = [path for path in written if not path.startswith(str(folder)) and path not in HARMLESS]
    yield Row("R19 hostile frames that were sent", sent, "", 1000, at_least=True)
    yield Row("R19 system calls that were looked at", len(lines), "", 10, at_least=True)
    yield Row(f"R19 files changed elsewhere {' '.join(sorted(set(outside))[:3])}".rstrip(), len(outside), "", 0)
    yield Row("R19 programs started", sum("execve(" in line for line in lines), "", 0)
    yield Row("R19 connections to a network", sum(bool(NETWORK.search(line)) for line in lines), "", 0)


def traced(station: LiveStation, trace: Path) -> int:
    """Speak to a station that has started already: what its own start opens is not because of a vehicle."""
    with tracing(station.pid, trace):
        sent = speak(station.port)
        station.until(lambda status: status.heard > 0, 10.0, "the vehicle is heard")
        time.sleep(2.0)
    return sent


@contextmanager
def tracing(pid: int, trace: Path) -> Iterator[None]:
    """Write the calls of a process and of its threads and children to a file."""
    command = ["strace", "-f", "-qq", "-p", str(pid), "-e", f"trace={TRACED}", "-s", "300", "-o", str(trace)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE)
    try:
        time.sleep(1.0)
        if process.poll() is not None:
            raise NotMeasured("strace may not look at a process here")
        yield
    finally:
        process.terminate()
        process.communicate(timeout=10)


def speak(port: int) -> int:
    """Send it all from one address; the number of frames."""
    vehicle = Encoder(1, 1)
    beat = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 4, "mavlink_version": 3}
    addresses = [b"http://127.0.0.1:9/x", b"ftp://127.0.0.1/x", b"file:///etc/passwd", b"mftp://../../etc/passwd"]
    count = 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for number in range(ROUNDS):
            frames = [*wicked_frames(), vehicle.encode("HEARTBEAT", **beat)]
            for uri in addresses:
                where = {"time_boot_ms": number, "file_crc": number, "uri": uri.ljust(100, b"\0")}
                frames.append(vehicle.encode("COMPONENT_METADATA", **where))
            # Each round is heard over some seconds: a vehicle that only floods is no vehicle.
            for frame in frames * 3:
                out.sendto(frame, ("127.0.0.1", port))
                count += 1
                time.sleep(GAP_S)
    return count
