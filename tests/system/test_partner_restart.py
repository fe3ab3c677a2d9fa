"""A partner that was added while the station ran, through `kill -9` of the station and a flood, with pymavlink."""

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil

from tests.rigs.own_station import Watcher, processes, station_in, until
from tui_gcs.cli.sim_fleet import spec_of
from tui_gcs.client.launcher import LaunchOptions, free_port, launch
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import BusError
from tui_gcs.core.protocol.link_report import AddPartner, ClosePartner, GetLinks, PartnerRow
from tui_gcs.core.protocol.services import ServiceReply
from tui_gcs.core.scenario.load import load

SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"
FORCED_ARMING = (400, 0, 1, 21196, 0, 0, 0, 0, 0)

pytestmark = [pytest.mark.process, pytest.mark.long]


@pytest.fixture
def watcher(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watcher]:
    options = LaunchOptions(spec_of(load(SCENARIO)))
    folder = tmp_path_factory.mktemp("r")
    with station_in(folder, lambda: launch(RunKind.SIM, str(SCENARIO), SCENARIO.read_text(), [], options)) as found:
        until(lambda: found.status is not None and found.status.heard == 8, 20, "8 vehicles heard")
        yield found


def hears(partner: Any, seconds: float) -> bool:
    return partner.recv_match(type="HEARTBEAT", blocking=True, timeout=seconds) is not None


def row(watcher: Watcher) -> PartnerRow | None:
    """The one partner; None while the station does not answer."""
    try:
        reply = m.decode(watcher.bus.ask("gcs/req/test", m.encode(GetLinks())), ServiceReply)
    except BusError:
        return None
    return reply.link_report.partners[0] if reply.link_report is not None and reply.link_report.partners else None


def answers(partner: Any) -> bool:
    """Whether the autopilot of vehicle 1 answers the partner, which passes through rules, guard and uplink."""
    partner.mav.heartbeat_send(6, 8, 0, 0, 4)
    partner.mav.param_request_read_send(1, 1, b"RTL_ALT", -1)
    return partner.recv_match(type="PARAM_VALUE", blocking=True, timeout=1.0) is not None


def test_a_partner_goes_on_after_a_kill_and_not_after_it_was_closed(watcher: Watcher) -> None:
    port = free_port()
    partner = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=252, source_component=190)
    name = f"udpout:127.0.0.1:{port}"
    assert watcher.ask(AddPartner(name, takes_commands=True)).ok
    assert hears(partner, 5.0)
    until(lambda: answers(partner), 10, "a question passes")

    (pid,) = processes("tui_gcs.core.process.station_process")
    for _ in range(500):
        partner.mav.command_long_send(1, 1, *FORCED_ARMING)
    os.kill(pid, signal.SIGKILL)
    until(lambda: processes("tui_gcs.core.process.station_process") not in ([], [pid]), 20, "another station process")
    until(lambda: row(watcher) is not None, 20, "the partner is open again")
    partner.recv_match(type="NONE", blocking=True, timeout=0.5)  # what was on its way from the first
    until(lambda: answers(partner), 20, "its questions pass as before")

    for _ in range(2000):
        partner.mav.command_long_send(1, 1, *FORCED_ARMING)
    until(
        lambda: (found := row(watcher)) is not None and found.refused.get("too many", 0) > 0, 10, "a flood is refused"
    )
    assert watcher.ask(ClosePartner(name)).ok
    end = time.monotonic() + 0.5
    while time.monotonic() < end:
        partner.recv_match(blocking=True, timeout=0.1)
    assert not hears(partner, 2.0) and not answers(partner)
    closed = row(watcher)
    assert closed is not None and closed.is_closed and closed.refused["too many"] > 0
    frame = watcher.frame
    assert frame is not None and not any(each.armed for each in frame.rows()), "nothing was armed"
