"""UDP links: `udpin` listens on a port of ours (many vehicles), `udpout` talks to one address."""

import errno
import socket
import struct
import sys

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.links.base import MAX_BYTES_PER_RECEIVE, MAX_DATAGRAMS_PER_RECEIVE, Link, reason
from tui_gcs.core.links.resolve import ResolvedAddress, listen_advice
from tui_gcs.core.links.spec import LinkError, LinkSpec
from tui_gcs.core.mavlink.sources import Address

RECEIVE_BUFFER_BYTES = 4 * 1024 * 1024
"""The default buffer holds 256 small datagrams, 37 ms of 250 vehicles; this one 1.46 s. The system may grant less."""
TROUBLE_S = 3.0
"""A refused send is shown for this long if none follows: UDP does not report that a datagram arrived."""
# The old socket keeps to an address that this machine does not have any more; a new one is tried at most this often.
RENEW_GAP_S = 1.0
# The largest UDP datagram; relays put many frames into one.
_MAX_DATAGRAM_BYTES = 65535
# A socket option of Linux (asm-generic/socket.h) for which Python has no name; it counts dropped datagrams.
_SO_MEMINFO = 55
_SK_MEMINFO_DROPS = 8
"""Linux: which of the 32-bit numbers of SO_MEMINFO counts the datagrams dropped (linux/sock_diag.h)."""
_MEMINFO = struct.Struct("=9I")


class UdpLink(Link):
    """The shared part of both kinds: one non-blocking socket, drained."""

    def __init__(self, spec: LinkSpec, udp: socket.socket, clock: Clock) -> None:
        """Use `udp`, which is bound or connected already."""
        super().__init__(spec)
        self._clock = clock
        self._trouble_until_s = 0.0
        self._closed = False
        self._drops_before = 0
        """Drops of sockets that this link had before the present one."""
        self._socket = udp

    @property
    def kernel_drops(self) -> int:
        """See `Link.kernel_drops`. A system call: for a status line, not for every datagram."""
        return self._drops_before + _drops(self._socket)

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`; drains the socket, bounded."""
        datagrams: list[tuple[bytes, Address]] = []
        receive, size = self._socket.recvfrom, 0
        for _ in range(MAX_DATAGRAMS_PER_RECEIVE):
            if size > MAX_BYTES_PER_RECEIVE:
                break
            try:
                one = receive(_MAX_DATAGRAM_BYTES)
                size += len(one[0])
                datagrams.append(one)
            except (BlockingIOError, InterruptedError):
                break
            # An earlier send of udpout met no listener. Datagrams may wait behind this error.
            except ConnectionRefusedError:
                self._trouble("nothing listens there (connection refused)")
            except OSError as error:
                self._trouble(reason(error))
                break
        self.bytes_in += size
        if self.error and not self._closed and (datagrams or self._clock.now() >= self._trouble_until_s):
            self.error = ""
        return datagrams

    def filenos(self) -> list[int]:
        """See `Link.filenos`."""
        return [] if self._closed else [self._socket.fileno()]

    def close(self) -> None:
        """See `Link.close`."""
        self._drops_before, self._closed, self.error = self.kernel_drops, True, "closed"
        self._socket.close()

    def _trouble(self, why: str) -> None:
        """Show `why` until something arrives, or for `TROUBLE_S`."""
        if not self._closed:
            self.error = why
            self._trouble_until_s = self._clock.now() + TROUBLE_S


class UdpInLink(UdpLink):
    """Listens on one port, alone: a second program there would silently take the first one's vehicles."""

    def __init__(self, spec: LinkSpec, place: ResolvedAddress, clock: Clock) -> None:
        """Bind to `place`.

        Raises:
            LinkError: the port is busy, or the address is not ours.
        """
        udp = _open(spec, place)
        try:
            if place.family == socket.AF_INET6:
                udp.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            # Without SO_REUSEADDR on purpose: with it a second program could silently take the first one's vehicles.
            udp.bind(place.address)
        except OSError as error:
            udp.close()
            raise LinkError(f"{spec.name}: {listen_advice(error, spec)}") from None
        super().__init__(spec, udp, clock)

    def send(self, data: bytes, to: Address) -> None:
        """See `Link.send`."""
        try:
            self.bytes_out += self._socket.sendto(data, to)
        except (OSError, TypeError, ValueError, OverflowError) as error:  # no route, full buffer; no address of ours
            self.send_refused += 1
            self._trouble(_why_not_sent(error))


class UdpOutLink(UdpLink):
    """A socket connected to one partner: it receives from and sends to that address only."""

    def __init__(self, spec: LinkSpec, place: ResolvedAddress, clock: Clock) -> None:
        """Talk to `place` from a free port of ours; where there is no way just now, as soon as there is one."""
        super().__init__(spec, _open(spec, place), clock)
        # A server answers only addresses that have sent to it.
        self.partners = [place.address]
        self._place = place
        self._renewed_s = clock.now()
        self._connect()

    def send(self, data: bytes, to: Address) -> None:
        """Send to the one partner, whatever `to` is."""
        try:
            try:
                self.bytes_out += self._socket.send(data)
            except ConnectionRefusedError:  # an earlier datagram was refused; this one was not sent yet
                self._trouble("nothing listens there (connection refused)")
                self.bytes_out += self._socket.send(data)
        except OSError as error:
            self.send_refused += 1
            self._trouble(_why_not_sent(error))
            if error.errno in _NO_WAY:
                self._renew()

    def _connect(self) -> None:
        try:
            self._socket.connect(self._place.address)
        except OSError as error:  # no network: sending will report it
            self._trouble(f"no way to {self.spec.host}: {reason(error)}")

    def _renew(self) -> None:
        """Take a new socket: the old one keeps to an address that this machine does not have."""
        now = self._clock.now()
        if self._closed or now - self._renewed_s < RENEW_GAP_S:
            return
        self._renewed_s = now
        try:
            udp = _open(self.spec, self._place)
        except LinkError:
            return
        self._drops_before = self.kernel_drops
        self._socket.close()
        self._socket = udp
        self._connect()


_NO_WAY = (
    errno.EINVAL,
    errno.ENETUNREACH,
    errno.EHOSTUNREACH,
    errno.EADDRNOTAVAIL,
    errno.ENETDOWN,
    errno.EDESTADDRREQ,
)
"""What a connected socket says for ever after the machine has changed its network (DHCP, another Wi-Fi), and one that
could not be connected."""


def _open(spec: LinkSpec, place: ResolvedAddress) -> socket.socket:
    """Return a non-blocking UDP socket with a large receive buffer. Raises LinkError."""
    try:
        udp = socket.socket(place.family, socket.SOCK_DGRAM)
    except OSError as error:
        raise LinkError(f"{spec.name}: cannot open a socket: {reason(error)}") from None
    udp.setblocking(False)
    # macOS refuses a size that it cannot grant.
    for size in (RECEIVE_BUFFER_BYTES, RECEIVE_BUFFER_BYTES // 4):
        try:
            udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, size)
        except OSError:
            continue
        break
    return udp


def _drops(udp: socket.socket) -> int:
    """Return how many datagrams the system has dropped of this socket; 0 where it has no count (not Linux)."""
    if sys.platform != "linux":
        return 0
    try:
        numbers = udp.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size)
    except OSError:  # an old system, or closed
        return 0
    return int(_MEMINFO.unpack(numbers)[_SK_MEMINFO_DROPS]) if len(numbers) == _MEMINFO.size else 0


def _why_not_sent(error: Exception) -> str:
    if isinstance(error, BlockingIOError):
        return "more is sent than the network takes"
    return f"cannot send: {reason(error)}"
