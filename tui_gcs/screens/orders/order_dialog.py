"""The dialog that asks for an order's values, and for a confirmation, before the order is sent."""

import asyncio
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import wrap

from textual import events

from tui_gcs.actions.order_forecast import OrderForecast, forecast_order
from tui_gcs.actions.orders import Grade, OrderError, OrderField, OrderInput, VehicleOrder, left_out_words, split
from tui_gcs.actions.places import PlaceReferences
from tui_gcs.core.base.clock import Clock, MonotonicClock
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import Freshness, Request, RunKind, VehicleRow
from tui_gcs.core.protocol.flight import Arm, TakeOff
from tui_gcs.core.protocol.preflight import open_by_hand
from tui_gcs.core.protocol.services import GetModes, ServiceReply
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.map_screen import present_round
from tui_gcs.screens.common.text_dialog import LINE_CELLS, TextDialog
from tui_gcs.screens.orders.vehicle_words import now_words, rows_of
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink

EXPIRES_S = 10.0
"""A question that is not answered in this time is void: the vehicles may have changed, or the operator has left."""
TYPING_EXPIRES_S = 60.0
"""The dialog closes after this time while values are typed; the question itself expires sooner."""
ARMING_S = 3.0
"""Between the last confirmation of what starts several vehicles, and sending it: Esc still stops it."""
# A console that was stopped (SIGSTOP, a suspended laptop) shows a state of before: it must not send when it wakes up.
LATE_S = 1.0
"""An order is not sent this long after its time."""
CHECK_S = 0.25
NO_KEY = "it was not answered in time"
TOO_LATE = "it was just sent"
"""Reasons why a question closes by itself, for the operator."""
FORECAST_PERIOD_S = 1.0
"""The forecast of a path is computed this often: for hundreds of vehicles it takes a tenth of a second."""
MAX_ROWS = 8
MAX_OPEN_CHECKS = 2
"""At most this many checks that would refuse a start are shown; all of them are on the list of `P`."""
MAX_PROBLEM_LINES = 3
MAX_TYPED = 60
MODE_LOOKS, MODE_GAP_S = 20, 0.5
"""Modes are requested this often, with this pause: a vehicle reports its list within seconds."""
MAX_KINDS = 3
"""There is room for the modes of this many kinds of vehicles."""


@dataclass(frozen=True)
class ConfirmedOrder:
    """The order that the operator confirmed."""

    order: VehicleOrder
    request: Request
    vehicles: tuple[int, ...]
    left_out: dict[int, str]


class OrderDialog(TextDialog["ConfirmedOrder | str"]):
    """Asks for the values of an order, then for a confirmation.

    The result is the confirmed order, or why nothing is sent.

    The dialog closes by itself on Esc, after ten seconds without a key, and when one of the vehicles is not in the
    state that it was in when the question was asked.
    """

    def __init__(
        self,
        order: VehicleOrder,
        feed: Feed,
        around: Callable[[], PlaceReferences],
        glyphs: GlyphSet,
        clock: Clock | None = None,
        *,
        doubtful: bool = False,
        values: str = "",
    ) -> None:
        """Ask about `order` for the selected vehicles; `doubtful`: see `split`.

        `values` are values of its fields that were typed already, with commas between them.
        """
        super().__init__(glyphs)
        self.order = order
        self._feed = feed
        self._around = around
        self._clock = clock or MonotonicClock()
        self.vehicles, self._left_out = split(order, feed.selection.ids, rows_of(feed), doubtful=doubtful)
        self._values = {field.name: field.initial for field in order.fields}
        self._untouched = set(self._values)
        """Fields that hold the proposed value: the first letter replaces it."""
        self._field = 0
        self._modes: dict[str, str] = {}
        """Names of the modes that can be typed, by kind of vehicle."""
        self._request: Request | None = None
        self._seen: object = None
        self._typed = ""
        self._problem = ""
        self._forecast, self._forecast_s = OrderForecast(), -math.inf
        self._sends_s: float | None = None
        self._deadline_s = 0.0
        self._extend_deadline()
        self._fill(values)
        if self._field == len(order.fields):
            self._field = max(0, self._field - 1)
            self._ask()
        count = len(self.vehicles)
        target = f"vehicle {ids(self.vehicles)}" if count == 1 else f"{count} vehicles: {ids(self.vehicles)}"
        self.title_text = f"{order.name}: {target}"

    @property
    def grade(self) -> Grade:
        """How the operator has to confirm the order."""
        return self.order.grade(len(self.vehicles))

    def on_mount(self) -> None:
        """Watch time and vehicles while the dialog is open."""
        super().on_mount()
        self.set_interval(CHECK_S, self.tick)
        if any(field.name == "mode" for field in self.order.fields):
            rows = rows_of(self._feed)
            job = read_modes(self._feed, [rows[v] for v in self.vehicles if v in rows], self._modes)
            self.run_worker(job, exit_on_error=False)  # it ends with this dialog

    def tick(self) -> None:
        """Cancel when time is up or a vehicle has changed; send when the last seconds are over."""
        now = self._clock.now()
        if why := self._changed():
            self._void(why)
        # Below the tiny screen the operator would not see that Esc still stops it.
        elif self._sends_s is not None and not self.is_active:
            self._void("the terminal became too small to see it")
        elif self._sends_s is not None and now >= self._sends_s + LATE_S:
            self._void("this console stood still meanwhile: look, and ask again")
        elif self._sends_s is not None and now >= self._sends_s and self._request is not None:
            self.lapse(self._confirmed(self._request), TOO_LATE)
        elif now >= self._deadline_s:
            self._void(NO_KEY)
        else:
            self.redraw()

    def on_key(self, event: events.Key) -> None:
        """Type values and answers. A question that is too old takes no answer: the console may have stood still."""
        event.stop()
        # A console that stood still gets all keys at once when it goes on: they may be answers to an older question.
        if self._clock.now() >= self._deadline_s and event.key != "escape":
            self._void(NO_KEY)
            return
        self._extend_deadline()
        self._problem = ""
        if event.key == "escape":
            self.finish("cancelled")
            return
        if self._sends_s is not None:
            return
        if self._request is None:
            self._type_value(event)
        else:
            self._type_answer(event)
        if self.is_attached and self.is_current:
            self.redraw()

    def _type_value(self, event: events.Key) -> None:
        name = self.order.fields[self._field].name
        if event.key == "enter":
            if self._field + 1 < len(self.order.fields):
                self._field += 1
            else:
                self._ask()
        elif event.key in ("tab", "down"):
            self._field = (self._field + 1) % len(self.order.fields)
        elif event.key in ("shift+tab", "up"):
            self._field = (self._field - 1) % len(self.order.fields)
        else:
            # A proposed value is replaced by the first letter, as if it were selected.
            proposed = name in self._untouched and event.is_printable
            self._values[name] = _typed("" if proposed else self._values[name], event)
            self._untouched.discard(name)

    def _fill(self, values: str) -> None:
        """Fill the first fields with what was typed before the dialog opened, as if Enter ended each of them."""
        typed = values.split(",", len(self.order.fields) - 1) if values else []
        for field, text in zip(self.order.fields, typed, strict=False):
            self._values[field.name] = text.strip()[:MAX_TYPED]
        self._field = len(typed)

    def _ask(self) -> None:
        """Build the request from the values, and ask for the confirmation."""
        try:
            self._request = self.order.request(OrderInput(self.vehicles, dict(self._values), self._around()))
        except OrderError as error:
            self._problem = str(error)
            return
        self._seen, self._forecast_s = self._state(), -math.inf
        self._extend_deadline()

    def _type_answer(self, event: events.Key) -> None:
        if self.grade is Grade.YES:
            # Not Enter, which is pressed by habit.
            if event.character in ("y", "Y"):
                self._send()
            elif event.key == "enter":
                self._problem = "press y to do it"
            return
        if event.key != "enter":
            self._typed = _typed(self._typed, event)
        elif self.grade is Grade.ENTER:
            self._send()
        elif self._typed.strip() == self._expected():
            self._sends_s = self._clock.now() + ARMING_S
        else:
            self._problem = f"type {self._expected()}, then Enter"

    def _expected(self) -> str:
        # The id is typed, so that the motors of another vehicle are not stopped by habit.
        return f"KILL {self.vehicles[0]}" if self.grade is Grade.KILL else str(len(self.vehicles))

    def _send(self) -> None:
        """Send, unless a vehicle has changed at the last moment."""
        if (why := self._changed()) or self._request is None:
            self._void(why or "nothing was asked")
        else:
            self.finish(self._confirmed(self._request))

    def _confirmed(self, request: Request) -> ConfirmedOrder:
        return ConfirmedOrder(self.order, request, self.vehicles, self._left_out)

    def _void(self, why: str) -> None:
        """Close without sending, and without a key."""
        self.lapse(why, why)

    def _extend_deadline(self) -> None:
        typing = self._request is None and bool(self.order.fields)
        self._deadline_s = self._clock.now() + (TYPING_EXPIRES_S if typing else EXPIRES_S)

    def _state(self) -> object:
        rows = rows_of(self._feed)
        # What the operator decides by: the question is void when any of it has changed.
        return tuple(
            (v, r.armed, r.phase, r.freshness, r.mode, r.problem) if (r := rows.get(v)) is not None else v
            for v in self.vehicles
        )

    def _changed(self) -> str:
        """Return why the question is void, "" if it is not; a stop is sent although vehicles have changed."""
        if self._feed.requests.read_only:
            return self._feed.requests.read_only
        if not self.vehicles:
            return "the order is for no vehicle any more"
        # A stop is never held back: a vehicle that is stopped needlessly does less harm than one that flies on.
        if self._request is None or self.order.is_stop:
            return ""
        if self._feed.station_lost:
            return "the station is silent"
        before, now = self._seen, self._state()
        if before == now or not isinstance(before, tuple) or not isinstance(now, tuple):
            return ""
        changed = [v for v, was, is_ in zip(self.vehicles, before, now, strict=True) if was != is_]
        return f"{vehicles_words(changed)} changed meanwhile: look, and ask again"

    def body(self) -> list[Line]:
        """Return the vehicles as they are now, what will happen, and what to type."""
        status = self._feed.status
        kind = status.kind if status is not None else RunKind.SIM
        what = {RunKind.SIM: "SIMULATED", RunKind.LIVE: "REAL"}.get(kind, str(kind))
        count = len(self.vehicles)
        ink = Ink.WARNING if self.grade is Grade.KILL else Ink.TEXT
        lines: list[Line] = [[(f"{count} {what} vehicle{'s' * (count != 1)}: {self.order.does}", ink)]]
        lines += [*self._forecast_lines(), []]
        rows = rows_of(self._feed)
        lines += [_row_line(v, rows.get(v)) for v in self.vehicles[:MAX_ROWS]]
        if count > MAX_ROWS:
            lines.append([(f"  and {count - MAX_ROWS} more: {ids(self.vehicles[MAX_ROWS:])}", Ink.TEXT)])
        doubts = {v: why for v in self.vehicles if v in rows and (why := self.order.doubt(rows[v]))}
        if doubts:
            lines.append([(f"! {left_out_words(doubts)}: perhaps nothing happens"[:LINE_CELLS], Ink.CAUTION)])
        for why in dict.fromkeys(self._left_out.values()):
            out = [v for v, reason in self._left_out.items() if reason == why]
            lines.append([(f"  left out: {ids(out)}  {why}"[:LINE_CELLS], Ink.CAUTION)])
        if status is not None and status.in_control not in ("", self._feed.requests.principal):
            lines.append([(f"  {status.in_control} has control: this takes it", Ink.CAUTION)])
        if self.order.fields:
            lines += [[], *self._field_lines()]
        problem: list[Line] = [[(line, Ink.CAUTION)] for line in wrap(self._problem, LINE_CELLS)[:MAX_PROBLEM_LINES]]
        return [*lines, [], *problem, self._key_line()]

    def _forecast_lines(self) -> list[Line]:
        """Return where the order leads as things are now, and the warnings about it."""
        scenario = self._feed.scenario
        if self._request is None or scenario is None:
            return []
        now = self._clock.now()
        if not 0.0 <= now - self._forecast_s < FORECAST_PERIOD_S:
            status, limits, round_ = self._feed.status, scenario.scenario.limits, present_round(self._feed)
            homes = status.homes if status is not None else {}
            self._forecast = forecast_order(self._request, rows_of(self._feed), homes, limits, round_)
            self._forecast_s = now
        forecast = self._forecast
        lines: list[Line] = [[(f"  {forecast.way}"[:LINE_CELLS], Ink.TEXT)]] if forecast.way else []
        warnings = [*forecast.warnings, *self._open_checks()]
        return [*lines, *([(f"! {text}"[:LINE_CELLS], Ink.CAUTION)] for text in warnings)]

    def _open_checks(self) -> list[str]:
        """Return the checks that would refuse a start of vehicles that are armed or lifted singly, the worst first."""
        if not isinstance(self._request, Arm | TakeOff) or self._feed.status is None:
            return []
        found = open_by_hand(self._feed.status.preflight, self.vehicles)
        more = f" (and {len(found) - MAX_OPEN_CHECKS} more: P)" if len(found) > MAX_OPEN_CHECKS else ""
        lines = [f"check {check.words()}" for check in found[:MAX_OPEN_CHECKS]]
        return [*lines[:-1], lines[-1][: LINE_CELLS - len(more) - 2] + more] if lines else []

    def _field_lines(self) -> list[Line]:
        lines: list[Line] = []
        typing = self._request is None
        for index, one in enumerate(self.order.fields):
            here = typing and index == self._field
            text = f"{self._values[one.name]}{'_' if here else ''}"
            lines.append(
                [(f"  {one.label:<8}", Ink.MUTED), (f"[{text:<12}] {one.unit} ", Ink.BOLD if here else Ink.TEXT)]
            )
            for text in self._help(one) if here else []:
                indent = " " * 10
                wrapped = wrap(text, LINE_CELLS - 10, initial_indent=indent, subsequent_indent=indent)
                lines += [[(line, Ink.MUTED)] for line in wrapped]
        return lines

    def _help(self, field: OrderField) -> list[str]:
        """Return what can be typed into a field: the order's own help, or the modes that the vehicles reported."""
        modes = [(kind, names) for kind, names in self._modes.items() if names] if field.name == "mode" else []
        if not modes:
            return [field.help] if field.help else []
        return [f"{kind}: {names}" if len(modes) > 1 else names for kind, names in modes]

    def _key_line(self) -> Line:
        now = self._clock.now()
        left_s = max(0, round(self._deadline_s - now))
        cancel = (f" Esc = cancel ({left_s} s) ", Ink.SELECTED)
        if self._sends_s is not None:
            return [
                (" Esc = STOP THIS ", Ink.SELECTED_WARNING),
                (f"   sent in {max(0.0, self._sends_s - now):.0f} s", Ink.BOLD),
            ]
        if self._request is None:
            last = self._field + 1 == len(self.order.fields)
            return [cancel, ("   Enter = " + ("go on" if last else "next"), Ink.BOLD)]
        ask = {
            Grade.ENTER: "Enter = do it",
            Grade.YES: "y = do it",
        }.get(self.grade, f"type {self._expected()} and Enter: [{self._typed}_]")
        return [cancel, (f"   {ask}", Ink.BOLD)]


def _row_line(vehicle: int, row: VehicleRow | None) -> Line:
    ink = Ink.CAUTION if row is None or row.freshness is not Freshness.OK else Ink.TEXT
    team = f"{row.team[:8]} " if row is not None else ""
    return [(f"  {vehicle:<3} ", Ink.BOLD), (f"{team:<9}", Ink.MUTED), (now_words(row), ink)]


def _typed(text: str, event: events.Key) -> str:
    if event.key == "backspace":
        return text[:-1]
    if event.key == "ctrl+u":
        return ""
    if event.character is not None and event.character.isprintable():
        return (text + event.character)[:MAX_TYPED]
    return text


def one_of_each(rows: Sequence[VehicleRow]) -> list[VehicleRow]:
    """Return the first vehicle of every kind: vehicles of one kind have the same modes."""
    kinds = {(row.autopilot, row.vehicle_type): row for row in reversed(rows)}
    return sorted(kinds.values(), key=lambda row: row.id)[:MAX_KINDS]


async def _ask_modes(feed: Feed, vehicle: int) -> tuple[str, bool]:
    """Return the names of a vehicle's modes, without those for experts, and whether the list is complete."""
    reply = await feed.requests.send(GetModes(vehicle))
    if not isinstance(reply, ServiceReply) or not reply.ok:
        return "", True
    names = [mode.name for mode in reply.modes if not mode.advanced]
    return ", ".join(names), reply.complete


async def read_modes(feed: Feed, rows: Sequence[VehicleRow], modes: dict[str, str]) -> None:
    """Fill `modes` by kind of vehicle, until every list is complete or time is up."""
    for vehicle in one_of_each(rows):
        kind = f"{vehicle.autopilot} {vehicle.vehicle_type}".strip()
        # A list that the vehicle sends comes within seconds; the one in the autopilot's table is there at once.
        for _ in range(MODE_LOOKS):
            modes[kind], over = await _ask_modes(feed, vehicle.id)
            if over:
                break
            await asyncio.sleep(MODE_GAP_S)
