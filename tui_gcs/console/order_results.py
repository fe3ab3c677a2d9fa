"""Orders on their way: followed to their result, and shown in the table over the screen."""

from collections.abc import Awaitable
from typing import Any

from tui_gcs.console.parts import ConsoleParts
from tui_gcs.core.protocol.services import ServiceReply
from tui_gcs.feed.notices import Severity
from tui_gcs.feed.order_tracker import OrderTracker, Seen, SentOrder
from tui_gcs.screens.orders.vehicle_words import brief_words, now_words, rows_of
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.fleet.result_panel import ResultPanel, summary

FOLLOW_S = 0.5
"""Seconds between two calls of `follow`."""
SUCCESS_SHOWN_S = 6.0
"""A table in which every order succeeded closes by itself after this long without news."""
_SEVERITIES = {Ink.WARNING: Severity.WARNING, Ink.CAUTION: Severity.CAUTION}


class OrderResults:
    """Shows what comes of orders that were sent."""

    def __init__(self, parts: ConsoleParts) -> None:
        self._parts = parts
        self._tracker = OrderTracker(parts.feed, parts.clock, self._show)
        self._news_s = 0.0

    def expect(
        self,
        reply: Awaitable[ServiceReply],
        title: str,
        vehicles: tuple[int, ...] = (),
        left_out: dict[int, str] | None = None,
        *,
        seen: Seen | None = None,
        begins: bool = False,
    ) -> None:
        """Show what becomes of an order that was sent; see `OrderTracker.follow`."""
        # By Textual's default an error in a worker ends the app: one order must not end the console.
        self._parts.app.run_worker(
            self._tracker.follow(reply, title, vehicles, left_out, seen=seen, begins=begins),
            group="requests",
            exit_on_error=False,
        )

    def update(self) -> None:
        """Compare with telemetry what was ordered; the table shows how vehicles are now."""
        self._tracker.look()
        if self._tracker.orders and any(panel.display for panel in self._parts.app.screen_stack[0].query(ResultPanel)):
            self._show_table()

    def follow(self) -> None:
        """Ask how tasks stand, and close a table in which all is well."""
        self._tracker.look()
        orders = self._tracker.orders
        over = all(order.good and not order.waiting for order in orders)
        if orders and over and self._parts.clock.now() - self._news_s > SUCCESS_SHOWN_S:
            self.close()
        if any(order.tasks for order in orders):
            self._parts.app.run_worker(self._tracker.ask_tasks(), group="follow", exclusive=True, exit_on_error=False)

    def fit(self) -> None:
        """Fit the table to another size of the terminal."""
        for panel in self._parts.app.screen_stack[0].query(ResultPanel):
            panel.fit()

    def close(self) -> bool:
        """Close the table; return whether it was open."""
        self._tracker.forget_over()
        bottom = self._parts.app.screen_stack[:1]  # empty while the console ends
        closed = [panel.close() for screen in bottom for panel in screen.query(ResultPanel)]
        return any(closed)

    def panel(self) -> ResultPanel:
        """The table, which lies on the lowest screen; it is made when first needed."""
        base: Any = self._parts.app.screen_stack[0]
        found = base.query(ResultPanel)
        if found:
            panel: ResultPanel = found.first()
            return panel
        panel = ResultPanel(glyphs=self._parts.glyphs)
        base.mount(panel)
        return panel

    def _show(self, order: SentOrder) -> None:
        """Show the table, and write one line to the journal when there is news."""
        if order.results:
            text, ink = summary(order.title, order.results)
            if text != order.reported:  # a table that the operator closed comes back with news only
                self._show_table()
        elif order.refused:
            text, ink = f"{order.title} NOT DONE: {order.text}", Ink.WARNING
        else:
            text, ink = f"{order.title}: {order.text or 'sent'}", Ink.NORMAL
        if text != order.reported:
            order.reported = text
            self._parts.notice(text, _SEVERITIES.get(ink, Severity.NORMAL), order.title)
            self._news_s = self._parts.clock.now()

    def _show_table(self) -> None:
        # An order that was refused as a whole has no vehicles to list.
        listed = [(order.title, order.results) for order in self._tracker.orders if order.results]
        if not listed:
            return
        newest, *before = reversed(listed)
        self.panel().show(newest, before, rows_of(self._parts.feed).get, now_words, brief_words)
