"""Modules of screens are read before anybody asks for them, but not before the first frame."""

import subprocess
import sys
import textwrap

import pytest

from tui_gcs.console.preload import SCREENS


@pytest.mark.long
def test_the_app_does_without_them_and_afterwards_they_are_there() -> None:
    script = f"""
        import sys, threading
        from tui_gcs import app
        names = {[f"tui_gcs.screens.{name}" for name in SCREENS]!r}
        assert not any(name in sys.modules for name in names), "the first frame waits for them"
        app.preload_screens()
        for thread in threading.enumerate():
            if thread.name == "preload":
                thread.join()
        assert all(name in sys.modules for name in names)
        """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 0, done.stderr
