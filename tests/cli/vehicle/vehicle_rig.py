"""`tui-gcs vehicle …` on scripted vehicles: time passes in the rig while a command waits."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.test_keys import Typist
from tests.core.rigs.service_rig import ServiceRig
from tui_gcs.cli.main import main
from tui_gcs.cli.vehicle import files as vehicle_files
from tui_gcs.cli.vehicle import verb as vehicle
from tui_gcs.cli.vehicle.station_client import StationClient
from tui_gcs.core.base.run_kind import RunKind

Tell = Callable[..., tuple[int, str, str]]


class RigClient(StationClient):
    """Asks the station of a rig; somebody sits there and may do something at every look."""

    rig: ServiceRig
    enter: Callable[[], bool] = staticmethod(lambda: False)

    def pause(self) -> None:
        self.rig.run(0.2)

    def entered(self) -> bool:
        return self.enter()

    def close(self) -> None:
        pass


@pytest.fixture
def tell(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Tell:
    """tell(rig, words…, answer=…, enter=…): exit code, stdout, stderr of a command.

    `answer` is what is typed when it asks; `enter` is called at every look, and True is an Enter.
    """

    def run(
        rig: ServiceRig, *words: str, answer: str | None = None, enter: Callable[[], bool] = lambda: False
    ) -> tuple[int, str, str]:
        client = RigClient(RunKind.LIVE, rig.bus)
        client.rig, client.enter = rig, enter  # type: ignore[method-assign]
        monkeypatch.setattr(vehicle, "open_station", lambda kind: client)
        monkeypatch.setattr(sys, "stdin", Typist(answer or "", terminal=answer is not None))
        monkeypatch.setattr(vehicle_files, "state_dir", lambda kind: tmp_path / "state")
        code = main(["vehicle", *words])
        out = capsys.readouterr()
        return code, out.out, out.err

    monkeypatch.chdir(tmp_path)
    return run
