"""Asking vehicles for a message at a rate: what was typed, the station's doubts, the vehicles' answers."""

import math

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import ReplyCode
from tui_gcs.core.protocol.inspection import MAX_RATE_HZ, MessageRow, SetMessageRate
from tui_gcs.core.protocol.services import MEANT
from tui_gcs.feed.task_requests import TaskOutcome, carry_out
from tui_gcs.screens.common.screen_edits import ScreenEdits
from tui_gcs.screens.common.sure_dialog import SureDialog
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run

GIVEN_BACK = ("auto", "a", "-")
"""What is typed to let the station decide again."""


class MessageRates(ScreenEdits):
    """Asks vehicles for rates, and the operator where the station has doubts."""

    def vehicles_of(self, row: MessageRow) -> tuple[int, ...]:
        """Return which vehicles are asked: that of the row, or all selected ones if it is one of them."""
        selected = self._feed.selection.ids
        return selected if row.vehicle in selected else (row.vehicle,)

    def why_not(self, row: MessageRow | None) -> str:
        """Return why no rate can be asked for this row; "" if it can."""
        if self._feed.requests.read_only:
            return self._feed.requests.read_only
        if row is None:
            return "no message is chosen"
        if not row.vehicle:
            return "it is no vehicle's: nothing is asked of it"
        if not row.autopilot:
            return "only autopilots are asked for rates, and this is another component"
        return ""

    def ask(self, row: MessageRow, typed: str) -> None:
        """Ask the vehicles of the row for the rate that was typed."""
        text = typed.strip().casefold()
        rate_hz = None if text in GIVEN_BACK else typed_rate(text)
        if rate_hz is not None and math.isnan(rate_hz):
            self.say(f"{clean(typed, 40)!r} is no rate: 0 to {MAX_RATE_HZ:g} Hz, or auto", Ink.CAUTION)
            return
        self._send(row.name, SetMessageRate(self.vehicles_of(row), row.key.msgid, rate_hz))

    def _send(self, name: str, request: SetMessageRate) -> None:
        self.say(f"asking {vehicles_words(request.vehicles)} for {name} {rate_words(request)}")
        self._host.run_worker(self._carry_out(name, request), group="rates", exit_on_error=False)

    async def _carry_out(self, name: str, request: SetMessageRate) -> None:
        outcomes = await carry_out(self._feed.requests, self._clock, request)
        doubtful = [each for each in outcomes if each.code is ReplyCode.NOT_CONFIRMED]
        done = [each.vehicle for each in outcomes if each.ok]
        failed = [each for each in outcomes if not each.ok and each not in doubtful]
        lines: list[Run] = [
            (f"vehicle {each.vehicle}: NOT SET: {clean(each.text, 200)}", Ink.WARNING) for each in failed
        ]
        if done:
            lines.append((f"{name} {rate_words(request)}: agreed by {vehicles_words(done)}", Ink.NORMAL))
        self.report = tuple(lines)
        self._show()
        if doubtful:
            self._ask_again(name, request, doubtful)

    def _ask_again(self, name: str, request: SetMessageRate, doubtful: list[TaskOutcome]) -> None:
        vehicles = tuple(each.vehicle for each in doubtful)
        reasons = list(dict.fromkeys(clean(each.text.removesuffix(f": {MEANT}"), 300) for each in doubtful))
        meant = msgspec.structs.replace(request, vehicles=vehicles, sure=True)

        def answered(yes: bool | None) -> None:
            if yes:
                self._send(name, meant)
            else:
                self.say(f"{name}: left as it is on {vehicles_words(vehicles)}")

        title = f"{name}: {vehicles_words(vehicles)}"
        self._host.app.push_screen(SureDialog(title, reasons, "ask for it", self._glyphs, self._clock), answered)


def typed_rate(text: str) -> float:
    """Return the rate that was typed, in hertz; NaN if it is none."""
    try:
        rate_hz = float(text.removesuffix("hz").strip())
    except ValueError:
        return math.nan
    return rate_hz if 0.0 <= rate_hz <= MAX_RATE_HZ else math.nan


def rate_words(request: SetMessageRate) -> str:
    """Return the rate that is asked for, in words."""
    return "as the station asks" if request.rate_hz is None else f"at {request.rate_hz:g} Hz"
