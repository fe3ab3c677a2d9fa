"""What the setup screen does to vehicles: set, choose, calibrate, test, confirm, cancel, take back."""

from collections.abc import Callable, Coroutine, Iterable, Sequence
from typing import Any

import msgspec
from textual.screen import Screen

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.float32 import shown, typed_number
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.base import VehicleRequest
from tui_gcs.core.protocol.common import ReplyCode
from tui_gcs.core.protocol.services import MEANT, CancelTask, TaskInfo
from tui_gcs.core.protocol.setup import (
    Calibrate,
    CancelCalibration,
    ChooseAirframe,
    ConfirmStep,
    ReadSetup,
    SectionWord,
    SetGain,
    TestMotor,
    UndoGains,
    UndoRadio,
)
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.parameter_transfers import ParameterTransfers
from tui_gcs.feed.setup_watch import MOTOR_TEST, FleetSetupField
from tui_gcs.feed.task_requests import TaskOutcome, by_reason, carry_out
from tui_gcs.screens.common.choice_dialog import ChoiceDialog
from tui_gcs.screens.common.screen_edits import ScreenEdits
from tui_gcs.screens.common.sure_dialog import SureDialog
from tui_gcs.screens.parameters.parameter_edits import NONE_SELECTED, ParameterEdits
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run

TEST_THROTTLE, TEST_S = 0.15, 1.0
"""A motor test from here: enough to start any motor, too short to move a vehicle without propellers."""
PROPELLERS = "ALL its propellers must be OFF, also those of the other motors: the motor turns at once"
MAX_LINES = 5
"""Lines of vehicles that failed, each with a reason of its own."""


class SetupEdits(ScreenEdits):
    """Asks whether a change is meant, sends it, and keeps the report of the last one."""

    def __init__(self, host: Screen[Any], feed: Feed, clock: Clock, glyphs: GlyphSet, show: Callable[[], None]) -> None:
        """Work for the screen `host`; `show` is called whenever `report` has changed."""
        super().__init__(host, feed, clock, glyphs, show)
        self._transfers = ParameterTransfers(feed.requests, clock, lambda: None)
        self._parameters = ParameterEdits(host, feed, clock, self._transfers, glyphs, self._take_report)

    def _take_report(self) -> None:
        self.report = self._parameters.report
        self._show()

    def why_not(self) -> str:
        """Return why nothing can be changed now; "" if it can."""
        return self._parameters.why_not()

    def vehicles_of(self, field: FleetSetupField) -> tuple[int, ...]:
        """Return the selected vehicles that have the line."""
        having = set(field.vehicles)
        return tuple(vehicle for vehicle in self._feed.selection.ids if vehicle in having)

    # ---------------------------------------------------------------- values

    def choose(self, field: FleetSetupField) -> None:
        """Ask for one of the named values of a line, and whether it is to be set."""
        number = field.number_of(self._feed.selection.lead)
        dialog = ChoiceDialog(f"{field.row.label}: {field.row.param}", field.row.choices, number, self._glyphs)

        def answered(text: str | None) -> None:
            if text:
                self.set(field, text)
            else:
                self.say("left as it is")

        self._host.app.push_screen(dialog, answered)

    def set(self, field: FleetSetupField, typed: str) -> None:
        """Ask whether the typed value of a parameter, an airframe or a gain is to be set on the selected vehicles."""
        value = typed_number(typed)
        if value is None:
            self.say(f"{clean(typed, 40)!r} is no number: nothing was set", Ink.CAUTION)
        elif field.row.act == "airframe":
            self._choose_airframe(field, typed)
        elif field.row.act == "gain":
            request = SetGain(self.vehicles_of(field), field.row.param, value)
            self._send(f"{field.row.param} = {shown(value)}", request)
        else:
            self._run(self._set_parameter(field.row.param, typed))

    async def _set_parameter(self, name: str, typed: str) -> None:
        """Ask as the parameters screen does, with the newest values that the station has."""
        vehicles = self._feed.selection.ids
        await self._transfers.look(vehicles)
        table = self._transfers.parameters.table(vehicles)
        parameter = next((each for each in table if each.name == name), None)
        if parameter is None:
            self.say(f"{name} was not read from {vehicles_words(vehicles)}: R reads it", Ink.CAUTION)
        else:
            self._parameters.set(parameter, typed)

    def _choose_airframe(self, field: FleetSetupField, typed: str) -> None:
        request = ChooseAirframe(self.vehicles_of(field), (f"{field.row.label}={typed}",))
        name = dict(field.row.choices).get(int(typed), "") if typed.isdecimal() else ""
        what = f"{field.row.label} {typed} {name}".rstrip()
        self._ask(what, request, self._prompts(field), "set it")

    def _prompts(self, field: FleetSetupField) -> list[str]:
        """What to do before, of the selected vehicles that have the line; each prompt with its vehicles."""
        mine = [(prompt, set(vehicles).intersection(self.vehicles_of(field))) for prompt, vehicles in field.prompts]
        shown_to = [(prompt, vehicles) for prompt, vehicles in mine if vehicles]
        if len(shown_to) == 1:
            return [shown_to[0][0]]
        return [f"{vehicles_words(vehicles)}: {prompt}" for prompt, vehicles in shown_to]

    # ---------------------------------------------------------------- what is led

    def calibrate(self, field: FleetSetupField) -> None:
        """Ask whether a sensor, or the transmitter ("rc"), of the selected vehicles is to be calibrated."""
        request = msgspec.convert({"vehicles": self.vehicles_of(field), "sensor": field.row.label}, Calibrate)
        self._ask(f"calibrate {field.row.label}", request, self._prompts(field), "begin")

    def test_motor(self, field: FleetSetupField) -> None:
        """Ask whether one motor of the vehicle looked at is to turn."""
        lead = self._feed.selection.lead
        if lead not in field.vehicles or lead is None:
            self.say(f"it has no {field.row.label}: n looks at another vehicle", Ink.CAUTION)
            return
        motor = next((int(value) for vehicle, value in field.numbers if vehicle == lead), 0)
        request = TestMotor((lead,), motor, TEST_THROTTLE, TEST_S, props_removed=True)
        how = f"it turns with {TEST_THROTTLE:.0%} for {TEST_S:g} s; Del stops it"
        self._ask(f"turn {field.row.label}", request, [PROPELLERS, how], "they are off: turn it")

    def confirm(self, tasks: Sequence[TaskInfo]) -> None:
        """Report that the prompt was followed: for the selected vehicles that show the same one."""
        selected, lead = self._feed.selection.ids, self._feed.selection.lead
        waiting = [task for task in tasks if task.waits and task.vehicle in selected]
        if not waiting:
            self.say("no selected vehicle waits for that", Ink.CAUTION)
            return
        first = next((task for task in waiting if task.vehicle == lead), waiting[0])
        same = [task for task in waiting if (task.what, task.prompt) == (first.what, first.prompt)]
        self._run(self._confirm(same, len(waiting) - len(same)))

    async def _confirm(self, tasks: Sequence[TaskInfo], others: int) -> None:
        lines: list[Run] = []
        done: list[int] = []
        for task in tasks:
            reply = await self._feed.requests.send(ConfirmStep(task.number))
            if reply.ok:
                done.append(task.vehicle)
            else:
                lines.append((f"vehicle {task.vehicle}: {clean(reply.text, 200)}", Ink.CAUTION))
        more = f"; {others} wait for something else: n looks at them" if others else ""
        if done:
            lines.append((f"confirmed: {tasks[0].prompt}   {vehicles_words(done)}{more}", Ink.NORMAL))
        self.report = tuple(lines)
        self._show()

    def end_led(self, tasks: Sequence[TaskInfo]) -> None:
        """Stop motor tests of the selected vehicles at once, or ask whether their calibrations are to be cancelled."""
        mine = [task for task in tasks if task.vehicle in self._feed.selection.ids]
        turning = [task for task in mine if task.what.startswith(MOTOR_TEST)]
        led = tuple(sorted({task.vehicle for task in mine if task not in turning}))
        if turning:
            self._run(self._stop(turning))
        elif led:
            reason = "what it has measured so far is lost; some must be rebooted before they fly"
            self._ask("cancel the calibration", CancelCalibration(led), [reason], "cancel it")
        else:
            self.say("nothing is under way on the selected vehicles", Ink.CAUTION)

    async def _stop(self, tasks: Sequence[TaskInfo]) -> None:
        for task in tasks:
            reply = await self._feed.requests.send(CancelTask(task.number))
            self.say(reply.text, Ink.NORMAL if reply.ok else Ink.WARNING)

    # ---------------------------------------------------------------- undo, read

    def undo(self, section: SectionWord, field: FleetSetupField | None) -> None:
        """Take the last change of this section back."""
        selected = self._feed.selection.ids
        if section == "tuning" and field is not None:
            self._send(f"undo {field.row.param}", UndoGains(self.vehicles_of(field), field.row.param))
        elif section == "radio":
            reason = "the channels get the ends, directions and meanings that they had before"
            self._ask("take the transmitter's calibration back", UndoRadio(selected), [reason], "take it back")
        else:
            self._parameters.undo()

    def undo_all(self) -> None:
        """Ask whether all changes of gains are to be taken back."""
        reason = "every gain that was changed from a station gets its value before the first change"
        self._ask("take all gains back", UndoGains(self._feed.selection.ids), [reason], "take them back")

    def fetch(self, vehicles: tuple[int, ...], section: SectionWord | None) -> None:
        """Read the parameters of a section, or of all, from these vehicles."""
        if why := self._feed.requests.read_only or ("" if vehicles else "no vehicle was heard"):
            self.say(why, Ink.CAUTION)
            return
        self._send(f"read {section or 'all sections'}", ReadSetup(vehicles, section))

    # ---------------------------------------------------------------- asking and sending

    def _ask(self, what: str, request: VehicleRequest, reasons: Sequence[str], does: str) -> None:
        """Ask whether `request` is meant, and send it."""
        if not request.vehicles:
            self.say(f"{what}: {NONE_SELECTED}", Ink.CAUTION)
            return

        def answered(yes: bool | None) -> None:
            if yes:
                self._send(what, request)
            else:
                self.say("left as it is")

        title = f"{what}: {vehicles_words(request.vehicles)}"
        self._host.app.push_screen(SureDialog(title, reasons, does, self._glyphs, self._clock), answered)

    def _send(self, what: str, request: VehicleRequest) -> None:
        if not request.vehicles:
            self.say(f"{what}: {NONE_SELECTED}", Ink.CAUTION)
            return
        self.say(f"{what}: {vehicles_words(request.vehicles)} …")
        self._run(self._carry_out(what, request))

    async def _carry_out(self, what: str, request: VehicleRequest) -> None:
        outcomes = await carry_out(self._feed.requests, self._clock, request)
        doubtful = [each for each in outcomes if each.code is ReplyCode.NOT_CONFIRMED]
        self.report = (*_failed(each for each in outcomes if each not in doubtful), *_good(what, outcomes))
        self._show()
        if doubtful:
            vehicles = tuple(each.vehicle for each in doubtful)
            reasons = list(dict.fromkeys(clean(each.text.removesuffix(f": {MEANT}"), 300) for each in doubtful))
            meant = msgspec.structs.replace(request, vehicles=vehicles, sure=True)
            self._ask(what, meant, reasons, "do it all the same")
        elif isinstance(request, SetGain) and not request.beyond_range:
            self._ask_beyond(what, request, outcomes)

    def _ask_beyond(self, what: str, request: SetGain, outcomes: Sequence[TaskOutcome]) -> None:
        """Ask a second time where a vehicle's own range of a gain excludes the value."""
        refused = [each for each in outcomes if each.result is not None and each.result.out_of_range]
        if refused:
            vehicles = tuple(each.vehicle for each in refused)
            reasons = list(dict.fromkeys(clean(each.text, 300) for each in refused))
            meant = msgspec.structs.replace(request, vehicles=vehicles, beyond_range=True)
            self._ask(what, meant, reasons, "set it beyond its range")

    def _run(self, job: Coroutine[Any, Any, None]) -> None:
        self._host.run_worker(job, group="setup", exit_on_error=False)


def _failed(outcomes: Iterable[TaskOutcome]) -> list[Run]:
    failed = by_reason(outcomes)
    lines: list[Run] = [
        (f"{vehicles_words(vehicles)}: NOT DONE: {clean(text, 200)}", Ink.WARNING) for text, vehicles in failed.items()
    ]
    left_out = [vehicle for vehicles in list(failed.values())[MAX_LINES:] for vehicle in vehicles]
    if left_out:
        lines[MAX_LINES:] = [(f"NOT DONE either: {vehicles_words(left_out)}", Ink.WARNING)]
    return lines


def _good(what: str, outcomes: Sequence[TaskOutcome]) -> list[Run]:
    """Return a line for each remark of those that succeeded, with its vehicles."""
    remarks: dict[str, list[int]] = {}
    for each in outcomes:
        if each.ok:
            remarks.setdefault(clean(each.text, 200), []).append(each.vehicle)
    return [
        (f"{what}: done, {vehicles_words(vehicles)}" + (f": {text}" if text else ""), Ink.NORMAL)
        for text, vehicles in list(remarks.items())[:MAX_LINES]
    ]
