"""The way of HOLD ALL from the key to the frame is short: what is on it can fail or be slow."""

import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.rig import Rig
from tests.rigs.call_chain import callers, noting_callers
from tests.screens.rigs.quiet_pilot import QuietPilot
from tui_gcs.app import ConsoleApp
from tui_gcs.core.firmware.ardupilot import AUTO, GUIDED
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.protocol.zenoh_bus import QueuedBus, connect, serve

MAX_FUNCTIONS = 15
"""Between the command of the key and the `send` of the link, the bus between the processes included."""
BUS = ["ZenohBus.begin", "ZenohBus.answer.<locals>.handle", "QueuedBus._deliver", "QueuedBus.run_pending"]
"""The bus's own functions, in the order in which a question passes them."""


@pytest.mark.parametrize("mode", [GUIDED, AUTO])
async def test_hold_all_leaves_through_few_functions(
    rig: Callable[..., Rig], monkeypatch: pytest.MonkeyPatch, mode: int
) -> None:
    """A console on the bus of a station in lock-step: both are on one stack."""
    flight = rig(3).flying().run(5.0)
    for vehicle in flight.station.picture.fleet.vehicles.values():
        vehicle.telemetry.custom_mode = mode
    app = ConsoleApp(flight.bus, "console-test", clock=flight.clock)
    sent: list[list[str]] = []
    async with app.run_test(size=(120, 40)):
        pilot = QuietPilot(app)
        await pilot.press("!")
        monkeypatch.setattr(MemoryLink, "send", noting_callers(MemoryLink.send, sent))
        await pilot.press("h")
        await pilot.pause()
    stops = [names for names in sent if "Executive.hold" in names]
    assert len(stops) == 3, "each vehicle is sent one frame"
    for names in stops:
        way = [name for name in names if not name.startswith("MemoryBus.")]
        way = way[way.index("CommandController.hold_all") + 1 :]
        assert len(way) + len(BUS) <= MAX_FUNCTIONS, way


def test_a_question_passes_four_functions_of_the_bus_and_one_thread(tmp_path: Path) -> None:
    served = serve(tmp_path / "s")
    arrived = threading.Event()
    station, console = QueuedBus(served, arrived.set), connect(tmp_path / "s")
    passed: list[str] = []
    threads: list[threading.Thread] = []
    deliver = station._deliver

    def noting_deliver(*args: object) -> None:
        passed.extend(callers())
        threads.append(threading.current_thread())
        deliver(*args)  # type: ignore[arg-type]

    station._deliver = noting_deliver  # type: ignore[method-assign]
    station.answer("gcs/req/*", lambda key, data, reply: passed.extend(callers()))
    console.begin("gcs/req/me", b"hold", lambda answer: None, late=True)
    assert arrived.wait(5)
    station.run_pending()
    assert ["ZenohBus.begin", passed[0], "QueuedBus._deliver", passed[1]] == BUS
    assert len(passed) == 2 and threads[0] is not threading.current_thread()
    console.close()
    station.close()
