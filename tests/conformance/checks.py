"""All checks, in the order in which they are made."""

import importlib

MODULES = (
    "link",
    "params",
    "plans",
    "files",
    "orders",
    "setup",
    "arming",
    "events",
    "flight",
    "mission",
    "failsafes",
    "logs",
    "reboot",
)


def load() -> None:
    """Import every module of checks: importing registers."""
    for name in MODULES:
        importlib.import_module(f"tests.conformance.check_{name}")
