"""Logs of scripted vehicles, with the manners measured on ArduPilot and on PX4."""

from typing import Any

from tests.core.rigs.service_rig import PX4, Peer


class LogServer:
    """id -> (time, contents); answers from now on."""

    def __init__(self, peer: Peer, logs: dict[int, tuple[int, bytes]] | None = None, *, rate: float = 1675.0) -> None:
        self.peer = peer
        self.px4 = peer.autopilot == PX4
        self.logs = dict(logs or {})
        self.gap_s = 1 / rate
        """Between two frames: ArduPilot's 1675 frames a second."""
        self.serial = 0
        """Of the newest request: older ones are not gone on with."""
        peer.answers["LOG_REQUEST_LIST"] = self.list
        peer.answers["LOG_REQUEST_DATA"] = self.data
        peer.answers["LOG_REQUEST_END"] = self.end
        peer.answers["LOG_ERASE"] = self.erase

    def list(self, peer: Peer, fields: dict[str, Any]) -> None:
        if peer.armed and not self.px4:
            self.refuse()
            return
        if not self.logs:
            if not self.px4:
                peer.say("LOG_ENTRY", id=0, num_logs=0, last_log_num=0, time_utc=0, size=0)
            return
        for number, (time_utc, data) in self.logs.items():
            if fields["start"] <= number <= fields["end"]:
                peer.say(
                    "LOG_ENTRY",
                    id=number,
                    num_logs=len(self.logs),
                    last_log_num=max(self.logs),
                    time_utc=time_utc,
                    size=len(data),
                )

    def refuse(self) -> None:
        text = b"Disarm for log download"
        self.peer.after(0.01, lambda: self.peer.say("STATUSTEXT", severity=3, text=text))

    def data(self, peer: Peer, fields: dict[str, Any]) -> None:
        if peer.armed and not self.px4:
            self.refuse()
            return
        if fields["id"] not in self.logs:
            return
        self.serial += 1
        serial, number = self.serial, fields["id"]
        content = self.logs[number][1]
        offset, stop = fields["ofs"], min(len(content), fields["ofs"] + fields["count"])
        frames = range(offset, stop, 90)
        for index, at in enumerate(frames):
            block = content[at : min(at + 90, stop)]
            peer.after(index * self.gap_s, lambda at=at, block=block: self.frame(serial, number, at, block))

    def frame(self, serial: int, number: int, offset: int, block: bytes) -> None:
        if serial == self.serial:
            self.peer.say("LOG_DATA", id=number, ofs=offset, count=len(block), data=list(block.ljust(90, b"\0")))

    def end(self, peer: Peer, fields: dict[str, Any]) -> None:
        self.serial += 1

    def erase(self, peer: Peer, fields: dict[str, Any]) -> None:
        if not peer.armed:
            peer.after(2.0, self.logs.clear)
