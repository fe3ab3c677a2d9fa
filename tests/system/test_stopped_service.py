"""`tui-gcs run` as a service: SIGTERM, by which systemd stops it, brings the vehicles home before the command ends."""

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.rigs.own_station import processes, until

TUI_GCS = (sys.executable, "-m", "tui_gcs")

pytestmark = [pytest.mark.process, pytest.mark.long]


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def test_a_stopped_service_brings_the_vehicles_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))

    def start(*words: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            (*TUI_GCS, *words),
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def says(*words: str) -> str:
        command = (*TUI_GCS, *words)
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        return done.stdout + done.stderr

    says("scenario", "new", "field.toml", "--vehicles", "2")
    place = f"127.0.0.1:{free_port()}"
    vehicles = start("sim", "field.toml", "--target", place)
    try:
        service = start("run", "field.toml", "--quiet", "--kind", "sim", "--link", f"udpin:{place}")
        until(lambda: "armed 2" in says("status"), 120, "both vehicles fly")
        service.terminate()
        output, _ = service.communicate(timeout=240)
        assert "interrupted: vehicles return and land" in output
        assert service.returncode == 1
        # It is ended once both have landed; its process takes a moment to go.
        until(lambda: "no station runs" in says("status"), 30, "the station has ended")
    finally:
        vehicles.terminate()
        vehicles.communicate(timeout=20)
        for left in processes(str(tmp_path)):  # only where something above has failed
            os.kill(left, signal.SIGKILL)
