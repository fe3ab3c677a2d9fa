"""The question before plans are sent to vehicles: what, to which; for several vehicles their number is typed."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from textwrap import wrap

from textual import events

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.missions.autopilot_limits import differences
from tui_gcs.core.missions.draft import VehicleDraft
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol.services import OnBoardRow
from tui_gcs.core.requests.plan_rows import plan_of
from tui_gcs.screens.common.text_dialog import LINE_CELLS, TextDialog
from tui_gcs.screens.orders.order_dialog import CHECK_S, EXPIRES_S, NO_KEY
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink

MAX_LINES = 8
FULL_TEXT_COUNT = 3
"""Up to this many vehicles have their warnings in full, more have a line each: the question must fit into 24 rows."""
WAIT = "wait: the station compares it with what flies and what others hold"
MEET = "ways meet: m first, if you want it all the same"
CHANGED = "a vehicle or a plan changed meanwhile: look, and ask again"


@dataclass(frozen=True)
class UploadComparison:
    """What the station says of a group of vehicles that would get the planned missions."""

    meets: Mapping[int, str] = field(default_factory=dict)
    """By vehicle: where its mission comes too close to what another one flies or holds."""
    not_compared: str = ""


class UploadDialog(TextDialog[tuple[int, ...]]):
    """The result is the vehicles to send to; empty if nothing is sent.

    The station compares the missions with what flies and with what other vehicles hold. Nothing is sent before it has
    answered, and where ways meet only after `m`.

    The dialog cancels by itself after ten seconds without a key, and when what it asks about has changed.
    """

    title_text = "upload plans?"

    def __init__(
        self,
        groups: Sequence[tuple[str, tuple[int, ...]]],
        plans: Mapping[int, VehicleDraft],
        warnings: Mapping[int, str],
        pairs: Collection[tuple[int, int]],
        armed: Sequence[int],
        autopilots: Mapping[int, str],
        state: Callable[[], object],
        compare: Callable[[tuple[int, ...]], None],
        glyphs: GlyphSet,
        clock: Clock,
    ) -> None:
        """`groups` are the choices of vehicles, each with its name; `warnings` are about the plans of a vehicle.

        Vehicles of `pairs` meet if they begin together. `compare` asks the station about a group; `show_comparison`
        takes its answer. `autopilots` are named as in fleet frames: a stored plan is compared as that autopilot keeps
        it. The question is void when the value of `state` changes.
        """
        super().__init__(glyphs)
        self._state, self._seen = state, state()
        self._clock = clock
        self._deadline_s = clock.now() + EXPIRES_S
        self._groups = groups
        self._plans = plans
        self._warnings = warnings
        self._pairs = pairs
        self._compare = compare
        self._compared: dict[tuple[int, ...], UploadComparison] = {}
        self._may_meet = False
        self._armed = armed
        self._autopilots = autopilots
        self._instead: dict[int, str] = {}
        self._at = 0
        self._typed = ""
        self._problem = ""

    def on_mount(self) -> None:
        """Watch time, vehicles and plans while the dialog is open."""
        super().on_mount()
        self.set_interval(CHECK_S, self.tick)
        self._compare(self._vehicles)

    def tick(self) -> None:
        """Cancel when time is up or what is shown has changed."""
        if why := self._void():
            self.lapse((), why)
        else:
            self.redraw()

    def _void(self) -> str:
        if self._state() != self._seen:
            return CHANGED
        return NO_KEY if self._clock.now() >= self._deadline_s else ""

    def show_held(self, rows: Sequence[OnBoardRow]) -> None:
        """Show which stored plans will be replaced, as far as they are known."""
        self._instead = {row.vehicle: self._other(row, self._plans[row.vehicle]) for row in rows}
        self.redraw()

    def show_comparison(self, vehicles: tuple[int, ...], comparison: UploadComparison) -> None:
        """Show where the missions of a group meet what flies or what others hold."""
        self._compared[vehicles] = comparison
        self._problem = "" if self._problem == WAIT else self._problem
        self.redraw()

    @property
    def _meeting(self) -> dict[int, str]:
        """Vehicles of the chosen group whose missions meet others."""
        chosen = self._vehicles
        pairs = [pair for pair in self._pairs if pair[0] in chosen and pair[1] in chosen]
        both_ways = [*pairs, *((second, first) for first, second in pairs)]
        meeting = {one: f"MEETS {other} in flight if both begin together" for one, other in both_ways}
        return meeting | dict(self._compared.get(chosen, UploadComparison()).meets)

    @property
    def _why_not_yet(self) -> str:
        """Why the answer that sends is not taken yet."""
        if self._vehicles not in self._compared:
            return WAIT
        return MEET if self._meeting and not self._may_meet else ""

    @property
    def _vehicles(self) -> tuple[int, ...]:
        return self._groups[self._at][1]

    def on_key(self, event: events.Key) -> None:
        """Choose vehicles by arrows, send by `y` or their number, leave by Esc.

        A question that is too old takes no answer.
        """
        event.stop()
        # A question that is void takes no answer: plans or vehicles are not what the operator saw.
        if event.key != "escape" and (why := self._void()):
            self.lapse((), why)
            return
        self._deadline_s = self._clock.now() + EXPIRES_S
        self._problem = ""
        if event.key == "escape":
            self.finish(())
        elif event.key in ("left", "right", "up", "down", "tab"):
            self._at = (self._at + (-1 if event.key in ("left", "up") else 1)) % len(self._groups)
            self._typed, self._may_meet = "", False
            if self._vehicles not in self._compared:
                self._compare(self._vehicles)
            self.redraw()
        elif event.key == "m" and self._meeting:
            self._may_meet = True
            self.redraw()
        elif len(self._vehicles) == 1:
            self._one(event.key)
        else:
            self._several(event)

    def _one(self, key: str) -> None:
        if key == "y":
            self._send()
        elif key == "enter":
            self._problem = "press y: it is sent"
            self.redraw()

    def _several(self, event: events.Key) -> None:
        if event.key == "enter":
            if self._typed == str(len(self._vehicles)):
                self._send()
                return
            self._problem = f"type {len(self._vehicles)}, the number of vehicles, then Enter"
        elif event.key == "backspace":
            self._typed = self._typed[:-1]
        elif event.character is not None and event.character.isdecimal():
            # Only the last digits count, so a wrong one can be typed over.
            self._typed = (self._typed + event.character)[-4:]
        self.redraw()

    def _send(self) -> None:
        self._problem = self._why_not_yet
        if self._problem:
            self.redraw()
        else:
            self.finish(self._vehicles)

    def body(self) -> list[Line]:
        """Return the vehicles, their plans and warnings, and the keys."""
        vehicles = self._vehicles
        lines: list[Line] = [[("to ", Ink.TEXT), (f"{self._groups[self._at][0]}: {ids(vehicles)}", Ink.BOLD)], []]
        meeting = self._meeting
        few = len(vehicles) <= FULL_TEXT_COUNT
        for vehicle in vehicles[:MAX_LINES]:
            warning = meeting.get(vehicle, "") or self._warnings.get(vehicle, "")
            lines.append([(f"  {vehicle:>3}  {_words(self._plans[vehicle])}", Ink.TEXT)])
            if instead := self._instead.get(vehicle, ""):
                lines += _indented(f"instead of {instead} on board", few)
            if warning:
                lines += _indented(warning, few)
        if len(vehicles) > MAX_LINES:
            lines.append([(f"  and {len(vehicles) - MAX_LINES} more", Ink.TEXT)])
        flying = [vehicle for vehicle in vehicles if vehicle in self._armed]
        if flying:
            lines.append([(f"  ARMED: {ids(flying)}; one that flies its mission refuses", Ink.CAUTION)])
        if self._vehicles not in self._compared:
            lines.append([("  being compared with what flies and what others hold", Ink.MUTED)])
        elif remark := self._compared[vehicles].not_compared:
            lines += [[(f"  {part}", Ink.CAUTION)] for part in wrap(remark, LINE_CELLS - 2, max_lines=2)]
        lines += [[], [("fence first; each part is read back and compared", Ink.MUTED)]]
        lines += [[("what is not planned here stays on board as it is", Ink.MUTED)]]
        lines += [[(self._problem, Ink.CAUTION)]] if self._problem else []
        return [*lines, self._keys()]

    def _other(self, row: OnBoardRow, plan: VehicleDraft) -> str:
        """Describe the stored plans that differ and will be replaced."""
        held = {PlanKind.FENCE: row.fence, PlanKind.RALLY: row.rally, PlanKind.MISSION: row.mission}
        autopilot = self._autopilots.get(row.vehicle, "")
        # Compared as the autopilot keeps them: it rounds positions and drops fields that it does not use.
        other = {
            kind: rows
            for kind, rows in held.items()
            if rows and plan.items(kind) and differences(plan.plan(kind), plan_of(kind, rows), autopilot)
        }
        return ", ".join(f"{kind.word} of {len(rows)}" for kind, rows in other.items())

    def _keys(self) -> Line:
        left_s = max(0, round(self._deadline_s - self._clock.now()))
        keys: list[tuple[str, Ink]] = [(f" Esc = cancel ({left_s} s) ", Ink.SELECTED), ("   ", Ink.TEXT)]
        if self._meeting and not self._may_meet:
            keys.append(("m = though ways meet", Ink.BOLD))
        elif len(self._vehicles) == 1:
            keys.append(("y = send", Ink.BOLD))
        else:
            keys.append((f"{len(self._vehicles)} and Enter = send: [{self._typed:_<2}]", Ink.BOLD))
        return [*keys, ("   arrows: others", Ink.MUTED)] if len(self._groups) > 1 else keys


def _indented(text: str, in_full: bool) -> list[Line]:
    """Return a text below its vehicle, cut if there are many vehicles."""
    parts = wrap(text, LINE_CELLS - 7, max_lines=3 if in_full else 1, placeholder=" …")
    return [[(f"       {part}", Ink.CAUTION)] for part in parts]


def _words(plan: VehicleDraft) -> str:
    parts = [(PlanKind.FENCE, "fence of {} points"), (PlanKind.RALLY, "{} rally"), (PlanKind.MISSION, "mission of {}")]
    return ", ".join(word.format(len(plan.items(kind))) for kind, word in parts if plan.items(kind))
