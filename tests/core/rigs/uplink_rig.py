"""An uplink with memory links, and `Heard`'s vehicle 1 behind it: what leaves, what is journalled, what is recorded."""

import json
from pathlib import Path
from typing import Any

from tests.core.rigs.heard import Heard
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.geometry.zones import Circle
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.tlog_reader import read_tlog
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.scenario.model import Limits, OperatingArea
from tui_gcs.core.uplink.uplink import Uplink


class UplinkRig:
    """An uplink with the link "radio", and `Heard`'s vehicle 1 behind it."""

    def __init__(self, folder: Path, kind: RunKind = RunKind.LIVE, token: str = "", **vehicle: Any) -> None:
        self.heard = Heard(**vehicle)
        self.links = {name: MemoryLink(name) for name in ("radio", "other radio")}
        self.links["satellite"] = MemoryLink(spec=LinkSpec("satellite", "memory", "", high_latency=True))
        self.recorder, self.journal = TlogWriter(folder / "run.tlog"), Journal(folder / "run.jsonl")
        clock, events, fleet = self.heard.clock, self.heard.events, self.heard.fleet
        guard = Guard(Limits(), OperatingArea(Circle((0.0, 0.0), 100.0), 5.0, 50.0), ())
        files = (self.recorder, self.journal, clock, events)
        self.uplink = Uplink(dict(self.links), fleet, guard, Encoder(255, 190), *files, kind, token, self.heard.trust)

    def sent(self, link: str = "radio") -> list[tuple[str, dict[str, Any], object]]:
        """Name, fields and address of what left over a link since the last look."""
        found = []
        while self.links[link].sent:
            raw, address = self.links[link].sent.popleft()
            message = decode(cut_datagram(raw).frames[0])
            assert message is not None
            found.append((message.name, dict(message.fields), address))
        return found

    def journalled(self) -> list[dict[str, Any]]:
        path = self.journal.path
        return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []

    def recorded(self) -> list[int]:
        """Ids of the recorded messages."""
        self.recorder.close()
        return [frame.msgid for _, frame in read_tlog(self.recorder.path)]
