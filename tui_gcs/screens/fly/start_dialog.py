"""The dialog that asks before a start."""

import math
from collections.abc import Callable
from textwrap import wrap

from textual import events

from tui_gcs.core.base.clock import Clock, MonotonicClock
from tui_gcs.core.protocol.common import Request, RunKind, Start
from tui_gcs.core.protocol.preflight import CHECKLIST, STOPS, Check, CheckState, TickItem, names_of, refusing
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.text_dialog import LINE_CELLS, REACTION_S, TextDialog
from tui_gcs.screens.fly.start_plan import StartPlan, fingerprint
from tui_gcs.screens.orders.order_dialog import ARMING_S, LATE_S, NO_KEY, TOO_LATE
from tui_gcs.screens.preflight.preflight_screen import Operator, is_open_item, typed_into
from tui_gcs.widgets.basics.check_lines import check_line, count_line, loud
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink

MAX_REASONS = 5
MAX_CHECKS = 6
SIGN_OFF = "sign-off"
# A confirmation is for what is on the screen: after 10 s it may not be true any more (docs/threats.md D.1).
CANCEL_AFTER_S = 10.0
CHECK_S = 0.5
CHANGED = "fleet, links or round changed meanwhile: look, and ask again"
NO_VEHICLE = "no vehicle of these teams is heard and ready yet"
UNSEEN = "the last seconds were not shown: look, and ask again"


class StartDialog(TextDialog[Start | None]):
    """Lists the vehicles that will fly.

    SIM: Enter starts. LIVE: the count is typed, Enter pressed, and three seconds pass.

    In LIVE, checks that refuse the start are overridden by typing their names. After an override, or if the list of
    checks is not signed, the operator types a name.

    The dialog cancels by itself on Esc, after ten seconds without a key, and when fleet, links or round change.
    """

    def __init__(
        self,
        plan: StartPlan,
        kind: RunKind,
        scenario: Scenario,
        feed: Feed,
        glyphs: GlyphSet,
        clock: Clock | None = None,
        operator: Operator | None = None,
        *,
        ask: Callable[[Request, str], None] = lambda request, title: None,
        unapplied: int = 0,
    ) -> None:
        """Ask about `plan`; `operator` is the name that was typed at this console before.

        `ask` sends a request to the station and reports why it was not done.

        `unapplied` is the number of changes on the plan screen that are not flown: there they look as if they were.
        """
        super().__init__(glyphs)
        self._unapplied = unapplied
        self.title_text = f"start {plan.round_name}?"
        self._plan = plan
        self._kind = kind
        self._loss, self._battery = scenario.link_loss, scenario.battery
        self._feed = feed
        self._clock = clock or MonotonicClock()
        self._seen = fingerprint(feed)
        self._deadline_s = self._clock.now() + CANCEL_AFTER_S
        self._typed = ""
        self._operator = operator or Operator()
        self._ask = ask
        self._item, self._item_s = "", -math.inf
        """The item of the checklist that Tab ticks, and since when it is the next one."""
        self._naming = ""
        """The item that is ticked as soon as the operator's name is typed; "": no name is being typed for one."""
        self._overrides: tuple[str, ...] = ()
        self._signed = False
        """The operator has typed a name."""
        self._problem = ""
        self._starts_s: float | None = None
        """LIVE: when the start is sent, unless the operator presses Esc."""

    def on_mount(self) -> None:
        """Watch time and fleet while the dialog is open."""
        super().on_mount()
        self.set_interval(CHECK_S, self.tick)

    def tick(self) -> None:
        """Cancel when time is up or what is shown has changed; start when the last seconds are over.

        A console that stood still in these seconds, or did not show them, starts nothing.
        """
        now, starts_s = self._clock.now(), self._starts_s
        # A console that was stopped, or covered by the tiny screen, did not show that Esc still stops the start.
        unseen = starts_s is not None and (not self.is_active or now >= starts_s + LATE_S)
        if fingerprint(self._feed) != self._seen:
            self.lapse(None, CHANGED)
        elif unseen:
            self.lapse(None, UNSEEN)
        elif starts_s is not None and now >= starts_s:
            self.lapse(self._request(), TOO_LATE)
        elif now >= self._deadline_s:
            self.lapse(None, NO_KEY)
        else:
            self.redraw()

    def on_key(self, event: events.Key) -> None:
        """Confirm by Enter, in LIVE after typing; leave by Esc. A question that is too old takes no answer."""
        event.stop()
        # A console that stood still gets all keys at once when it goes on: they may be answers to an older question.
        if self._clock.now() >= self._deadline_s:
            self.lapse(None, NO_KEY)
            return
        self._deadline_s = self._clock.now() + CANCEL_AFTER_S
        if event.key == "escape":
            self.finish(None)
            return
        if self._starts_s is not None:
            return
        if event.key == "tab":
            self._tick_item()
            return
        if event.key == "enter":
            self._confirm()
            return
        if self._naming or (self._kind is RunKind.LIVE and (self._refusing() or self._needs_name())):
            self._typed = typed_into(self._typed, event)
        elif self._kind is RunKind.LIVE and event.character is not None and event.character.isdigit():
            self._typed = (self._typed + event.character)[-4:]
        elif event.key == "backspace":
            self._typed = self._typed[:-1]
        self._problem = ""
        self.redraw()

    def _confirm(self) -> None:
        count = len(self._plan.vehicles)
        if self._naming:
            self._name_for_tick()
            return
        if count == 0:
            return  # the last line says why
        if self._kind is RunKind.LIVE and self._refusing():
            self._override()
        elif self._kind is RunKind.LIVE and self._needs_name():
            self._sign()
        elif self._kind is RunKind.LIVE and self._typed != str(count):
            self._problem = f"type {count}, the number of vehicles, then Enter"
        # Looked at once more at the moment of the answer: a status may have come since the last tick.
        elif fingerprint(self._feed) != self._seen:
            self.lapse(None, CHANGED)
            return
        elif self._kind is RunKind.LIVE:
            # LIVE: for these seconds the operator sees what starts, and can stop it.
            self._starts_s = self._clock.now() + ARMING_S
        else:
            self.finish(self._request())
            return
        self.redraw()

    def _next_item(self) -> Check | None:
        """Return the first item of the checklist that is not ticked."""
        item = next((check for check in self._checks() if is_open_item(check)), None)
        if item is not None and item.text != self._item:
            self._item, self._item_s = item.text, self._clock.now() if self._item else -math.inf
        return item

    def _tick_item(self) -> None:
        """Tick the item that is shown; one that has just come to be shown takes no key yet."""
        item = self._next_item()
        if item is None or CHECKLIST in self._overrides or self._feed.requests.read_only:
            return
        if self._clock.now() - self._item_s < REACTION_S:
            self._problem = "this item had just changed: look at it, then Tab again"
        elif self._operator.name:
            self._ask(TickItem(item.text, self._operator.name), "tick")
        else:
            self._naming, self._typed = item.text, ""
        self.redraw()

    def _name_for_tick(self) -> None:
        """Take the typed name, and tick the item for which it was asked."""
        if name := self._typed.strip():
            self._ask(TickItem(self._naming, name), "tick")
            self._operator.name, self._naming, self._typed = name, "", ""
        else:
            self._problem = "type your name: it is journalled"
        self.redraw()

    def _request(self) -> Start:
        operator = self._operator.name if self._signed else ""
        return Start(vehicles=self._plan.vehicles, overrides=self._overrides, operator=operator)

    def _checks(self) -> tuple[Check, ...]:
        return self._feed.status.preflight if self._feed.status is not None else ()

    def _open(self) -> tuple[Check, ...]:
        """Return the checks that refuse the start, the missing signature included."""
        return tuple(c for c in refusing(self._checks(), self._plan.vehicles) if c.name not in self._overrides)

    def _refusing(self) -> tuple[Check, ...]:
        """Return the checks that refuse the start until they are put right or overridden by name."""
        return tuple(check for check in self._open() if check.name != SIGN_OFF)

    def _needs_name(self) -> bool:
        return not self._signed and bool(self._overrides or self._open())

    def _override(self) -> None:
        name, self._typed = self._typed.strip(), ""
        if name in names_of(self._refusing()):
            self._overrides += (name,)
        else:
            self._problem = "type the name of one of these checks to override it, or Esc"

    def _sign(self) -> None:
        name = self._typed.strip()
        if name:
            self._operator.name, self._signed, self._typed = name, True, ""
        else:
            self._problem = "type your name: it is journalled"

    def body(self) -> list[Line]:
        """Return the teams, the open checks, what happens on loss, and the keys."""
        count = len(self._plan.vehicles)
        what = {RunKind.SIM: "SIMULATED", RunKind.LIVE: "REAL"}.get(self._kind, str(self._kind))
        lines: list[Line] = [
            [
                (f"{what} vehicles arm, take off and fly: ", Ink.TEXT),
                (f"{count}  ({ids(self._plan.vehicles)})" if count else "none", Ink.BOLD),
            ],
            [],
        ]
        for team in self._plan.teams:
            known = [vehicle for vehicle in team.missing if vehicle]
            absent = f"   not heard: {ids(known) if known else len(team.missing)}" if team.missing else ""
            ink = Ink.ATTACK if team.role == "attack" else Ink.DEFEND
            lines.append(
                [
                    (f"  {team.name[:12]:<12} ", Ink.BOLD),
                    (f"{len(team.vehicles)}: {ids(team.vehicles) or 'none':<10} ", Ink.TEXT),
                    (f"{team.role.upper()} {team.zone[:16]}", ink),
                    (f"   {team.planner}", Ink.MUTED),
                    (absent, Ink.CAUTION),
                ]
            )
        if self._unapplied:
            text = (
                f"  ! {self._unapplied} change{'s' * (self._unapplied > 1)} on the plan screen NOT applied: not flown"
            )
            lines.append([(text, Ink.CAUTION)])
        lines += self._file_lines()
        lines += self._left_out_lines()
        lines += self._check_lines()
        lines += [[], *([] if self._refusing() else [*self._loss_lines(), []]), self._key_line()]
        return [*lines, [(self._problem, Ink.CAUTION)]] if self._problem else lines

    def _file_lines(self) -> list[Line]:
        """Return the planners that come from files, with the file as it was when the station loaded it."""
        files = self._feed.status.planner_files if self._feed.status is not None else {}
        used = {team.planner for team in self._plan.teams}
        return [
            [(line, Ink.CAUTION)]
            for name, file in sorted(files.items())
            if name in used
            for line in wrap(f"{name} is {file}", LINE_CELLS, initial_indent="  ", subsequent_indent="    ")
        ]

    def _check_lines(self) -> list[Line]:
        """Count the checks by state, and list those that refuse the start, the worst first.

        Where none refuses it, the worst of the others is named: a bare "1 warn" would have to be looked up.
        """
        checks, refusing_ = self._checks(), self._refusing()
        if not checks:
            return []
        others = [check for check in refusing_ if check.name != CHECKLIST]
        # What was overridden or signed in this dialog refuses nothing any more.
        overridden = [check for check in checks if check.state in STOPS and check.name in self._overrides]
        signed = [check for check in checks if check.state in STOPS and check.name == SIGN_OFF and self._signed]
        remaining = [check for check in checks if check not in overridden and check not in signed]
        listed = others[:MAX_CHECKS] or [check for check in loud(remaining) if check.name != CHECKLIST][:1]
        count = f", {len(overridden)} overridden" if overridden else ""
        count += f", signed by {self._operator.name}" if signed else ""
        lines = [
            [],
            count_line(remaining, f"{count}   (Esc, P: all)"),
            *(check_line(check, LINE_CELLS, "  ") for check in listed),
        ]
        if len(others) > MAX_CHECKS:
            names = ", ".join(names_of(others[MAX_CHECKS:]))
            lines += [[(line, Ink.WARNING)] for line in wrap(f"and {names}", LINE_CELLS - 2, initial_indent="  ")]
        lines += self._item_lines()
        if self._overrides:
            operator = f" by {self._operator.name}" if self._signed else ""
            text = f"OVERRIDDEN{operator} for this start: {', '.join(self._overrides)}"
            lines += [[(line, Ink.CAUTION)] for line in wrap(text, LINE_CELLS, subsequent_indent="  ")]
        return lines

    def _item_lines(self) -> list[Line]:
        """Count the items of the checklist, and show the next open one whole: Tab ticks it."""
        items = [check for check in self._checks() if check.name == CHECKLIST]
        item = self._next_item()
        if not items or CHECKLIST in self._overrides:
            return []
        ticked = sum(check.state is CheckState.TICKED for check in items)
        if item is None:
            return [[(f"  checklist: all {ticked} items ticked", Ink.MUTED)]]
        ink = Ink.WARNING if item.state is CheckState.FAIL else Ink.CAUTION
        text = f"{self.glyphs.selected} {item.text}"
        return [
            [(f"  checklist {ticked} of {len(items)} ticked; Tab = this is done:", ink)],
            *([(line, Ink.BOLD)] for line in wrap(text, LINE_CELLS - 2, initial_indent="  ", subsequent_indent="    ")),
        ]

    def _left_out_lines(self) -> list[Line]:
        """List the vehicles that are present but not ready, with the reason."""
        left_out = [item for team in self._plan.teams for item in team.not_ready]
        lines: list[Line] = [
            [(f"  left out: {vehicle}  {why}", Ink.CAUTION)] for vehicle, why in left_out[:MAX_REASONS]
        ]
        if len(left_out) > MAX_REASONS:
            lines.append([(f"  and {len(left_out) - MAX_REASONS} more", Ink.CAUTION)])
        return lines

    def _loss_lines(self) -> list[Line]:
        resume = "goes on by itself when it is back" if self._loss.resume else "until you resume"
        return [
            [(f"its battery is low     {self._battery.words}", Ink.MUTED)],
            [(f"planner late or dead   its vehicles: {self._loss.planner}", Ink.MUTED)],
            [(f"a vehicle is lost      the others of its team: {self._loss.vehicle}", Ink.MUTED)],
            [(f"the station is gone    {resume}:", Ink.MUTED)],
            *(
                [(line, Ink.MUTED)]
                for does, vehicles in self._if_silent()
                for line in wrap(f"{ids(vehicles)}  {does}", LINE_CELLS, initial_indent="  ", subsequent_indent="    ")
            ),
        ]

    def _if_silent(self) -> list[tuple[str, list[int]]]:
        """Group the vehicles by what they do, by their own settings, when the link to the station is lost."""
        by_vehicle = self._feed.status.if_silent if self._feed.status is not None else {}
        groups: dict[str, list[int]] = {}
        for vehicle in self._plan.vehicles:
            groups.setdefault(by_vehicle.get(vehicle, "its behaviour is not known"), []).append(vehicle)
        return list(groups.items())

    def _key_line(self) -> Line:
        left_s = max(0, round(self._deadline_s - self._clock.now()))
        cancel = (f" Esc = cancel ({left_s} s) ", Ink.SELECTED)
        if self._starts_s is not None:
            left_s = max(0, round(self._starts_s - self._clock.now()))
            return [(" Esc = STOP THIS ", Ink.SELECTED_WARNING), (f"   started in {left_s} s", Ink.BOLD)]
        if self._naming:
            return [cancel, (f"  your name for the ticks, Enter: [{self._typed:_<10}]", Ink.BOLD)]
        if not self._plan.vehicles:
            return [cancel, (f"   {NO_VEHICLE}", Ink.CAUTION)]
        if self._kind is RunKind.LIVE and self._refusing():
            return [cancel, (f"  REFUSED; override by name: [{self._typed:_<13}]", Ink.BOLD)]
        if self._kind is RunKind.LIVE and self._needs_name():
            return [cancel, (f"  sign with your name, Enter: [{self._typed:_<10}]", Ink.BOLD)]
        if self._kind is RunKind.LIVE:
            count = len(self._plan.vehicles)
            ask = f"type {count} and Enter = start: [{self._typed:_<3}]"
            return [cancel, ("   ", Ink.TEXT), (ask, Ink.BOLD)]
        return [cancel, ("   ", Ink.TEXT), ("Enter = start", Ink.BOLD)]
