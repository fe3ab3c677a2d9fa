"""What the console's operator commands: each asked as gravely as it may harm, sent once, followed to its result."""

from typing import Any

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, refusal
from tui_gcs.actions.orders import BY_ID, beyond_reach, left_out_words, split
from tui_gcs.actions.places import PlaceReferences
from tui_gcs.actions.table import NOTHING_HOLDS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import bounds
from tui_gcs.core.protocol.common import Hold, Request, Resume, Return, RunPhase, Start, SwitchRound
from tui_gcs.core.protocol.flight import Land
from tui_gcs.core.protocol.preflight import CheckState, ReadChecks
from tui_gcs.core.protocol.setup import AskPayloads
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import FleetUpdated
from tui_gcs.feed.notices import Severity
from tui_gcs.feed.order_tracker import OrderTracker, Seen, SentOrder
from tui_gcs.screens.common.map_screen import present_round
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.fly.manual_control_screen import ManualControlScreen
from tui_gcs.screens.fly.round_dialog import RoundDialog
from tui_gcs.screens.fly.start_dialog import StartDialog
from tui_gcs.screens.fly.start_plan import start_plan
from tui_gcs.screens.orders.order_dialog import ConfirmedOrder, OrderDialog
from tui_gcs.screens.orders.order_menu import OrderMenu
from tui_gcs.screens.orders.vehicle_words import brief_words, now_words, rows_of
from tui_gcs.screens.preflight.preflight_screen import Operator, PreflightScreen
from tui_gcs.terminal.variant import TerminalApp
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.fleet.result_panel import ResultPanel, summary

STOP_TRIES = 3
GONE_S = 6.0
"""So long a table stays in which all succeeded."""
FOLLOW_S = 0.5
LIFTS = frozenset({"arm", "take_off"})
"""Orders before which is told what would refuse a start."""
CLOSED_S = 1.5
"""So soon after a question closed by itself Enter was meant for that, and resumes nobody."""
CANCELLED = "cancelled"
CARRIED_S, MOST_CARRIED = 10.0, 16
"""Vehicles are asked what they carry so often at most, and so many at once: each answers four questions."""
_LEVELS = {Ink.WARNING: Severity.WARNING, Ink.CAUTION: Severity.CAUTION}


class CommandingApp(TerminalApp):
    """The part of the console that asks something of the station. `ConsoleApp` sets `feed`, `glyphs`, `clock`."""

    feed: Feed
    glyphs: GlyphSet
    clock: Clock
    orders: OrderTracker
    operator: Operator
    _news_s = 0.0
    _closed_s = _carried_s = float("-inf")

    def notice(self, text: str, level: Severity = Severity.NORMAL, about: str = "") -> None:
        """Say something for a while; about the same thing the newest counts."""
        raise NotImplementedError

    def refused(self, action_id: str) -> bool:
        """Whether an action of the app can do nothing now; the reason is told."""
        action, situation = action_named(action_id), self.feed.action_context()
        why = refusal(action, situation)
        if why:
            name = action.label_now(situation) if action.label_now is not None else action_id.replace("_", " ")
            self.notice(f"{name}: nothing sent: {why}", Severity.CAUTION)
        return bool(why)

    @property
    def unapplied(self) -> int:
        """Changes on the plan screen that the station does not fly."""
        return 0

    # ------------------------------------------------------------ everybody

    def action_start_stop(self) -> None:
        """Start on the ground (asks), HOLD in flight (does not ask)."""
        if self.refused("start_stop"):
            return
        if self.feed.action_context().run is RunPhase.IDLE:
            self._ask_start()
        else:
            self.action_hold_all()

    def action_hold_all(self) -> None:
        """HOLD everything now, whatever is on the screen."""
        self.send(Hold(), "HOLD ALL", seen=BY_ID["hold"].seen, tries=STOP_TRIES)

    def action_return_all(self) -> None:
        """All return by layers and land in turn, whatever is on the screen."""
        self.send(Return(), "RETURN ALL", seen=BY_ID["return"].seen, begins=True, tries=STOP_TRIES)

    def action_land_all(self) -> None:
        """All land where they are, whatever is on the screen."""
        self.send(Land(), "LAND ALL", seen=BY_ID["land"].seen, begins=True, tries=STOP_TRIES)

    def action_resume(self) -> None:
        """In hold: the planners go on."""
        if not self.refused("resume"):
            self.send(Resume(), "resume")

    def on_map_screen_resume_requested(self) -> None:
        """Enter: means resume in hold, else nothing."""
        if why := refusal(action_named("resume"), self.feed.action_context()):
            if why != NOTHING_HOLDS:
                self.notice(f"resume: nothing sent: {why}", Severity.CAUTION)
            return
        if self.clock.now() - self._closed_s < CLOSED_S:
            self.notice("resume: nothing sent: a question had just closed; Enter again resumes", Severity.CAUTION)
        else:
            self.action_resume()

    def action_choose_round(self) -> None:
        """Ask which round."""
        status = self.feed.status
        if self.refused("choose_round") or status is None:
            return
        flying = status.run is not RunPhase.IDLE
        dialog = RoundDialog(status.rounds, status.round_index, flying, self.feed, self.glyphs, self.clock)

        def answered(index: int | None) -> None:
            if index is not None:
                self.send(SwitchRound(index=index), f"round {index + 1}")
            else:
                self._closed_s = self.clock.now()
                self.notice(f"round: nothing sent: {dialog.closed_by_itself or CANCELLED}")

        self.push_screen(dialog, answered)

    def _ask_start(self) -> None:
        feed = self.feed
        if feed.scenario is None or feed.status is None or feed.frame is None:
            self.notice("no scenario or no fleet yet: nothing to start", Severity.CAUTION)
            return
        scenario = feed.scenario.scenario
        plan = start_plan(scenario, feed.status, feed.frame)

        dialog = StartDialog(
            plan,
            feed.status.kind,
            scenario.link_loss,
            feed,
            self.glyphs,
            self.clock,
            self.operator,
            unapplied=self.unapplied,
        )

        def answered(request: Start | None) -> None:
            if request is not None:
                self.send(request, f"start {ids(plan.vehicles)}")
            else:
                self.notice(f"start: nothing sent: {dialog.closed_by_itself or CANCELLED}")

        self._read_checks()
        self.push_screen(dialog, answered)

    def _read_checks(self) -> None:
        """Vehicles are asked what is not known of them, so that a question about leaving the ground can tell it."""
        status = self.feed.status
        if status is not None and any(check.state is CheckState.UNKNOWN for check in status.preflight):
            self.ask_quietly(ReadChecks(), "read")

    def ask_quietly(self, request: Request, title: str) -> None:
        """Ask the station; nothing is told unless it could not be done."""

        async def ask() -> None:
            reply = await self.feed.requests.send(request)
            if not reply.ok:
                self.notice(f"{title} NOT DONE: {reply.text}", Severity.WARNING, title)

        self.run_worker(ask(), group="requests", exit_on_error=False)

    def action_show_checks(self) -> None:
        """What is checked before a start."""
        self.push_screen(PreflightScreen(self.feed, self.ask_quietly, self.operator, self.glyphs, self.clock))

    # ------------------------------------------------------------ those who are selected

    def action_orders(self) -> None:
        """What can the selected vehicles be told?"""
        if not self.refused("orders"):
            self._ask_carried()
            self.push_screen(OrderMenu(self.feed, self.glyphs), lambda chosen: self._ordered(chosen, doubtful=True))

    def _ask_carried(self) -> None:
        """Those of which no camera or no gimbal showed are asked once more: autopilots tell of theirs only then."""
        rows, now = rows_of(self.feed), self.clock.now()
        unknown = tuple(
            v
            for v in self.feed.selection.ids
            if v in rows and not (rows[v].camera and rows[v].gimbal) and not beyond_reach(rows[v])
        )[:MOST_CARRIED]
        if unknown and now - self._carried_s > CARRIED_S:
            self._carried_s = now
            self.run_worker(self.feed.requests.send(AskPayloads(unknown)), group="carried", exit_on_error=False)

    def action_return_selected(self) -> None:
        """Ask whether the selected vehicles shall return."""
        if not self.refused("return_selected"):
            self._ordered("return")

    def action_order(self, order_id: str) -> None:
        """Ask about one order."""
        if not self.refused("orders"):
            self._ordered(order_id)

    def _ordered(self, order_id: str | None, *, doubtful: bool = False) -> None:
        """Ask about it. `doubtful`: where none of them is without doubt, those that are doubted are meant."""
        if order_id is None:
            return
        order, chosen, rows = BY_ID[order_id], self.feed.selection.ids, rows_of(self.feed)
        concerned, left_out = split(order, chosen, rows)
        doubtful = doubtful and not concerned and bool(split(order, chosen, rows, doubtful=True)[0])
        if not concerned and not doubtful:
            why = left_out_words(left_out) or "no vehicle is selected"
            self.notice(f"{order.name}: nothing sent: {why}", Severity.CAUTION)
            return
        if order.id in LIFTS:
            self._read_checks()
        self.push_screen(
            OrderDialog(order, self.feed, self.surroundings, self.glyphs, self.clock, doubtful=doubtful),
            lambda answer: self._answered(order.name, answer),
        )

    def _answered(self, name: str, answer: ConfirmedOrder | str | None) -> None:
        if isinstance(answer, ConfirmedOrder):
            title = f"{answer.order.name} {ids(answer.vehicles)}"
            tries = STOP_TRIES if answer.order.is_stop else 1
            self.send(
                answer.request,
                title,
                answer.vehicles,
                answer.left_out,
                seen=answer.order.seen,
                begins=answer.order.begins,
                tries=tries,
            )
            if answer.order.id == "nudge":
                self.push_screen(
                    ManualControlScreen(answer.vehicles, self.feed, self._nudge, self.send, self.clock, self.glyphs)
                )
        else:
            self._closed_s = self.clock.now()
            self.notice(f"{name}: nothing sent: {answer or CANCELLED}")

    def _nudge(self, request: Request) -> None:
        """Without a table: what is refused is told at once."""

        async def ask() -> None:
            reply = await self.feed.requests.send(request)
            refused = [f"{result.vehicle}: {result.text}" for result in reply.results if not result.ok]
            if not reply.ok and isinstance(self.screen, ManualControlScreen):
                self.screen.refuse("; ".join(refused) or reply.text)

        self.run_worker(ask(), group="nudge", exit_on_error=False)

    def surroundings(self) -> PlaceReferences:
        """What places can be relative to, now."""
        feed = self.feed
        current = present_round(feed)
        middles = {}
        for zone in current.zones if current is not None else ():
            x0, y0, x1, y1 = bounds(zone.shape)
            middles[zone.name] = ((x0 + x1) / 2, (y0 + y1) / 2)
        frame = LocalFrame(feed.scenario.scenario.origin) if feed.scenario is not None else None
        fly = next((screen for screen in self.screen_stack if isinstance(screen, FlyScreen)), None)
        return PlaceReferences(rows_of(feed), middles, frame, fly.cursor_m if fly is not None else None)

    # ------------------------------------------------------------ sending, following

    def send(
        self,
        request: Request,
        title: str,
        vehicles: tuple[int, ...] = (),
        left_out: dict[int, str] | None = None,
        *,
        seen: Seen | None = None,
        begins: bool = False,
        tries: int = 1,
    ) -> None:
        """Ask the station; what comes of it is shown."""
        self.run_worker(
            self.orders.send(request, title, vehicles, left_out, seen=seen, begins=begins, tries=tries),
            group="requests",
            exit_on_error=False,
        )

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        """Telemetry may show what was ordered; the table says how vehicles are now."""
        self.orders.look()
        if self.orders.orders and any(panel.display for panel in self.screen_stack[0].query(ResultPanel)):
            self._show_table()

    def follow_orders(self) -> None:
        """See how tasks stand, and whose time is up."""
        self.orders.look()
        orders = self.orders.orders
        over = all(order.good and not order.waiting for order in orders)
        if orders and over and self.clock.now() - self._news_s > GONE_S:
            self.close_result()
        if any(order.tasks for order in orders):
            self.run_worker(self.orders.ask_tasks(), group="follow", exclusive=True, exit_on_error=False)

    def show_order(self, order: SentOrder) -> None:
        """The table, and one line for the journal when there is news."""
        if order.results:
            text, ink = summary(order.title, order.results)
            if text != order.told:  # closed by the operator it comes back with news only
                self._show_table()
        elif order.refused:
            text, ink = f"{order.title} NOT DONE: {order.text}", Ink.WARNING
        else:
            text, ink = f"{order.title}: {order.text or 'sent'}", Ink.NORMAL
        if text != order.told:
            order.told = text
            self.notice(text, _LEVELS.get(ink, Severity.NORMAL), order.title)
            self._news_s = self.clock.now()

    def _show_table(self) -> None:
        told = [
            (order.title, order.results) for order in self.orders.orders if order.results
        ]  # not: refused as a whole
        if not told:
            return
        newest, *before = reversed(told)
        self._panel().show(newest, before, rows_of(self.feed).get, now_words, brief_words)

    def fit_result(self) -> None:
        """The terminal has another size."""
        for panel in self.screen_stack[0].query(ResultPanel):
            panel.fit()

    def close_result(self) -> bool:
        """Close the table; whether there was one."""
        self.orders.forget_over()
        bottom = self.screen_stack[:1]  # none any more while the console ends
        closed = [panel.close() for screen in bottom for panel in screen.query(ResultPanel)]
        return any(closed)

    def _panel(self) -> ResultPanel:
        base: Any = self.screen_stack[0]
        found = base.query(ResultPanel)
        if found:
            panel: ResultPanel = found.first()
            return panel
        panel = ResultPanel(glyphs=self.glyphs)
        base.mount(panel)
        return panel


def action_named(action_id: str) -> ConsoleAction:
    """One of the app's actions."""
    return next(action for action in APP_ACTIONS if action.id == action_id)
