"""A command line in this process, with what it prints."""

import json
from typing import Any

import pytest

from tui_gcs.cli.main import main


class CapturedCommand:
    """Runs `tui-gcs WORDS`; what stands for the station is the subclass's affair."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def run(self, *words: str) -> tuple[int, str, str]:
        """Exit code, standard output and standard error."""
        code = main([*words])
        out = self._capsys.readouterr()
        return code, out.out, out.err

    def report(self, *words: str) -> tuple[int, dict[str, Any]]:
        """Exit code and the document of `--json`."""
        code, out, _ = self.run(*words, "--json")
        return code, json.loads(out)
