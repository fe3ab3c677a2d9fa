"""What lies between the station and the vehicles, so that checks can make it bad: silence, loss, missing messages.

It wraps the station's link, live or simulated, and harms the exchange with single vehicles by their addresses. A dead
station, a bad radio: that is what a vehicle and the station notice of it, and no vehicle has to be touched for it.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from sitl.links.faults import Faults, Lane
from tui_gcs.core.links import Link
from tui_gcs.core.mavlink.frames import cut_datagram
from tui_gcs.core.mavlink.sources import Address


class Air:
    """A `Link` that is the given one, made worse."""

    def __init__(self, link: Link, now: Callable[[], float]) -> None:
        """As good as the link itself."""
        self._link = link
        self._now = now
        self._muted: list[Address] = []
        self._hidden: dict[Address, tuple[int, list[bytes]]] = {}
        """Which message is lost, and what was lost, by sender."""
        self._lanes: dict[Address, tuple[Lane, Lane]] = {}

    def __getattr__(self, name: str) -> Any:
        """All that is not said here is as the link has it."""
        return getattr(self._link, name)

    def send(self, data: bytes, to: Address) -> None:
        """See `Link.send`."""
        if to in self._muted:
            return
        lanes = self._lanes.get(to)
        for frame in [data] if lanes is None else lanes[0].step(self._now(), data):
            self._link.send(frame, to)

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`."""
        arrived = self._link.receive()
        if not self._lanes and not self._hidden:
            return arrived
        return [(kept, address) for data, address in arrived for kept in self._heard(data, address)]

    def _heard(self, data: bytes, address: Address) -> list[bytes]:
        msgid, withheld = self._hidden.get(address, (-1, []))
        if msgid >= 0 and [frame.msgid for frame in cut_datagram(data).frames] == [msgid]:
            withheld.append(data)
            return []
        lanes = self._lanes.get(address)
        return [data] if lanes is None else lanes[1].step(self._now(), data)

    # ---------------------------------------------------------------- what checks do

    @contextmanager
    def muted(self, address: Address) -> Iterator[None]:
        """Nothing that the station sends gets there; it hears on."""
        self._muted.append(address)
        try:
            yield
        finally:
            self._muted.remove(address)

    @contextmanager
    def hiding(self, address: Address, msgid: int) -> Iterator[list[bytes]]:
        """Messages of one kind from there are lost; gives what was lost. Datagram links only."""
        withheld: list[bytes] = []
        self._hidden[address] = (msgid, withheld)
        try:
            yield withheld
        finally:
            self._hidden.pop(address, None)

    @contextmanager
    def losing(self, address: Address, share: float, seed: int) -> Iterator[tuple[Lane, Lane]]:
        """A share of all datagrams is lost, each way. Datagram links only. Gives the lanes up and down."""
        faults = Faults(loss=share)
        lanes = (
            Lane(faults, seed=seed, vehicle=0, direction="up"),
            Lane(faults, seed=seed, vehicle=0, direction="down"),
        )
        self._lanes[address] = lanes
        try:
            yield lanes
        finally:
            self._lanes.pop(address, None)
