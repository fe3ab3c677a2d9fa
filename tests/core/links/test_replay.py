"""The replay link: a recording at its own pace, on the clock of the station."""

from pathlib import Path

import pytest

from tests.core.rigs.link_rig import FRAME
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.links import LinkError, open_link
from tui_gcs.core.links.base import MAX_DATAGRAMS_PER_RECEIVE
from tui_gcs.core.mavlink.encode import Encoder

START_US = 1_700_000_000_000_000


def frame(number: int) -> bytes:
    return Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=number + 1, time_boot_ms=number)


def recording(directory: Path, *times_s: float) -> Path:
    """A log with frame(0), frame(1), … at these times."""
    file = directory / "flight.tlog"
    times_us = [START_US + round(1e6 * time_s) for time_s in times_s]
    file.write_bytes(b"".join(t.to_bytes(8, "big") + frame(n) for n, t in enumerate(times_us)))
    return file


def test_frames_come_when_they_came(tmp_path: Path) -> None:
    clock = VirtualClock(start_s=500)
    file = recording(tmp_path, 0, 0.5, 0.5, 2)
    link = open_link(f"replay:{file}", clock)
    clock.advance(60)  # begins with the first receive, not when it is opened
    assert link.receive() == [(frame(0), str(file))]
    assert link.receive() == []
    clock.advance(0.5)
    assert [data for data, _ in link.receive()] == [frame(1), frame(2)]
    clock.advance(1.4)
    assert link.receive() == []
    assert link.error == ""
    clock.advance(0.1)
    assert [data for data, _ in link.receive()] == [frame(3)]
    assert link.error == f"end of {file}"
    clock.advance(1000)
    assert link.receive() == []
    assert link.bytes_in == sum(len(frame(n)) for n in range(4))
    assert (link.stream, link.partners, link.filenos()) == (False, [], [])


def test_what_is_sent_goes_nowhere(tmp_path: Path) -> None:
    link = open_link(f"replay:{recording(tmp_path, 0)}", VirtualClock())
    ((_, address),) = link.receive()
    link.send(FRAME, address)
    assert (link.send_refused, link.bytes_out) == (1, 0)


def test_one_receive_is_bounded(tmp_path: Path) -> None:
    clock = VirtualClock()
    count = MAX_DATAGRAMS_PER_RECEIVE + 100
    link = open_link(f"replay:{recording(tmp_path, *[n / 1000 for n in range(count)])}", clock)
    link.receive()
    clock.advance(60)  # the station slept
    assert [len(link.receive()) for _ in range(3)] == [MAX_DATAGRAMS_PER_RECEIVE, 99, 0]


def test_a_torn_end_is_the_end(tmp_path: Path) -> None:
    clock = VirtualClock()
    file = recording(tmp_path, 0, 1)
    file.write_bytes(file.read_bytes()[:-5])
    link = open_link(f"replay:{file}", clock)
    assert [data for data, _ in link.receive()] == [frame(0)]
    clock.advance(1)
    assert link.receive() == []
    assert link.error == f"end of {file}"


def test_closed_is_silent(tmp_path: Path) -> None:
    clock = VirtualClock()
    link = open_link(f"replay:{recording(tmp_path, 0, 1)}", clock)
    link.receive()
    link.close()
    clock.advance(1)
    assert link.receive() == []


@pytest.mark.parametrize(("content", "why"), [(b"", "empty, no telemetry in it"), (b"x" * 99, "not a telemetry log")])
def test_no_recording_is_told_at_once(tmp_path: Path, content: bytes, why: str) -> None:
    file = tmp_path / "flight.tlog"
    file.write_bytes(content)
    with pytest.raises(LinkError) as caught:
        open_link(f"replay:{file}")
    assert f"replay:{file}: " in str(caught.value)
    assert why in str(caught.value)


def test_the_shipped_recordings_play(pytestconfig: pytest.Config) -> None:
    clock = VirtualClock()
    link = open_link(f"replay:{pytestconfig.rootpath / 'tests/data/px4-8.tlog'}", clock)
    heard = 0
    for _ in range(100):
        heard += len(link.receive())
        clock.advance(0.05)
    assert heard > 500
    assert link.error == ""
