"""`kill -9` of the station: at most the last 0.1 s of telemetry is missing in its log, and no event in its journal.

Vehicles ask the station for its time (TIMESYNC), and it answers at once with its own clock. So the newest answer that
they received says how far the station was when it was killed, and the newest one in its log how much of that it wrote.
"""

import os
import signal
import socket
import time
from contextlib import closing
from pathlib import Path

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from tests.rigs.own_station import Watcher, processes, station_in, until
from tui_gcs.client.launcher import free_port, launch
from tui_gcs.core.base.directories import state_dir
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.process.cpu_wait import CpuWaitMonitor

SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"
STATION, SUPERVISOR = "tui_gcs.core.process.station_process", "tui_gcs.client.launcher"
VEHICLES, GAP_S = 4, 0.025
"""Each asks 40 times a second; the station answers 50. Together that is a question every 6 ms."""
MAX_LOSS_S = 0.1
TEXT = "remark %d"

pytestmark = [pytest.mark.process, pytest.mark.long]


class AskingVehicles:
    """Vehicles that do nothing but ask for the time and say numbered texts."""

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        self._socket.setblocking(False)
        self._vehicles = [mavlink.MAVLink(None, srcSystem=1 + k, srcComponent=1) for k in range(VEHICLES)]
        self._number = 0
        self.newest_ns = 0
        """The station's clock in its newest answer."""

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def talk(self, seconds: float) -> None:
        """Ask in turn, with a heartbeat a second and a text twice a second of each vehicle."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            vehicle = self._vehicles[self._number % VEHICLES]
            turn = self._number // VEHICLES
            if turn % 40 == 0:
                self._send(vehicle, vehicle.heartbeat_encode(2, 3, 0, 0, 4))
            if turn % 20 == 0:
                self._send(vehicle, vehicle.statustext_encode(4, (TEXT % self._number).encode()))
            self._number += 1
            self._send(vehicle, vehicle.timesync_encode(0, self._number))
            time.sleep(GAP_S / VEHICLES)
            self.receive()

    def _send(self, vehicle: mavlink.MAVLink, message: mavlink.MAVLink_message) -> None:
        self._socket.send(message.pack(vehicle))

    def receive(self) -> None:
        """Read the answers that have come."""
        parser = mavlink.MAVLink(None)
        try:
            while data := self._socket.recv(65_535):
                answers = [found for found in parser.parse_buffer(data) or () if found.get_type() == "TIMESYNC"]
                self.newest_ns = max([self.newest_ns, *(found.tc1 for found in answers)])
        except BlockingIOError:
            return


@pytest.mark.parametrize("kill_after_s", [2.0, 2.317, 2.734])
def test_a_killed_station_has_written_all_but_the_last_tenth_of_a_second(kill_after_s: float, tmp_path: Path) -> None:
    port = free_port()
    links = [f"udpin:127.0.0.1:{port}"]
    with (
        closing(AskingVehicles(port)) as vehicles,
        station_in(tmp_path, lambda: launch(RunKind.SIM, str(SCENARIO), SCENARIO.read_text(), links)) as watcher,
    ):
        vehicles.talk(kill_after_s)
        assert vehicles.newest_ns > 0, "the station answers"
        supervisors, (station,) = processes(SUPERVISOR), processes(STATION)
        waits = CpuWaitMonitor(station, time.monotonic())
        vehicles.talk(0.3)
        # The supervisor first, so that it starts no station that goes on in the same files.
        for pid in (*supervisors, station):
            os.kill(pid, signal.SIGKILL)
        waits.look(time.monotonic())
        until(lambda: not processes(STATION), 10, "the station is gone")
        vehicles.receive()
        (tlog,) = state_dir(RunKind.SIM).glob("*.tlog")
        loss_s = (vehicles.newest_ns - newest_logged_ns(tlog)) * 1e-9
        # A computer that let the station wait for a core is no loss of the station's.
        assert loss_s <= MAX_LOSS_S + waits.waited_s
        assert_all_are_journalled(watcher, tlog.with_suffix(".jsonl"))


def newest_logged_ns(tlog: Path) -> int:
    """The station's clock in the newest of its answers that the log has."""
    log = mavutil.mavlink_connection(str(tlog))
    newest_ns = 0
    while (found := log.recv_match(type="TIMESYNC")) is not None:
        newest_ns = max(newest_ns, found.tc1)
    return newest_ns


def assert_all_are_journalled(watcher: Watcher, journal: Path) -> None:
    """What was published before the kill is in the journal, whole."""
    lines = journal.read_text().splitlines()
    heard = [event.text for event in watcher.events if TEXT.split()[0] in event.text]
    assert len(heard) > VEHICLES
    assert [text for text in heard if not any(text in line for line in lines)] == []
