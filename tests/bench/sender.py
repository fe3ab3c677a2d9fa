"""A fleet that plays its stream in real time, as a process of its own, each vehicle from a socket of its own.

    python -m tests.bench.sender '{"port": 14550, "first": 1, "vehicles": 250, "seconds": 20, "times": 1}'

Writes "ready" when the stream is made, begins with the next line it reads, and tells at the end what it has sent and
how late it was. Commands are answered, so that a station has no reason to ask again.
"""

import json
import select
import socket
import sys
import time
from collections import Counter

from tests.bench.stream import Datagram, frame, frames_of, stream

STEP_S = 0.005
COMMAND_LONG, TIMESYNC = b"\x4c\x00\x00", b"\x6f\x00\x00"
REQUEST_MESSAGE, AUTOPILOT_VERSION = 512, 148
ACCEPTED = 0


class Fleet:
    """Vehicles `first` to `vehicles` of the stream."""

    def __init__(self, port: int, first: int, vehicles: int) -> None:
        self.sockets: dict[int, socket.socket] = {}
        self.vehicle_of: dict[int, int] = {}
        self.newest: dict[int, bytes] = {}
        self.sent: Counter[str] = Counter()
        self.heard = 0
        self.poll = select.epoll() if hasattr(select, "epoll") else None
        for vehicle in range(first - 1, vehicles):
            udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            udp.setblocking(False)
            udp.connect(("127.0.0.1", port))
            self.sockets[vehicle] = udp
            self.vehicle_of[udp.fileno()] = vehicle
            if self.poll is not None:
                self.poll.register(udp.fileno(), select.EPOLLIN)

    def play(self, datagrams: list[Datagram]) -> dict[str, float]:
        """Send everything in time; what became of it."""
        began_s, at, late_s = time.monotonic(), 0, 0.0
        while at < len(datagrams):
            now_s = time.monotonic() - began_s
            late_s = max(late_s, now_s - datagrams[at].t_s - STEP_S)
            while at < len(datagrams) and datagrams[at].t_s <= now_s:
                self.send(datagrams[at].vehicle, datagrams[at].data, datagrams[at].frames)
                at += 1
            self.answer()
            time.sleep(max(0.0, STEP_S - (time.monotonic() - began_s - now_s)))
        end_s = time.monotonic() - began_s
        return {**self.sent, "heard": self.heard, "late_s": late_s, "took_s": end_s, "cpu_s": time.process_time()}

    def send(self, vehicle: int, data: bytes, frames: int) -> None:
        try:
            self.sockets[vehicle].send(data)
        except OSError:
            self.sent["refused"] += 1
            return
        self.newest[vehicle] = data
        self.sent["datagrams"] += 1
        self.sent["frames"] += frames

    def answer(self) -> None:
        for number, _ in self.poll.poll(0) if self.poll is not None else ():
            vehicle = self.vehicle_of[number]
            try:
                data = self.sockets[vehicle].recv(2048)
            except OSError:
                continue
            self.heard += 1
            if is_question(data):
                self.send(vehicle, *answers(vehicle + 1, data, self.newest[vehicle]))


def is_question(data: bytes) -> bool:
    """Whether a station's frame is answered: a command, or a request for the time (its tc1 is 0)."""
    return data[7:10] == COMMAND_LONG or (data[7:10] == TIMESYNC and not any(data[10:18]))


def answers(system: int, asked: bytes, newest: bytes) -> tuple[bytes, int]:
    """The acknowledgement of a COMMAND_LONG, with what it asked for, or the time; and how many frames that is.

    They have the number of the newest frame: late ones, not losses.
    """
    seq = list(frames_of(newest))[-1][4]
    payload = asked[10:-2].ljust(33, b"\0")
    if asked[7:10] == TIMESYNC:
        return frame(system, seq, "TIMESYNC", {"tc1": 1, "ts1": int.from_bytes(payload[8:16], "little")}), 1
    number = int.from_bytes(payload[28:30], "little")
    ack = {"command": number, "result": ACCEPTED, "progress": 0, "result_param2": 0}
    data = frame(system, seq, "COMMAND_ACK", ack | {"target_system": 0, "target_component": 0})
    if number != REQUEST_MESSAGE or payload[:4] != b"\x00\x00\x14\x43":  # param1 is 148.0
        return data, 1
    return data + frame(system, seq, "AUTOPILOT_VERSION", version(system)), 2


def version(system: int) -> dict[str, object]:
    """AUTOPILOT_VERSION of ArduCopter 4.6.0, hardware number `system`."""
    return {
        "capabilities": 0x6FCFF,
        "uid": 0x1000 + system,
        "flight_sw_version": 0x040600FF,
        "middleware_sw_version": 0,
        "os_sw_version": 0,
        "board_version": 0,
        "vendor_id": 0,
        "product_id": 0,
        "flight_custom_version": list(b"deadbeef"),
        "middleware_custom_version": [0] * 8,
        "os_custom_version": [0] * 8,
        "uid2": [system, *[7] * 17],
    }


def main(argv: list[str]) -> int:
    wanted = json.loads(argv[0])
    datagrams = [
        sent
        for sent in stream(wanted["vehicles"], wanted["seconds"], wanted["times"])
        if sent.vehicle >= wanted["first"] - 1
    ]
    fleet = Fleet(wanted["port"], wanted["first"], wanted["vehicles"])
    print("ready", flush=True)
    sys.stdin.readline()
    print(json.dumps(fleet.play(datagrams)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
