"""What the operator commands: each order is confirmed as its harm demands, then sent and followed."""

from collections.abc import Callable

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, refusal
from tui_gcs.actions.orders import BY_ID, beyond_reach, left_out_words, split
from tui_gcs.actions.places import PlaceReferences
from tui_gcs.actions.table import NOTHING_HOLDS
from tui_gcs.console.order_results import OrderResults
from tui_gcs.console.parts import ConsoleParts
from tui_gcs.core.protocol.common import Hold, Request, Resume, Return, RunPhase, Start, SwitchRound
from tui_gcs.core.protocol.flight import Land
from tui_gcs.core.protocol.preflight import CheckState, ReadChecks
from tui_gcs.core.protocol.setup import AskPayloads
from tui_gcs.feed.notices import Severity
from tui_gcs.screens.common.map_screen import place_references
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.fly.manual_control_screen import ManualControlScreen
from tui_gcs.screens.fly.round_dialog import RoundDialog
from tui_gcs.screens.fly.start_dialog import StartDialog
from tui_gcs.screens.fly.start_plan import start_plan
from tui_gcs.screens.orders.order_dialog import ConfirmedOrder, OrderDialog
from tui_gcs.screens.orders.order_menu import OrderMenu
from tui_gcs.screens.orders.vehicle_words import rows_of
from tui_gcs.screens.preflight.preflight_screen import Operator, PreflightScreen
from tui_gcs.widgets.basics.number_text import ids

# A lost request must not be a lost hold: the station carries a second copy out again, which changes nothing.
STOP_TRIES = 3
LIFTING_ORDERS = frozenset({"arm", "take_off"})
"""Orders whose dialog shows the checks that would refuse a start."""
CLOSED_S = 1.5
"""Enter this soon after a question closed by itself was meant for the question, and resumes nothing."""
PAYLOAD_PERIOD_S = 10.0
"""Vehicles are asked at most this often what they carry."""
MAX_PAYLOAD_QUESTIONS = 16
"""Vehicles that are asked at once: each answers four questions."""
CANCELLED = "cancelled"


class CommandController:
    """Carries out the commands of the action table: asks where an answer is needed, then sends."""

    def __init__(self, parts: ConsoleParts, results: OrderResults, operator: Operator) -> None:
        """Send through `results`; `operator` has the name under which preflight checks are signed."""
        self.unapplied: Callable[[], int] = lambda: 0
        """Number of changes on the plan screen that the station does not fly."""
        self._parts = parts
        self._feed = parts.feed
        self._results = results
        self._operator = operator
        # Enter confirms a question and also resumes: see `CLOSED_S`.
        self._closed_s = self._payloads_asked_s = float("-inf")
        self.by_name: dict[str, Callable[[], None]] = {
            "start_stop": self.start_or_hold,
            "hold_all": self.hold_all,
            "return_all": self.return_all,
            "land_all": self.land_all,
            "resume": self.resume,
            "choose_round": self.choose_round,
            "orders": self.choose_order,
            "return_selected": lambda: self.order("return", action_id="return_selected"),
        }
        """What each action of the table commands, by the action's id."""

    # Commands for all vehicles.

    def start_or_hold(self) -> None:
        """Start on the ground, after a question; HOLD in flight, without one."""
        if self._is_refused("start_stop"):
            return
        if self._feed.action_context().run is RunPhase.IDLE:
            self._ask_start()
        else:
            self.hold_all()

    def hold_all(self) -> None:
        """HOLD everything now, whatever is on the screen."""
        # Nothing refuses it: it is sent also to a silent station and from a terminal that is too small
        # (docs/threats.md D.2).
        reply = self._feed.requests.begin(Hold(), tries=STOP_TRIES)
        self._results.expect(reply, "HOLD ALL", seen=BY_ID["hold"].seen)

    def return_all(self) -> None:
        """Return all vehicles on their layers and land them in turn, whatever is on the screen."""
        reply = self._feed.requests.begin(Return(), tries=STOP_TRIES)
        self._results.expect(reply, "RETURN ALL", seen=BY_ID["return"].seen, begins=True)

    def land_all(self) -> None:
        """Land all vehicles where they are, whatever is on the screen."""
        reply = self._feed.requests.begin(Land(), tries=STOP_TRIES)
        self._results.expect(reply, "LAND ALL", seen=BY_ID["land"].seen, begins=True)

    def resume(self) -> None:
        """Let the planners go on after a hold."""
        if not self._is_refused("resume"):
            self._results.expect(self._feed.requests.begin(Resume()), "resume")

    def resume_by_enter(self) -> None:
        """Resume after a hold, unless Enter was meant for a question that had just closed."""
        if why := refusal(action_named("resume"), self._feed.action_context()):
            if why != NOTHING_HOLDS:
                self._parts.notice(f"resume: nothing sent: {why}", Severity.CAUTION)
            return
        if self._parts.clock.now() - self._closed_s < CLOSED_S:
            text = "resume: nothing sent: a question had just closed; Enter again resumes"
            self._parts.notice(text, Severity.CAUTION)
        else:
            self.resume()

    def choose_round(self) -> None:
        """Ask which round to fly."""
        status, parts = self._feed.status, self._parts
        if self._is_refused("choose_round") or status is None:
            return
        flying = status.run is not RunPhase.IDLE
        dialog = RoundDialog(status.rounds, status.round_index, flying, self._feed, parts.glyphs, parts.clock)

        def answered(index: int | None) -> None:
            if index is not None:
                self._results.expect(self._feed.requests.begin(SwitchRound(index=index)), f"round {index + 1}")
            else:
                self._closed_s = parts.clock.now()
                parts.notice(f"round: nothing sent: {dialog.closed_by_itself or CANCELLED}")

        parts.app.push_screen(dialog, answered)

    def _ask_start(self) -> None:
        feed, parts = self._feed, self._parts
        if feed.scenario is None or feed.status is None or feed.frame is None:
            parts.notice("no scenario or no fleet yet: nothing to start", Severity.CAUTION)
            return
        scenario = feed.scenario.scenario
        plan = start_plan(scenario, feed.status, feed.frame)
        dialog = StartDialog(
            plan,
            feed.status.kind,
            scenario,
            feed,
            parts.glyphs,
            parts.clock,
            self._operator,
            ask=self.ask_quietly,
            unapplied=self.unapplied(),
        )

        def answered(request: Start | None) -> None:
            if request is not None:
                self._results.expect(feed.requests.begin(request), f"start {ids(plan.vehicles)}")
            else:
                parts.notice(f"start: nothing sent: {dialog.closed_by_itself or CANCELLED}")

        self._read_checks()
        parts.app.push_screen(dialog, answered)

    def show_checks(self) -> None:
        """Show what is checked before a start."""
        screen = PreflightScreen(self._feed, self.ask_quietly, self._operator, self._parts.glyphs, self._parts.clock)
        self._parts.app.push_screen(screen)

    # Orders to the selected vehicles.

    def choose_order(self) -> None:
        """Show the menu of orders."""
        if not self._is_refused("orders"):
            self._ask_payloads()
            menu = OrderMenu(self._feed, self._parts.glyphs)
            self._parts.app.push_screen(menu, lambda chosen: self._ask_order(chosen, doubtful=True))

    def order(self, order_id: str, *, action_id: str = "orders", values: str = "") -> None:
        """Ask the operator to confirm one order to the selected vehicles; `values`: see `OrderDialog`."""
        if not self._is_refused(action_id):
            self._ask_order(order_id, values=values)

    def _ask_order(self, order_id: str | None, *, doubtful: bool = False, values: str = "") -> None:
        """Ask about an order; `doubtful`: if it is doubted for all of the vehicles, it is asked for those."""
        if order_id is None:
            return
        parts = self._parts
        order, chosen, rows = BY_ID[order_id], self._feed.selection.ids, rows_of(self._feed)
        concerned, left_out = split(order, chosen, rows)
        doubtful = doubtful and not concerned and bool(split(order, chosen, rows, doubtful=True)[0])
        if not concerned and not doubtful:
            why = left_out_words(left_out) or "no vehicle is selected"
            parts.notice(f"{order.name}: nothing sent: {why}", Severity.CAUTION)
            return
        if order.id in LIFTING_ORDERS:
            self._read_checks()
        dialog = OrderDialog(
            order, self._feed, self._place_references, parts.glyphs, parts.clock, doubtful=doubtful, values=values
        )
        parts.app.push_screen(dialog, lambda answer: self._answered(order.name, answer))

    def _answered(self, name: str, answer: ConfirmedOrder | str | None) -> None:
        if not isinstance(answer, ConfirmedOrder):
            self._closed_s = self._parts.clock.now()
            self._parts.notice(f"{name}: nothing sent: {answer or CANCELLED}")
            return
        order, vehicles = answer.order, answer.vehicles
        # Only stops are repeated: a copy of anything else could have its effect late or twice (docs/threats.md R8).
        reply = self._feed.requests.begin(answer.request, tries=STOP_TRIES if order.is_stop else 1)
        title = f"{order.name} {ids(vehicles)}"
        self._results.expect(reply, title, vehicles, answer.left_out, seen=order.seen, begins=order.begins)
        if order.id == "nudge":
            parts = self._parts
            self._parts.app.push_screen(
                ManualControlScreen(vehicles, self._feed, self._nudge, self._hold, parts.clock, parts.glyphs)
            )

    def _hold(self, request: Hold, title: str) -> None:
        """Hold vehicles that are flown by hand."""
        reply = self._feed.requests.begin(request, tries=STOP_TRIES)
        self._results.expect(reply, title, request.vehicles, seen=BY_ID["hold"].seen)

    def _nudge(self, request: Request) -> None:
        """Send without a table, because a key is repeated often: the screen shows at once what is refused."""

        async def ask() -> None:
            reply = await self._feed.requests.send(request)
            refused = [f"{result.vehicle}: {result.text}" for result in reply.results if not result.ok]
            screen = self._parts.app.screen
            if not reply.ok and isinstance(screen, ManualControlScreen):
                screen.refuse("; ".join(refused) or reply.text)

        self._parts.app.run_worker(ask(), group="nudge", exit_on_error=False)

    def _place_references(self) -> PlaceReferences:
        """What typed places can be relative to, now."""
        fly = next((screen for screen in self._parts.app.screen_stack if isinstance(screen, FlyScreen)), None)
        return place_references(self._feed, fly.cursor_m if fly is not None else None)

    # Questions to the station.

    def ask_quietly(self, request: Request, title: str, what_next: str = "") -> None:
        """Ask the station; the operator is notified if it could not be done, else only where there is a `what_next`."""

        async def ask() -> None:
            reply = await self._feed.requests.send(request)
            if not reply.ok:
                self._parts.notice(f"{title} NOT DONE: {reply.text}", Severity.WARNING, title)
            elif what_next:
                self._parts.notice(f"{reply.text}; {what_next}", Severity.NORMAL, title)

        self._parts.app.run_worker(ask(), group="requests", exit_on_error=False)

    def _read_checks(self) -> None:
        """Have the station read what it does not know of vehicles, so that a dialog about lift-off can show it."""
        status = self._feed.status
        if status is not None and any(check.state is CheckState.UNKNOWN for check in status.preflight):
            self.ask_quietly(ReadChecks(), "read")

    def _ask_payloads(self) -> None:
        """Ask vehicles without a known camera or gimbal once more: autopilots report theirs only when asked."""
        rows, now = rows_of(self._feed), self._parts.clock.now()
        unknown = tuple(
            v
            for v in self._feed.selection.ids
            if v in rows and not (rows[v].camera and rows[v].gimbal) and not beyond_reach(rows[v])
        )[:MAX_PAYLOAD_QUESTIONS]
        if unknown and now - self._payloads_asked_s > PAYLOAD_PERIOD_S:
            self._payloads_asked_s = now
            question = self._feed.requests.send(AskPayloads(unknown))
            self._parts.app.run_worker(question, group="carried", exit_on_error=False)

    def _is_refused(self, action_id: str) -> bool:
        """Whether an action can do nothing now; the operator is shown the reason."""
        action, context = action_named(action_id), self._feed.action_context()
        why = refusal(action, context)
        if why:
            name = action.label_now(context) if action.label_now is not None else action_id.replace("_", " ")
            self._parts.notice(f"{name}: nothing sent: {why}", Severity.CAUTION)
        return bool(why)


def action_named(action_id: str) -> ConsoleAction:
    """The app's action with this id."""
    return next(action for action in APP_ACTIONS if action.id == action_id)
