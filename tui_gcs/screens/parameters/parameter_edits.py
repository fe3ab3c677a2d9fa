"""What the parameters screen does to vehicles and files: set, copy, take back, load, save."""

from collections.abc import Callable, Collection, Coroutine, Mapping, Sequence
from pathlib import Path
from typing import Any

from textual.screen import Screen

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.float32 import typed_number
from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.bounded import data_of
from tui_gcs.core.formats.content import FormatError
from tui_gcs.core.formats.file_types import read_file
from tui_gcs.core.formats.parameter_files import parameter_file, values_to_set
from tui_gcs.core.formats.params import IDENTITIES, NOT_TO_WRITE
from tui_gcs.core.protocol.alarms import id_ranges
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.fleet_parameters import FleetParameter
from tui_gcs.feed.parameter_transfers import ChangeOutcome, ParameterChange, ParameterTransfers
from tui_gcs.feed.task_requests import by_reason
from tui_gcs.screens.common.screen_edits import ScreenEdits
from tui_gcs.screens.common.text_dialog import LINE_CELLS
from tui_gcs.screens.orders.vehicle_words import rows_of
from tui_gcs.screens.parameters.change_dialog import ChangeDialog, values_for
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, wrapped

MAX_FILE_BYTES = 1 << 20
MAX_NAME_CELLS = 60
NONE_SELECTED = "no vehicle is selected: a number or s selects which are changed"


class ParameterEdits(ScreenEdits):
    """Builds changes, asks whether they are meant, sends them, and keeps the report of the last one."""

    def __init__(
        self,
        host: Screen[Any],
        feed: Feed,
        clock: Clock,
        transfers: ParameterTransfers,
        glyphs: GlyphSet,
        show: Callable[[], None],
    ) -> None:
        """Work for the screen `host`; `show` is called whenever `report` has changed."""
        super().__init__(host, feed, clock, glyphs, show)
        self._transfers = transfers

    def why_not(self) -> str:
        """Return why nothing can be changed now; "" if it can."""
        if self._feed.requests.read_only:
            return self._feed.requests.read_only
        return "" if self._feed.selection.ids else NONE_SELECTED

    def set(self, parameter: FleetParameter, typed: str) -> None:
        """Ask whether the typed value is to be set on the selected vehicles."""
        value = typed_number(typed)
        if value is None:
            self.say(f"{clean(typed, 40)!r} is no number: nothing was set", Ink.CAUTION)
            return
        self._ask(values_for(self._feed.selection.ids, {parameter.name: value}, self._transfers.parameters))

    def copy(self, listed: Sequence[FleetParameter]) -> None:
        """Ask whether the values of the vehicle looked at are to be set on the other selected vehicles."""
        lead = self._feed.selection.lead
        others = [vehicle for vehicle in self._feed.selection.ids if vehicle != lead]
        if lead is None or not others:
            self.say("select several vehicles: the values of the one looked at go to the others", Ink.CAUTION)
            return
        held = self._transfers.parameters.of(lead)
        names = [each.name for each in listed if each.name in held]
        # An identity that is copied makes two vehicles answer to one number.
        values = {name: held[name].value for name in names if name not in IDENTITIES and name not in NOT_TO_WRITE}
        if not values:
            self.say("nothing that may be copied is listed: identities and counters stay", Ink.CAUTION)
            return
        self._ask(values_for(others, values, self._transfers.parameters), [f"from vehicle {lead}"])

    def undo(self) -> None:
        """Ask whether the last change is to be taken back."""
        change = self._transfers.undo
        if change is None:
            self.say("nothing was changed from here")
        else:
            self._push(change, [], lambda armed: self._transfers.take_back(in_flight=armed))

    def fetch(self, vehicles: Sequence[int]) -> None:
        """Read all parameters of these vehicles from them."""
        if self._feed.requests.read_only:
            self.say(self._feed.requests.read_only, Ink.CAUTION)
            return
        self.say(f"reading the parameters of {_vehicles(vehicles)}")
        self._run(self._fetch(tuple(vehicles)))

    async def _fetch(self, vehicles: tuple[int, ...]) -> None:
        ended = await self._transfers.fetch(vehicles)
        lines: list[Run] = [
            (f"{_vehicles(whose)}: NOT READ: {clean(text, 200)}", Ink.WARNING)
            for text, whose in by_reason(ended).items()
        ]
        read = [one.vehicle for one in ended if one.ok]
        self.report = (*lines, *([(f"read from {_vehicles(read)}", Ink.NORMAL)] if read else []))
        self._show()

    def load(self, path: Path) -> None:
        """Read a parameter file, and ask whether what differs is to be set on the selected vehicles."""
        name = clean(path.name, MAX_NAME_CELLS)
        try:
            values, left_out = values_to_set(read_file(data_of(path, MAX_FILE_BYTES), path=path))
        except FormatError as error:
            self.say(f"{name}: {error}", Ink.WARNING)
            return
        known = self._transfers.parameters
        incomplete = [v for v in self._feed.selection.ids if not known.is_complete(v)]
        if incomplete:
            self.say(
                f"R first: not all parameters of {_vehicles(incomplete)} are known, so nothing is compared", Ink.CAUTION
            )
            return
        missing = [
            f"vehicle {vehicle} has no {len(absent)} of {len(values)} names: {', '.join(absent[:3])} …"
            for vehicle in self._feed.selection.ids
            if (absent := [each for each in values if each not in known.of(vehicle)])
        ]
        self._ask(values_for(self._feed.selection.ids, values, known), [*missing, *left_out], name)

    def write(self, path: Path) -> None:
        """Write the parameters of the vehicle looked at to a new file; its ending is the format."""
        lead = self._feed.selection.lead
        known = self._transfers.parameters
        if lead is None or not known.is_complete(lead):
            self.say("R first: not all parameters of the vehicle looked at are known", Ink.CAUTION)
            return
        row = rows_of(self._feed).get(lead)
        rows = known.of(lead).values()
        try:
            # Exclusive: no file is overwritten, not even one that appeared a moment ago.
            with path.open("xb") as file:
                file.write(parameter_file(path.name, lead, row.autopilot if row is not None else "", rows))
        except FileExistsError:
            self.say(f"{path} is there already: choose another name", Ink.CAUTION)
        except (OSError, FormatError) as error:
            self.say(f"{path}: NOT WRITTEN: {getattr(error, 'strerror', None) or error}", Ink.WARNING)
        else:
            self.say(f"{len(rows)} parameters of vehicle {lead} written to {path}", Ink.NORMAL)

    def _ask(self, change: ParameterChange, notes: Collection[str] = (), source: str = "") -> None:
        if not change.values:
            self.say(f"{source + ': ' if source else ''}they hold it already: nothing to set", Ink.NORMAL)
            return
        self._push(change, notes, lambda armed: self._transfers.change(change, in_flight=armed))

    def _ask_beyond_range(self, change: ParameterChange, outcomes: Sequence[ChangeOutcome]) -> None:
        """Ask whether the values that vehicles exclude by their descriptions are to be set all the same."""
        refused = {one.vehicle: one.out_of_range for one in outcomes if one.out_of_range}
        values = {v: {name: change.values[v][name] for name in names} for v, names in refused.items()}
        beyond = ParameterChange(f"BEYOND THE RANGE: {change.what}", values)
        reasons = dict.fromkeys(clean(one.error, 200) for one in outcomes if one.out_of_range)
        notes = [line for reason in reasons for line in wrapped(reason, LINE_CELLS)]
        self._push(beyond, notes, lambda armed: self._transfers.change(beyond, in_flight=armed, beyond_range=True))

    def _push(
        self,
        change: ParameterChange,
        notes: Collection[str],
        send: Callable[[bool], Coroutine[Any, Any, tuple[ChangeOutcome, ...]]],
    ) -> None:
        armed = self._armed(change.vehicles)
        dialog = ChangeDialog(change, self._transfers.parameters, armed, notes, self._glyphs, self._clock)

        def answered(yes: bool | None) -> None:
            if not yes:
                self.say("nothing was set")
            elif self._armed(change.vehicles) != armed:
                self.say("a vehicle was armed or disarmed meanwhile: nothing was set, look and ask again", Ink.CAUTION)
            else:
                self.say(f"setting {change.what} on {_vehicles(change.vehicles)}")
                self._run(self._send(change, send(bool(armed))))

        self._host.app.push_screen(dialog, answered)

    async def _send(self, change: ParameterChange, sending: Coroutine[Any, Any, tuple[ChangeOutcome, ...]]) -> None:
        outcomes = await sending
        failed = [one for one in outcomes if one.error]
        lines: list[Run] = [
            (f"vehicle {one.vehicle}: {one.done} of {one.total} set: {clean(one.error, 200)}", Ink.WARNING)
            for one in failed
        ]
        good = [one.vehicle for one in outcomes if not one.error]
        done: list[Run] = [(f"{change.what}: set and confirmed on {_vehicles(good)}; u takes it back", Ink.NORMAL)]
        remarks: list[Run] = [(text, Ink.MUTED) for text in dict.fromkeys(one.remark for one in outcomes) if text]
        self.report = (*lines, *(done if good else []), *remarks)
        self._feed.note(f"{change.what}: {len(good)} of {len(outcomes)} vehicles set", 4 if failed else 6)
        self._show()
        if any(one.out_of_range for one in failed):
            self._ask_beyond_range(change, failed)

    def _armed(self, vehicles: Collection[int]) -> tuple[int, ...]:
        rows: Mapping[int, Any] = rows_of(self._feed)
        return tuple(vehicle for vehicle in vehicles if vehicle in rows and rows[vehicle].armed)

    def _run(self, job: Coroutine[Any, Any, None]) -> None:
        self._host.run_worker(job, group="parameters", exit_on_error=False)


def _vehicles(vehicles: Collection[int]) -> str:
    return f"vehicle{'s' * (len(vehicles) > 1)} {id_ranges(vehicles)}"
