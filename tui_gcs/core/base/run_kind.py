"""Kinds of run. A module of its own, because the command line needs it before anything heavy is imported."""

from enum import StrEnum


class RunKind(StrEnum):
    """Whether vehicles are simulated by us, real, or recorded. These never mix."""

    SIM = "SIM"
    LIVE = "LIVE"
    REPLAY = "REPLAY"
