"""What the links screen does to links and forwarding partners: add, close, another rate."""

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.link_report import (
    AddLink,
    AddPartner,
    CloseLink,
    ClosePartner,
    LinkRow,
    PartnerRow,
    SetLinkRate,
)
from tui_gcs.core.protocol.services import LinkChange
from tui_gcs.screens.common.screen_edits import ScreenEdits
from tui_gcs.screens.common.sure_dialog import SureDialog
from tui_gcs.widgets.basics.palette import Ink

NO_LIMIT = ("none", "no limit", "-")
"""What is typed for a link without a limit."""
LINK_HINT = (
    "options: ,secure = keys may be sent over it   ,highlatency = satellite, commands only   "
    ",rate=BYTES_PER_S   ,network=NAME"
)
PARTNER_HINT = (
    "The station there hears the vehicles, and only listens. Type ,commands behind the address to let it command, too: "
    "each command is judged; asks"
)
COMMANDS = "commands"
"""The option behind the address of a partner that may command."""


class LinkEdits(ScreenEdits):
    """Adds, closes and re-rates links, adds and closes partners, and asks where that is meant to be asked."""

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
        reason = f"{link.vehicles} vehicles are heard there; nothing more is received or sent over it"
        self._ask(f"close {link.name}", [reason], "close", CloseLink(link.name), f"{link.name} stays open")

    def add_partner(self, typed: str) -> None:
        """Forward to the address that was typed; ask first whether the station there may command."""
        name, *options = (part.strip() for part in typed.strip().split(","))
        link = ",".join([name, *(option for option in options if option != COMMANDS)])
        if COMMANDS not in options:
            self._send(AddPartner(link))
            return
        reasons = [
            "each of its commands is judged; those that pass reach vehicles, and are journalled with its address",
            "the permission ends when it is closed, or with this run of the station",
        ]
        request = AddPartner(link, takes_commands=True)
        self._ask(f"let {clean(name, 60)} command", reasons, "allow it", request, f"{name} was not added")

    def close_partner(self, partner: PartnerRow, count: int) -> None:
        """Ask whether nothing is to be forwarded to an endpoint any more, at which `count` stations are."""
        if partner.is_closed:
            self.say(f"{partner.endpoint} is {partner.error}", Ink.CAUTION)
            return
        who = "nobody is there now" if not count else f"{count} station{'s' if count > 1 else ''} there"
        reason = f"{who}: no vehicle is heard there any more, and nothing that comes from there is passed on"
        request = ClosePartner(partner.endpoint)
        self._ask(f"close {partner.endpoint}", [reason], "close", request, f"{partner.endpoint} stays open")

    def _ask(
        self, title: str, reasons: list[str], does: str, request: AddPartner | CloseLink | ClosePartner, left: str
    ) -> None:
        """Ask whether `request` is to be sent; else report `left`."""

        def answered(yes: bool | None) -> None:
            if yes:
                self._send(request)
            else:
                self.say(left)

        self._host.app.push_screen(SureDialog(title, reasons, does, self._glyphs, self._clock), answered)

    def _send(self, request: LinkChange) -> None:
        self._host.run_worker(self._carry_out(request), group="links", exit_on_error=False)

    async def _carry_out(self, request: LinkChange) -> None:
        reply = await self._feed.requests.send(request)
        if reply.ok:
            self.say(reply.text, Ink.NORMAL)
        else:
            self.say(f"NOT DONE: {reply.text}", Ink.WARNING)
