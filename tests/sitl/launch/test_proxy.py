"""The proxy of faults over real sockets; in this process where that is enough."""

import signal
import socket
import subprocess
import sys
import time
from contextlib import closing, contextmanager

import pytest

from sitl.launch.process import LaunchError
from sitl.launch.proxy import UdpProxy, main, parse_listen, report
from sitl.launch.proxy_tcp import TcpProxy
from sitl.links.faults import parse

HERE = "127.0.0.1"


def udp() -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind((HERE, 0))
    sock.settimeout(2.0)
    return sock


@contextmanager
def proxied(fault: str = "", station: socket.socket | None = None, seed: int = 1):
    """(proxy, station, the proxy's address)."""
    with station or udp() as sock:
        proxy = UdpProxy((HERE, 0), sock.getsockname(), parse(fault), seed)
        with closing(proxy):
            yield proxy, sock, proxy.address


def pump(proxy, now_s: float = 0.0) -> None:
    """A moment for the kernel, then one turn."""
    time.sleep(0.01)
    proxy.pump(now_s)


def test_each_vehicle_has_an_address_of_its_own_and_gets_its_own_answers():
    with proxied() as (proxy, station, address), udp() as one, udp() as two:
        one.sendto(b"one", address)
        two.sendto(b"two", address)
        pump(proxy)
        heard = dict(station.recvfrom(100) for _ in range(2))
        assert heard.keys() == {b"one", b"two"}
        assert len(set(heard.values())) == 2
        station.sendto(b"to two", heard[b"two"])
        station.sendto(b"to one", heard[b"one"])
        pump(proxy)
        assert (one.recv(100), two.recv(100)) == (b"to one", b"to two")
        one.sendto(b"again", address)
        pump(proxy)
        assert station.recvfrom(100) == (b"again", heard[b"one"])


def test_faults_are_each_vehicles_own_and_told_at_the_end():
    with proxied("down.loss=0.5") as (proxy, station, address), udp() as one, udp() as two:
        for k in range(100):
            one.sendto(b"one %d" % k, address)
            two.sendto(b"two %d" % k, address)
        pump(proxy)
        station.settimeout(0.05)
        heard = []
        with pytest.raises(TimeoutError):
            while True:
                heard.append(station.recv(100).split())
        lost = [{int(k) for who, k in heard if who == vehicle} for vehicle in (b"one", b"two")]
        assert all(30 < len(numbers) < 70 for numbers in lost)
        assert lost[0] != lost[1]
        text = report(proxy)
        assert text.startswith("vehicles heard: 2")
        assert f"vehicles to station: 200 in, {len(heard)} out" in text


def test_what_is_late_comes_when_it_is_due():
    with proxied("delay=200ms") as (proxy, station, address), udp() as one:
        one.sendto(b"late", address)
        time.sleep(0.01)
        assert proxy.pump(5.0) == 5.2
        assert proxy.pump(5.19) == 5.2
        proxy.pump(5.2)
        assert station.recv(100) == b"late"


def test_a_station_that_is_not_there_and_a_vehicle_that_is_gone_are_no_end():
    station = udp()
    with proxied(station=station) as (proxy, _, address), udp() as one:
        one.sendto(b"hello", address)
        pump(proxy)
        _, back = station.recvfrom(100)
        with udp() as other:
            other.sendto(b"other", address)
            pump(proxy)
            _, back_to_other = station.recvfrom(100)
        for _ in range(3):
            station.sendto(b"to nobody", back_to_other)
            pump(proxy)
        where = station.getsockname()
        station.close()
        for _ in range(3):
            one.sendto(b"nobody listens", address)
            pump(proxy)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as later:
            later.bind(where)
            later.settimeout(2.0)
            one.sendto(b"back", address)
            pump(proxy)
            assert later.recvfrom(100) == (b"back", back)


def test_too_many_addresses_are_refused_and_counted(monkeypatch):
    monkeypatch.setattr("sitl.launch.proxy.MAX_VEHICLES", 1)
    with proxied() as (proxy, station, address), udp() as one, udp() as two:
        one.sendto(b"one", address)
        pump(proxy)
        two.sendto(b"two", address)
        pump(proxy)
        assert station.recv(100) == b"one"
        assert (proxy.vehicles, proxy.refused) == (1, 1)
        assert "1 datagrams refused" in report(proxy)


# ---------------------------------------------------------------- TCP


def test_a_stream_goes_through_one_station_at_a_time():
    with socket.create_server((HERE, 0)) as vehicle_server:
        proxy = TcpProxy((HERE, 0), vehicle_server.getsockname(), parse("delay=100ms"), 1)
        with closing(proxy), socket.create_connection(proxy.address, 2.0) as station:
            pump(proxy)
            vehicle, _ = vehicle_server.accept()
            with vehicle:
                vehicle.sendall(b"telemetry")
                station.sendall(b"command")
                pump(proxy, 1.0)
                proxy.pump(1.1)
                assert (station.recv(100), vehicle.recv(100)) == (b"telemetry", b"command")
                with socket.create_connection(proxy.address, 2.0) as second:
                    second.settimeout(2.0)
                    pump(proxy, 1.2)
                    assert second.recv(100) == b"", "let go at once"
            pump(proxy, 1.3)
            assert station.recv(100) == b"", "the vehicle is gone"
            with socket.create_connection(proxy.address, 2.0):
                pump(proxy, 1.4)
                vehicle_server.settimeout(2.0)
                vehicle_server.accept()[0].close()


def test_a_side_that_does_not_read_keeps_the_other_waiting():
    with socket.create_server((HERE, 0)) as vehicle_server:
        proxy = TcpProxy((HERE, 0), vehicle_server.getsockname(), parse(""), 1)
        with closing(proxy), socket.create_connection(proxy.address, 2.0) as station:
            pump(proxy)
            vehicle, _ = vehicle_server.accept()
            with vehicle:
                vehicle.setblocking(False)
                sent = 0
                for k in range(3000):
                    try:
                        sent += vehicle.send(bytes(65536))
                    except BlockingIOError:
                        proxy.pump(k * 0.01)
                station.settimeout(0.2)
                came = 0
                while came < sent:
                    proxy.pump(100.0)
                    came += len(station.recv(1 << 20))
                assert came == sent, "nothing is lost"


def test_a_stream_cannot_double_or_overtake():
    with pytest.raises(LaunchError, match="for datagrams"):
        TcpProxy((HERE, 0), (HERE, 9), parse("dup=0.1"), 1)


# ---------------------------------------------------------------- the command


def test_a_port_alone_is_on_loopback():
    assert parse_listen("14550") == (HERE, 14550)
    assert parse_listen("0.0.0.0:14550") == ("0.0.0.0", 14550)
    assert parse_listen("127.0.0.1:0") == (HERE, 0)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--listen", "x", "--to", "127.0.0.1:9"], "--listen x"),
        (["--listen", "0", "--to", "9"], "--to 9"),
        (["--listen", "0", "--to", "127.0.0.1:9", "--fault", "loss=2"], "--fault loss=2: must be a share"),
        (["--listen", "0", "--to", "no.such.host.invalid:9"], "this host is unknown"),
        (["--listen", "192.0.2.1:9999", "--to", "127.0.0.1:9"], "--listen 192.0.2.1:9999: "),
        (["--listen", "192.0.2.1:9999", "--to", "127.0.0.1:9", "--tcp"], "--listen 192.0.2.1:9999: "),
    ],
)
def test_a_bad_option_is_one_clear_line(capsys, arguments, problem):
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert problem in error
    assert error.count("\n") == 1


@pytest.mark.process
def test_as_a_process_it_ends_by_signal_and_says_what_was_lost():
    with udp() as station, udp() as vehicle, udp() as probe:
        address = probe.getsockname()
        probe.close()
        to = f"{HERE}:{station.getsockname()[1]}"
        command = [sys.executable, "-m", "sitl.launch.proxy", "--listen", str(address[1]), "--to", to]
        process = subprocess.Popen([*command, "--fault", "delay=50ms"], stdout=subprocess.PIPE, text=True)
        try:
            vehicle.settimeout(0.2)
            for _ in range(50):
                vehicle.sendto(b"hello", address)
                station.settimeout(0.2)
                try:
                    data, back = station.recvfrom(100)
                    break
                except TimeoutError:
                    continue
            assert data == b"hello"
            station.sendto(b"answer", back)
            assert vehicle.recv(100) == b"answer"
        finally:
            process.send_signal(signal.SIGTERM)
        reported, _ = process.communicate(timeout=10.0)
        assert process.returncode == 0
        assert "vehicles heard: 1" in reported
        assert "station to vehicles: 1 in, 1 out" in reported


@pytest.mark.process
def test_it_ends_when_its_parent_is_gone():
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    command = [sys.executable, "-m", "sitl.launch.proxy", "--listen", "127.0.0.1:0", "--to", "127.0.0.1:9"]
    done = subprocess.run([*command, "--parent", str(gone.pid)], timeout=20.0, check=False, capture_output=True)
    assert done.returncode == 0
