"""Another program at `--forward-commands`, with pymavlink alone: its answers are those of a vehicle."""

import random
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil

from tests.rigs.own_station import Watcher, station_in, until
from tui_gcs.cli.sim_fleet import spec_of
from tui_gcs.client.launcher import LaunchOptions, free_port, launch
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.scenario.load import load

SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"
FLIP = 14
"""Mode of ArduCopter."""
INSIDE = [(120.0, 120.0), (200.0, 120.0), (200.0, 200.0), (120.0, 200.0)]

pytestmark = [pytest.mark.process, pytest.mark.long]


class Client:
    """A ground station with an old-fashioned upload: it answers requests and waits for MISSION_ACK."""

    def __init__(self, port: int) -> None:
        self.link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=252, source_component=190)
        self.mav = self.link.mav
        self.frame = LocalFrame(load(SCENARIO).origin)

    def beat(self) -> None:
        self.mav.heartbeat_send(6, 8, 0, 0, 4)

    def wait(self, kind: str | list[str], vehicle: int, seconds: float = 5.0) -> Any:
        """The next message of a kind from a vehicle; None after `seconds`."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            message = self.link.recv_match(type=kind, blocking=True, timeout=0.2)
            if message is not None and message.get_srcSystem() == vehicle:
                return message
        return None

    def item(self, vehicle: int, seq: int, command: int, x: float, y: float, old: bool) -> None:
        lat, lon = (float(value) for value in self.frame.to_geodetic(x, y))
        head = (vehicle, 1, seq, 3, command, 0, 1, 0, 0, 0, 0)
        if old:
            self.mav.mission_item_send(*head, lat, lon, 40.0)
        else:
            self.mav.mission_item_int_send(*head, round(lat * 1e7), round(lon * 1e7), 40.0)

    def upload(self, vehicle: int, items: list[tuple[int, float, float]], *, old: bool) -> tuple[int, list[str]]:
        """The result of the MISSION_ACK, and what was said meanwhile and shortly after."""
        self.mav.mission_count_send(vehicle, 1, len(items))
        texts: list[str] = []
        result = -1
        while message := self.wait(
            ["MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK", "STATUSTEXT"], vehicle, 5.0 if result < 0 else 0.3
        ):
            if message.get_type() == "STATUSTEXT":
                texts.append(message.text)
            elif message.get_type() == "MISSION_ACK":
                result = message.type
            elif result < 0:
                self.item(vehicle, message.seq, *items[message.seq], old)
        return result, texts

    def on_board(self, vehicle: int) -> list[tuple[int, int, int]]:
        """The mission of a vehicle, without ArduCopter's home: command and place of each item."""
        self.mav.mission_request_list_send(vehicle, 1)
        count = self.wait("MISSION_COUNT", vehicle).count
        found = []
        for seq in range(vehicle % 2, count):
            self.mav.mission_request_int_send(vehicle, 1, seq)
            item = self.wait("MISSION_ITEM_INT", vehicle)
            assert item.seq == seq
            found.append((item.command, round(item.x, -2), round(item.y, -2)))
        self.mav.mission_ack_send(vehicle, 1, 0)
        return found


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    port = free_port()
    options = LaunchOptions(spec_of(load(SCENARIO), autopilots="mixed"), forward=[(f"udpin:127.0.0.1:{port}", True)])
    folder = tmp_path_factory.mktemp("r")
    with station_in(folder, lambda: launch(RunKind.SIM, str(SCENARIO), SCENARIO.read_text(), [], options)) as watcher:
        yield _connected(watcher, port)


def _connected(watcher: Watcher, port: int) -> Client:
    until(lambda: watcher.status is not None and watcher.status.heard == 8, 20, "8 vehicles heard")
    client = Client(port)
    client.beat()
    assert client.wait("HEARTBEAT", 1) is not None
    return client


@pytest.mark.parametrize("vehicle", [1, 2], ids=["arducopter", "px4"])
def test_random_missions_are_on_board_whole_or_not_at_all(client: Client, vehicle: int) -> None:
    choice = random.Random(vehicle)
    before = client.on_board(vehicle)
    refusals = 0
    for number in range(12):
        client.beat()
        length = choice.randint(2, 12)
        items = [(16, *choice.choice(INSIDE)) for _ in range(length)]
        bad = choice.random() < 0.5
        if bad:
            at = choice.randrange(1, length)
            items[at] = choice.choice([(16, 5000.0, 0.0), (601, *INSIDE[0]), (208, *INSIDE[1])])
        result, texts = client.upload(vehicle, items, old=number % 2 == 1)
        after = client.on_board(vehicle)
        if bad:
            refusals += 1
            assert result in (3, 14) and any("mission item" in text for text in texts), (items, texts)
            assert after == before, "not one item was cut off or written"
        else:
            assert result == 0 and len(after) == length - vehicle % 2
        before = after
    assert 0 < refusals < 12


def test_refusals_come_from_the_vehicle(client: Client) -> None:
    client.beat()
    client.mav.command_long_send(3, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0)
    ack = client.wait("COMMAND_ACK", 3)
    assert (ack.command, ack.result, ack.get_srcComponent()) == (400, 2, 1)
    assert "forced" in client.wait("STATUSTEXT", 3).text
    client.mav.param_request_read_send(3, 1, b"FENCE_ENABLE", -1)
    before = client.wait("PARAM_VALUE", 3).param_value
    client.mav.param_set_send(3, 1, b"FENCE_ENABLE", 1.0 - before, 2)
    assert client.wait("PARAM_VALUE", 3).param_value == before
    mode = client.wait("HEARTBEAT", 3).custom_mode
    client.mav.set_mode_send(3, 1, FLIP)
    ack = client.wait("COMMAND_ACK", 3)
    assert (ack.command, ack.result) == (11, 2) and "FLIP" in client.wait("STATUSTEXT", 3).text
    assert [client.wait("HEARTBEAT", 3).custom_mode for _ in range(3)] == [mode] * 3
    client.mav.command_long_send(5, 1, 246, 0, 1, 0, 0, 0, 0, 0, 0)
    assert client.wait("COMMAND_ACK", 5).result == 0, "a disarmed vehicle restarts, as docs/forwarding.md says"
