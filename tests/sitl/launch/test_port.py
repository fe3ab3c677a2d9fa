"""Whom a simulated vehicle hears and answers over UDP."""

import socket
import time

import pytest

from sitl.launch.port import VehiclePort


@pytest.fixture
def stations():
    """Two sockets of ground stations."""
    pair = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
    for each in pair:
        each.bind(("127.0.0.1", 0))
        each.settimeout(2.0)
    yield pair
    for each in pair:
        each.close()


def heard(port):
    for _ in range(200):
        data = port.receive()
        if data is not None:
            return data
        time.sleep(0.005)
    return None


def silent(station):
    station.settimeout(0.05)
    try:
        return station.recv(100) is None
    except TimeoutError:
        return True


def test_px4_obeys_everybody_and_answers_for_ever_who_spoke_first(stations):
    first, second = stations
    with VehiclePort(first.getsockname(), latches=True) as port:
        port.send(b"hello")
        data, where = first.recvfrom(100)
        assert data == b"hello", "it streams before it has heard anybody"
        second.sendto(b"two", where)
        assert heard(port) == b"two"
        first.sendto(b"one", where)
        assert heard(port) == b"one"
        port.send(b"answer")
        assert second.recv(100) == b"answer"
        assert silent(first)


def test_ardupilot_hears_its_partner_only(stations):
    first, second = stations
    with VehiclePort(first.getsockname(), latches=False) as port:
        port.send(b"hello")
        _, where = first.recvfrom(100)
        second.sendto(b"two", where)
        first.sendto(b"one", where)
        assert heard(port) == b"one"
        assert port.receive() is None
        port.send(b"answer")
        assert first.recv(100) == b"answer"


@pytest.mark.parametrize("latches", [True, False])
def test_nobody_listening_is_no_end(latches):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gone:
        gone.bind(("127.0.0.1", 0))
        target = gone.getsockname()
    with VehiclePort(target, latches=latches) as port:
        for _ in range(3):
            port.send(b"x")
            assert port.receive() is None
