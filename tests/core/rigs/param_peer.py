"""Parameters of scripted vehicles, with the manners measured on ArduPilot and on PX4."""

import math
import struct
import zlib
from typing import Any

from tests.core.rigs.service_rig import PX4, Peer

INT8, INT16, INT32, REAL32, UINT32 = 2, 4, 6, 9, 5
LIMITS = {INT8: (-128, 127), INT16: (-32768, 32767), INT32: (-(2**31), 2**31 - 1)}


def bits_as_float(value: int) -> float:
    return struct.unpack("<f", struct.pack("<i", value))[0]


class ParamServer:
    """name -> [type, value]; answers from now on."""

    def __init__(self, peer: Peer, params: dict[str, tuple[int, float]] | None = None) -> None:
        self.peer = peer
        self.px4 = peer.autopilot == PX4
        self.params = {name: list(pair) for name, pair in (params if params is not None else usual(self.px4)).items()}
        self.gap_s = 0.0005
        """Between the messages of a list."""
        self.mute = False
        peer.answers["PARAM_REQUEST_LIST"] = self.list
        peer.answers["PARAM_REQUEST_READ"] = self.read
        peer.answers["PARAM_SET"] = self.set

    def value(self, name: str, index: int | None = None) -> None:
        """A PARAM_VALUE leaves."""
        if self.mute:
            return
        if name == "_HASH_CHECK":
            self.say(name, struct.unpack("<f", struct.pack("<I", self.hash()))[0], UINT32, 65535)
            return
        kind, value = self.params[name]
        number = bits_as_float(int(value)) if self.px4 and kind != REAL32 else float(value)
        unknown = list(self.params).index(name) if self.px4 else 65535
        self.say(name, number, kind, unknown if index is None else index)

    def say(self, name: str, value: float, kind: int, index: int, count: int | None = None) -> None:
        count = len(self.params) if count is None else count
        self.peer.say(
            "PARAM_VALUE", param_id=name, param_value=value, param_type=kind, param_index=index, param_count=count
        )

    def hash(self) -> int:
        crc = 0
        for name, (kind, value) in self.params.items():
            crc = zlib.crc32(name.encode(), crc)
            crc = zlib.crc32(struct.pack("<f", value) if kind == REAL32 else struct.pack("<i", int(value)), crc)
        return crc

    def list(self, peer: Peer, fields: dict[str, Any]) -> None:
        names = (["_HASH_CHECK"] if self.px4 else []) + list(self.params)
        for number, name in enumerate(names):
            index = None if name == "_HASH_CHECK" else number - self.px4
            peer.after(number * self.gap_s, lambda name=name, index=index: self.value(name, index))

    def read(self, peer: Peer, fields: dict[str, Any]) -> None:
        index, name = fields["param_index"], str(fields["param_id"])
        if index >= 0:
            if index < len(self.params):
                self.value(list(self.params)[index], index)
        elif name in self.params or (self.px4 and name == "_HASH_CHECK"):
            self.value(name)
        elif self.px4:
            self.error(name, 1)

    def error(self, name: str, code: int) -> None:
        self.peer.say_to_us("PARAM_ERROR", param_id=name, param_index=-7, error=code)

    def set(self, peer: Peer, fields: dict[str, Any]) -> None:
        name, value = str(fields["param_id"]), fields["param_value"]
        if name not in self.params:
            if self.px4:
                self.error(name, 1)
            return
        kind = self.params[name][0]
        if self.px4:
            if fields["param_type"] != kind:
                self.error(name, 7)
                return
            if kind != REAL32:
                value = struct.unpack("<i", struct.pack("<f", value))[0]
        elif not math.isfinite(value):
            return
        elif kind in LIMITS:
            value = int(max(LIMITS[kind][0], min(LIMITS[kind][1], value)))
        self.params[name][1] = value
        self.value(name)

    def packed(self, block: int = 239) -> bytes:
        """As ArduPilot's param.pck, padded so that no entry is cut by a block's end."""
        out = struct.pack("<HHH", 0x671B, len(self.params), len(self.params))
        before = b""
        kinds = {INT8: (1, "<b"), INT16: (2, "<h"), INT32: (3, "<i"), REAL32: (4, "<f")}
        for name, (kind, value) in self.params.items():
            raw = name.encode()
            common = 0
            while common < min(len(before), len(raw) - 1, 15) and before[common] == raw[common]:
                common += 1
            number, form = kinds[kind]
            packed = struct.pack(form, value if kind == REAL32 else int(value))
            entry = bytes([number, (len(raw) - common - 1) << 4 | common]) + raw[common:] + packed
            room = block - len(out) % block
            out += bytes(room) * (len(entry) > room) + entry
            before = raw
        return out


def usual(px4: bool = False) -> dict[str, tuple[int, float]]:
    """Some parameters of all types."""
    small = {} if px4 else {"FS_GCS_ENABLE": (INT8, 0), "RTL_ALT": (INT16, 1500)}
    many = {f"P{number:03d}_{'LONG' * (number % 3)}": (REAL32, number / 4) for number in range(200)}
    whole = {"BIG": (INT32, 16_777_216), "NEGATIVE": (INT32, -3), "SIXTEEN_LETTERS_": (REAL32, 0.5)}
    return {**small, **many, **whole}
