"""The first minute of the demo: each event that a newcomer sees is expected of any flight, also on a busy computer.

Real processes at 1x; a minute and the time of the start for each case.
"""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.rigs.own_station import until
from tests.rigs.pty_operator import Operator, end_programs

# Beside other long tests, on two cores, a planner is late and the computer too busy: that is said, and it is true.
pytestmark = [pytest.mark.process, pytest.mark.endurance, pytest.mark.xdist_group("operator")]

MINUTE_S = 60.0
EVERYDAY = {
    "connection: heard on udpin:#:#",
    # What an ArduCopter of 4.5 sends while it boots; any ground station shows it. The first seven are heard only by a
    # station that is there before them, on a fast computer.
    "vehicle: ArduCopter V#-dev (#)",
    "vehicle: #",
    "vehicle: Frame: QUAD/PLUS",
    "vehicle: ArduPilot Ready",
    "vehicle: AHRS: DCM active",
    "vehicle: AHRS: EKF# active",
    "sensor: EKF# IMU# initialised",
    "sensor: EKF# IMU# tilt alignment complete",
    "sensor: EKF# IMU# origin set",
    "sensor: EKF# IMU# is using GPS",
    "sensor: GPS #: detected u-blox",
    "vehicle: Field Elevation Set: #m",
    "vehicle: Arming motors",
    "planner: planner worker is there",
    "planner: all # on their slots over home",
    "planner: all # on their slots over field",
    "operator: round # started: # vehicles (#)",
    "console: start #-#: sent",
    "console: start #-#: begun for all #",
    "mission: arm: confirmed",
    "mission: take-off: confirmed",
}
"""Events of a first minute without a fault: class and text, each number written as #."""


@contextmanager
def load(processes: int) -> Iterator[None]:
    """So many other processes want a processor of this computer each."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)]
    try:
        yield
    finally:
        for one in busy:
            one.kill()
            one.wait()


def events_of_demo() -> list[tuple[int, str]]:
    """Severity, class and text of each event that the consoles have been sent, numbers as #."""
    found = []
    for journal in (Path(os.environ["TUI_GCS_STATE_DIR"]) / "sim").glob("*.jsonl"):
        for line in journal.read_text().splitlines():
            event = json.loads(line)
            if "seq" not in event:  # a request, an order or a set-point: not shown as an event
                continue
            text = re.sub(r"\b[0-9a-f]{8,}\b", "0", f"{event['cls']}: {event['text']}")
            found.append((event["severity"], re.sub(r"\d+(?:[.,]+ ?\d+)*", "#", text)))
    return found


@pytest.fixture
def demo(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Operator]:
    for name in ("RUNTIME", "STATE"):
        monkeypatch.setenv(f"TUI_GCS_{name}_DIR", str(tmp_path_factory.mktemp(name[0])))
    one = Operator(["demo"], 80, 24)
    yield one
    one.console.end()
    end_programs()


@pytest.mark.parametrize("others", [0, 4], ids=["quiet computer", "busy computer"])
def test_a_newcomer_sees_no_event_to_ask_about(demo: Operator, others: int) -> None:
    with load(others):
        demo.sees("ready 8/8", 60.0)
        demo.press(" ", "Enter = start")
        demo.press("\r", "start 1-8: begun for all 8")
        end = time.monotonic() + MINUTE_S
        while time.monotonic() < end:
            demo.screen(1.0)
        until(lambda: any(text == "mission: take-off: confirmed" for _, text in events_of_demo()), 5, "the flight")
        events = events_of_demo()
    unknown = [(severity, text) for severity, text in events if text not in EVERYDAY or severity < 5]
    assert not unknown, f"{unknown}\n{demo.screen()}"
