"""What the links screen does to links: add, close, another rate."""

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.link_report import AddLink, CloseLink, LinkRow, SetLinkRate
from tui_gcs.screens.common.screen_edits import ScreenEdits
from tui_gcs.screens.common.sure_dialog import SureDialog
from tui_gcs.widgets.basics.palette import Ink

NO_LIMIT = ("none", "no limit", "-")
"""What is typed for a link without a limit."""


class LinkEdits(ScreenEdits):
    """Adds, closes and re-rates links, and asks where that is meant to be asked."""

    def why_not(self) -> str:
        """Return why no link can be changed now; "" if it can."""
        return self._feed.requests.read_only

    def add(self, typed: str) -> None:
        """Open the link that was typed."""
        self._send(AddLink(typed.strip()))

    def set_rate(self, link: LinkRow, typed: str) -> None:
        """Give a link the rate that was typed, in bytes per second."""
        text = typed.strip().casefold()
        if text in NO_LIMIT:
            self._send(SetLinkRate(link.name, None))
        elif text.isascii() and text.isdecimal() and len(text) <= 12:
            self._send(SetLinkRate(link.name, int(text)))
        else:
            self.say(f"{clean(typed, 40)!r} is no rate: whole bytes per second, or none", Ink.CAUTION)

    def close(self, link: LinkRow) -> None:
        """Ask whether a link is to be closed."""
        if not link.up and link.error.startswith("closed by"):
            self.say(f"{link.name} is {link.error}", Ink.CAUTION)
            return
        reasons = [f"{link.vehicles} vehicles are heard there; nothing more is received or sent over it"]

        def answered(yes: bool | None) -> None:
            if yes:
                self._send(CloseLink(link.name))
            else:
                self.say(f"{link.name} stays open")

        title = f"close {link.name}"
        self._host.app.push_screen(SureDialog(title, reasons, "close", self._glyphs, self._clock), answered)

    def _send(self, request: AddLink | CloseLink | SetLinkRate) -> None:
        self._host.run_worker(self._carry_out(request), group="links", exit_on_error=False)

    async def _carry_out(self, request: AddLink | CloseLink | SetLinkRate) -> None:
        reply = await self._feed.requests.send(request)
        if reply.ok:
            self.say(reply.text, Ink.NORMAL)
        else:
            self.say(f"NOT DONE: {reply.text}", Ink.WARNING)
