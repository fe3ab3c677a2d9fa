"""A scripted vehicle that does evil beside an honest one, and what must be true afterwards.

For attacks within a dialogue, which the oracle's simulated vehicles would disturb with answers of their own.
"""

import gc
import time
from pathlib import Path
from typing import Any

from tests.core.rigs.service_rig import Peer, ServiceRig
from tests.hostile.oracle import MAX_GROWTH_MB, MAX_STEP_S, rss_mb, watch_files
from tui_gcs.core.protocol.common import Freshness


class PeerRig(ServiceRig):
    """Vehicle 1 is the evil one, vehicle 2 must not notice."""

    def __init__(self, folder: Path, evil: Peer, **how: Any) -> None:
        super().__init__(folder, evil, Peer(2), **how)
        self.folder = folder
        self.evil = evil
        self.slowest_s = 0.0
        self.changed: list[str] = []
        self.here = set(Path.cwd().iterdir())
        self.heard()
        gc.collect()
        self.before_mb = rss_mb()
        watch_files(self.changed, folder)

    def step(self) -> None:
        began_s = time.process_time()
        super().step()
        self.slowest_s = max(self.slowest_s, time.process_time() - began_s)

    def dropped(self) -> dict[str, int]:
        return self.station.publisher.status().dropped

    def holds(self, *, counted: str = "") -> None:
        """The verdict."""
        self.run(1.2)
        watch_files(None, self.folder)
        assert self.slowest_s < MAX_STEP_S, f"a step took {self.slowest_s * 1e3:.0f} ms"
        gc.collect()
        assert rss_mb() - self.before_mb < MAX_GROWTH_MB, f"grew by {rss_mb() - self.before_mb:.0f} MB"
        outside = [change for change in self.changed if "/" in change]  # a bare name is relative to a folder of ours
        assert outside == [], f"outside of the state directory: {outside[:5]}"
        assert set(Path.cwd().iterdir()) == self.here, "nor is it relative to where we are"
        assert self.vehicle(2).freshness(self.clock.now()) is Freshness.OK
        strange = {name for _, name, _ in self.peers[2].heard} - {"COMMAND_LONG", "TIMESYNC", "PING"}
        assert not strange, f"sent to somebody else because of it: {strange}"
        if counted:
            assert self.dropped().get(counted), f"{counted!r} not among {self.dropped()}"
