"""Bad links between vehicles and a station: python -m sitl.launch.proxy --listen ADDRESS --to ADDRESS --fault TEXT.

Vehicles send to --listen, the station waits at --to. Toward the station every vehicle (every address that sends here)
has a source port of its own: the station sees one address per vehicle, and answers go back to the right one. With --tcp
a station connects to --listen and a vehicle waits at --to (ArduPilot's TCP ports), one at a time. The faults are those
of `sitl.links.faults`. At its end the program reports what became of the traffic.
"""

import argparse
import socket
import sys
import time
from contextlib import suppress
from selectors import EVENT_READ, DefaultSelector
from typing import Protocol

from sitl.launch.process import (
    PARENT_CHECK_S,
    LaunchError,
    ProgramLoop,
    Starter,
    add_starter,
    parse_target,
    refuse,
    resolved,
    why,
)
from sitl.launch.proxy_tcp import TcpProxy
from sitl.links.faults import FaultCounter, FaultError, FaultyLink, LinkFaults, parse

Address = tuple[str, int]

LOOPBACK = "127.0.0.1"
MAX_VEHICLES = 512
MAX_DATAGRAM_BYTES = 65536
BATCH = 256
"""Number of datagrams taken from one socket before the others get their turn."""
BUFFER_BYTES = 1 << 22
MAX_WAIT_S = 0.1
"""A signal is noticed within this time."""
MIN_WAIT_S = 0.002


class Proxy(Protocol):
    """A proxy as the loop drives it."""

    selector: DefaultSelector

    def pump(self, now_s: float) -> float:
        """Move the datagrams that are due; return when the next one will be, infinity if none waits."""

    def counts(self) -> tuple[FaultCounter, FaultCounter]:
        """Return the counts of all vehicles, first of the direction down, then up."""

    def close(self) -> None:
        """Close all sockets; waiting datagrams are lost."""


class _ProxiedVehicle:
    """One vehicle: its address here, its socket toward the station, its link."""

    def __init__(self, address: Address, sock: socket.socket, link: FaultyLink) -> None:
        self.address = address
        self.sock = sock
        self.link = link


class UdpProxy:
    """Connects many vehicles with one station."""

    def __init__(self, listen: Address, to: Address, faults: LinkFaults, seed: int) -> None:
        """Bind `listen`. Raises `LaunchError` if that is impossible, or the station's host is unknown."""
        self.selector = DefaultSelector()
        self.refused = 0
        """Number of datagrams from vehicles beyond MAX_VEHICLES."""
        self._faults, self._seed = faults, seed
        self._to = resolved(to, "--to")
        self._vehicles: dict[Address, _ProxiedVehicle] = {}
        self._busy: set[_ProxiedVehicle] = set()
        """Vehicles with a datagram that waits in their link."""
        self._socket = _udp_socket()
        try:
            self._socket.bind(listen)
        except (OSError, UnicodeError) as error:
            self._socket.close()
            raise LaunchError(f"--listen {listen[0]}:{listen[1]}: {why(error)}") from None
        self.selector.register(self._socket, EVENT_READ, None)

    def pump(self, now_s: float) -> float:
        """Move the datagrams that are due, as `Proxy.pump`."""
        for key, _ in self.selector.select(0):
            if key.data is None:
                self._from_vehicles(now_s)
            else:
                self._from_station(key.data, now_s)
        return self._release(now_s)

    def counts(self) -> tuple[FaultCounter, FaultCounter]:
        """Return the counts, as `Proxy.counts`."""
        down, up = FaultCounter(), FaultCounter()
        for vehicle in self._vehicles.values():
            down.add(vehicle.link.down.tally)
            up.add(vehicle.link.up.tally)
        return down, up

    @property
    def address(self) -> Address:
        """The address at which it listens."""
        address: Address = self._socket.getsockname()
        return address

    @property
    def vehicles(self) -> int:
        """Number of addresses that have sent a datagram."""
        return len(self._vehicles)

    def close(self) -> None:
        """Close all sockets, as `Proxy.close`."""
        for sock in (self._socket, *(vehicle.sock for vehicle in self._vehicles.values())):
            sock.close()
        self.selector.close()

    def _from_vehicles(self, now_s: float) -> None:
        for _ in range(BATCH):
            try:
                data, address = self._socket.recvfrom(MAX_DATAGRAM_BYTES)
            except BlockingIOError:
                return
            except OSError:
                # The echo of an answer to a vehicle that has ended.
                continue
            vehicle = self._vehicles.get(address) or self._add(address)
            if vehicle is None:
                self.refused += 1
                continue
            self._pass_down(vehicle, vehicle.link.down.step(now_s, data))
            self._busy.add(vehicle)

    def _from_station(self, vehicle: _ProxiedVehicle, now_s: float) -> None:
        for _ in range(BATCH):
            try:
                data = vehicle.sock.recv(MAX_DATAGRAM_BYTES)
            except BlockingIOError:
                return
            except OSError:
                # The echo of an earlier datagram to a station that did not listen.
                continue
            self._pass_up(vehicle, vehicle.link.up.step(now_s, data))
            self._busy.add(vehicle)

    def _add(self, address: Address) -> _ProxiedVehicle | None:
        """Return a new vehicle; None if there are too many."""
        if len(self._vehicles) >= MAX_VEHICLES:
            return None
        try:
            sock = _udp_socket()
        except OSError:  # no more files may be open
            return None
        try:
            # Connected, so that the socket receives from the station only.
            sock.connect(self._to)
        except OSError:
            sock.close()
            return None
        link = FaultyLink(self._faults, seed=self._seed, vehicle=len(self._vehicles))
        vehicle = self._vehicles[address] = _ProxiedVehicle(address, sock, link)
        self.selector.register(sock, EVENT_READ, vehicle)
        return vehicle

    def _release(self, now_s: float) -> float:
        next_s = float("inf")
        for vehicle in list(self._busy):
            self._pass_down(vehicle, vehicle.link.down.step(now_s))
            self._pass_up(vehicle, vehicle.link.up.step(now_s))
            due_s = min(vehicle.link.down.due_s, vehicle.link.up.due_s)
            if due_s == float("inf"):
                self._busy.discard(vehicle)
            next_s = min(next_s, due_s)
        return next_s

    def _pass_down(self, vehicle: _ProxiedVehicle, datagrams: list[bytes]) -> None:
        for data in datagrams:
            # No station (yet), or its buffer is full: a radio would lose it, too.
            with suppress(OSError):
                try:
                    vehicle.sock.send(data)
                except ConnectionRefusedError:  # the echo of an earlier one: this one was not sent
                    vehicle.sock.send(data)

    def _pass_up(self, vehicle: _ProxiedVehicle, datagrams: list[bytes]) -> None:
        for data in datagrams:
            # The vehicle is gone.
            with suppress(OSError):
                self._socket.sendto(data, vehicle.address)


def _udp_socket() -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setblocking(False)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
    return sock


class ProxyLoop(ProgramLoop):
    """Moves the datagrams of a proxy when they are due."""

    def __init__(self, proxy: Proxy, starter: Starter) -> None:
        super().__init__(starter)
        self._proxy = proxy

    def run(self) -> None:
        """Move datagrams until the end."""
        check_s = time.monotonic()
        while self.running:
            now_s = time.monotonic()
            next_s = self._proxy.pump(now_s)
            if now_s >= check_s:
                check_s = now_s + PARENT_CHECK_S
                self.running = self.running and self.starter.is_there
            # Sleeping a little costs less than waking up for every datagram: those of one moment are moved together.
            time.sleep(MIN_WAIT_S)
            self._proxy.selector.select(min(max(next_s - time.monotonic(), 0.0), MAX_WAIT_S))


def parse_listen(text: str) -> Address:
    """Return the address of "PORT" (of loopback) or "HOST:PORT"; port 0 is any free one. Raises `LaunchError`."""
    if text.isascii() and text.isdigit():
        text = f"{LOOPBACK}:{text}"
    if text.endswith(":0"):
        return text.removesuffix(":0"), 0
    return parse_target(text, "--listen")


def _arguments(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m sitl.launch.proxy", description="Bad links of vehicles.")
    parser.add_argument("--listen", required=True, metavar="[HOST:]PORT", help="where vehicles send to")
    parser.add_argument("--to", required=True, metavar="HOST:PORT", help="where the station waits")
    parser.add_argument("--fault", default="", metavar="FAULTS", help="for example loss=0.1,delay=200ms,jitter=20%%")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tcp", action="store_true", help="a station connects to --listen, a vehicle waits at --to")
    add_starter(parser)
    return parser.parse_args(argv)


def report(proxy: Proxy) -> str:
    """Return lines for the operator: what became of the traffic."""
    down, up = proxy.counts()
    lines = [f"vehicles to station: {down.text()}", f"station to vehicles: {up.text()}"]
    if isinstance(proxy, UdpProxy):
        lines.insert(0, f"vehicles heard: {proxy.vehicles}")
        if proxy.refused:
            lines.append(f"{proxy.refused} datagrams refused: more than {MAX_VEHICLES} addresses, or no sockets left")
    return "\n".join(lines) + "\n"


def main(argv: list[str] | None = None) -> int:
    """Run the program; return 0 after a signal or the starter's end, 2 for bad input."""
    args = _arguments(argv)
    try:
        faults = parse(args.fault)
        listen, to = parse_listen(args.listen), parse_target(args.to, "--to")
        starter = Starter(args.parent, args.lifeline)
        proxy: Proxy = (TcpProxy if args.tcp else UdpProxy)(listen, to, faults, args.seed)
    except FaultError as error:
        return refuse(FaultError(f"--fault {error}"))
    except LaunchError as error:
        return refuse(error)
    loop = ProxyLoop(proxy, starter)
    loop.catch_signals()
    try:
        loop.run()
    finally:
        sys.stdout.write(report(proxy))
        sys.stdout.flush()
        proxy.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
