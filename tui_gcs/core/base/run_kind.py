"""Kinds of run. A file of its own, because the command line needs it before anything heavy is imported."""

from enum import StrEnum


class RunKind(StrEnum):
    """Whether vehicles are ours and simulated, real, or recorded. They never mix."""

    SIM = "SIM"
    LIVE = "LIVE"
    REPLAY = "REPLAY"
