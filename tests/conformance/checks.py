"""All checks, in the order in which they are made."""

import importlib

MODULES = ("link", "data", "flight", "mission")


def load() -> None:
    """Import every module of checks: importing registers."""
    for name in MODULES:
        importlib.import_module(f"tests.conformance.check_{name}")
