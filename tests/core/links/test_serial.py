"""The serial link, on pseudo-terminals: what is plugged in, taken away, plugged in again, or does not read."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.core.rigs.link_rig import FRAME, stream_of, until
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.links import LinkError, open_link, parse_link, try_links
from tui_gcs.core.links.base import Link


class Radio:
    """The far end of a cable: a pseudo-terminal behind a name that stays the same, as of udev's links."""

    def __init__(self, name: Path) -> None:
        self.name = name
        self.master = -1

    def plug(self) -> None:
        self.master, slave = os.openpty()
        os.set_blocking(self.master, False)
        self.name.symlink_to(os.ttyname(slave))
        os.close(slave)

    def unplug(self) -> None:
        os.close(self.master)
        self.name.unlink()
        self.master = -1

    def says(self, data: bytes) -> None:
        assert os.write(self.master, data) == len(data)

    def hears(self) -> bytes:
        """What has come through the cable so far."""
        got = b""
        try:
            while data := os.read(self.master, 65536):
                got += data
        except OSError:
            pass
        return got


@pytest.fixture
def radio(tmp_path: Path) -> Iterator[Radio]:
    radio = Radio(tmp_path / "ttyUSB0")
    radio.plug()
    yield radio
    if radio.master >= 0:
        os.close(radio.master)


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture
def link(radio: Radio, clock: VirtualClock) -> Iterator[Link]:
    link = open_link(f"serial:{radio.name}:57600", clock)
    yield link
    link.close()


def test_bytes_go_both_ways_just_as_they_are(link: Link, radio: Radio) -> None:
    address = str(radio.name)
    assert (link.stream, link.error, link.partners) == (True, "not open yet", [address])
    assert link.receive() == [(b"", address)]
    everything = bytes(range(256))  # also what a terminal would take for a signal, an end of line or an end of file
    radio.says(everything)
    assert stream_of(link, 256) == everything
    link.send(everything, "whoever")
    assert until(radio.hears) == everything
    assert (link.bytes_in, link.bytes_out, link.send_refused, link.error) == (256, 256, 0, "")


def test_silence_is_no_end(link: Link) -> None:
    link.receive()
    assert [link.receive() for _ in range(3)] == [[], [], []]
    assert link.error == ""
    assert len(link.filenos()) == 1


def test_unplugged_and_plugged_in_again(link: Link, radio: Radio, clock: VirtualClock) -> None:
    link.receive()
    radio.says(FRAME)
    stream_of(link, len(FRAME))
    radio.unplug()
    until(lambda: link.receive() or link.error)
    assert link.error == "unplugged; next try in 1 s"
    assert link.filenos() == []
    clock.advance(1)
    assert link.receive() == []
    assert link.error == "no such device. Plug it in or check the name; next try in 2 s"
    radio.plug()
    assert link.receive() == []
    clock.advance(2)
    assert link.receive() == [(b"", str(radio.name))]
    assert link.error == ""
    radio.says(FRAME)
    assert stream_of(link, len(FRAME)) == FRAME
    link.send(FRAME, "")
    assert until(radio.hears) == FRAME


def test_unplugged_while_sending(link: Link, radio: Radio) -> None:
    link.receive()
    radio.unplug()
    link.send(FRAME, "")
    until(lambda: link.receive() or link.error)
    assert link.error.startswith("unplugged")
    link.send(FRAME, "")
    assert (link.bytes_out, link.send_refused) == (0, 2)


def test_a_device_that_is_plugged_in_later(tmp_path: Path, clock: VirtualClock) -> None:
    radio = Radio(tmp_path / "ttyUSB1")
    link = open_link(f"serial:{radio.name}", clock)
    waits = []
    for _ in range(6):
        assert link.receive() == []
        waits.append(link.error.rpartition(" in ")[2])
        clock.advance(10)
    assert waits == ["1 s", "2 s", "4 s", "8 s", "10 s", "10 s"]
    radio.plug()
    assert link.receive() == [(b"", str(radio.name))]
    link.close()
    radio.unplug()


def test_a_line_that_is_slower_than_we_send_takes_whole_frames_and_has_no_long_queue(link: Link, radio: Radio) -> None:
    link.receive()
    sent = 0
    while not link.send_refused:
        link.send(sent.to_bytes(4, "big") + bytes(60), "")
        sent += 1
    waiting = 64 * (sent - 1) - link.bytes_out
    assert 5760 - 64 < waiting <= 5760  # a second of 57600 baud
    heard = b""

    def all_heard() -> bool:
        nonlocal heard
        heard += radio.hears()
        link.receive()  # sends what waits
        return len(heard) == 64 * (sent - 1)

    assert until(all_heard)
    assert heard == b"".join(number.to_bytes(4, "big") + bytes(60) for number in range(sent - 1))
    assert (link.bytes_out, link.send_refused, link.error) == (len(heard), 1, "")


def test_a_device_has_one_user(link: Link, radio: Radio, clock: VirtualClock) -> None:
    link.receive()
    other = open_link(f"serial:{radio.name}:9600", clock)
    assert other.receive() == []
    assert other.error == "another program uses the device. Close it there; next try in 1 s"
    with pytest.raises(LinkError, match=f"^{other.name}: another program uses the device. Close it there$"):
        try_links([other.spec])
    link.close()
    try_links([other.spec])
    clock.advance(1)
    assert other.receive() == [(b"", str(radio.name))]
    other.close()


@pytest.mark.parametrize(
    ("device", "why"),
    [
        ("/dev/no-such-device", "no such device. Plug it in or check the name"),
        ("/dev/null", "not a serial device"),
        ("/dev/.", "Is a directory"),
    ],
)
def test_what_cannot_be_opened_says_why(device: str, why: str) -> None:
    spec = parse_link(f"serial:{device}")
    with pytest.raises(LinkError) as caught:
        try_links([spec])
    assert str(caught.value) == f"{spec.name}: {why}"


def open_descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="only Linux tells which descriptors are open")
def test_fifty_flaps_leave_no_descriptor_behind(link: Link, radio: Radio, clock: VirtualClock) -> None:
    def flap() -> None:
        assert link.receive() == [(b"", str(radio.name))]
        radio.unplug()
        until(lambda: link.receive() or link.error)
        radio.plug()
        clock.advance(10)

    flap()
    before = open_descriptors()
    for _ in range(50):
        flap()
    assert open_descriptors() <= before, "fewer, when an earlier test's were still being collected"
