"""The links screen: layout, views and keys."""

from typing import Any, ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.link_actions import LINK_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.link_report import LinkRow, PartnerRow, PathRow
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.link_watch import LinkWatch, badness
from tui_gcs.feed.messages import SelectionChanged, StationBack, StationLost
from tui_gcs.screens.common.polled_screen import PolledScreen
from tui_gcs.screens.links.link_edits import LINK_HINT, PARTNER_HINT, LinkEdits
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.links.link_lists import LinkList, PartnerList, PathList
from tui_gcs.widgets.links.link_panel import LinkPanel

VIEWS = ("links", "paths", "partners")
PARTNERS = VIEWS.index("partners")


class LinksScreen(PolledScreen):
    """Links, paths of the selected vehicles (or of all while none is selected), and partners."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = LINK_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(LINK_ACTIONS, "links")
    LOOK_S = 1.0
    CSS = """
    LinksScreen { layout: vertical; }
    LinksScreen.-paths LinkList, LinksScreen.-partners LinkList { display: none; }
    LinksScreen.-paths PathList, LinksScreen.-partners PartnerList { display: block; }
    """

    def __init__(self, feed: Feed, clock: Clock, *, glyphs: GlyphSet = UNICODE) -> None:
        """Show the links of the station of `feed`."""
        super().__init__(feed)
        self._glyphs = glyphs
        self._view = 0
        self._worst_first = False
        self._rate_for: LinkRow | None = None
        """The link whose rate is being typed."""
        self.watch_links = LinkWatch(feed.requests, self.show_all)
        self.edits = LinkEdits(self, feed, clock, glyphs, self.show_chosen)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.link_list = LinkList(glyphs=glyphs)
        self.path_list = PathList(glyphs=glyphs)
        self.partner_list = PartnerList(glyphs=glyphs)
        self.panel = LinkPanel(glyphs=glyphs)
        self.rate_bar = PromptBar("rate")
        self.link_bar = PromptBar("link")
        self.partner_bar = PromptBar("partner")
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed, here="show_links")

    def compose(self) -> ComposeResult:
        """Compose the top lines, the lists, the details, the questions and the footer."""
        yield self.top_lines
        yield self.link_list
        yield self.path_list
        yield self.partner_list
        yield self.panel
        yield self.rate_bar
        yield self.link_bar
        yield self.partner_bar
        yield self.footer

    @on(events.ScreenResume)
    @on(StationBack)
    def look_again(self) -> None:
        """Look at once; rates are measured anew, because nothing was asked meanwhile."""
        self.watch_links.pause()
        self.look()

    async def ask_station(self) -> None:
        """Ask for links, paths and partners."""
        await self.watch_links.look()

    @on(events.Resize)
    @on(StationLost)
    @on(SelectionChanged)
    def show_all(self) -> None:
        """Show what is known; the same row stays chosen while others come and go."""
        if not self.is_current:
            return
        watch = self.watch_links
        self.link_list.show_kept(watch.links, lambda each: each.row.name)
        self.path_list.show_kept(self._paths(), lambda path: (path.vehicle, path.link, path.address))
        self.partner_list.show_kept(watch.partners, lambda partner: (partner.endpoint, partner.address))
        self.show_chosen()

    def _paths(self) -> list[PathRow]:
        selected = self.feed.selection.ids
        paths = [path for path in self.watch_links.paths if not selected or path.vehicle in selected]
        if self._worst_first:
            return sorted(paths, key=badness, reverse=True)
        return sorted(paths, key=lambda path: (path.vehicle, not path.in_use, path.link, path.address))

    def show_chosen(self) -> None:
        """Show titles, and the chosen row in detail."""
        selected = self.feed.selection.ids
        whose = vehicles_words(selected) if selected else "all vehicles"
        order = "worst first" if self._worst_first else "by vehicle"
        set_title(self.link_list, self._title(f"links  {len(self.link_list.rows)}"))
        set_title(self.path_list, self._title(f"paths  {len(self.path_list.rows)}", whose, order))
        set_title(self.partner_list, self._title("forwarding partners"))
        self.panel.show(self.row_list.chosen_row, self.edits.report)
        self.footer.relabel(self._labels())

    def _labels(self) -> dict[str, str]:
        """Keys of the partners, which come before those of links where a narrow footer has no room for all."""
        if self.row_list is not self.partner_list:
            return {}
        return {"add": "add"} if self.row_list.chosen_row is None else {"add": "add", "close": "close"}

    def _title(self, *parts: str) -> str:
        left_out = f"{self.watch_links.left_out} paths more" if self.watch_links.left_out else ""
        silent = "STATION SILENT" if self.feed.station_lost else ""
        return "   ".join(part for part in (*parts, left_out, silent) if part)

    @property
    def row_list(self) -> RowsView[Any]:
        """The list of the view."""
        return (self.link_list, self.path_list, self.partner_list)[self._view]

    def _chosen_link(self) -> LinkRow | None:
        """The link that a key is about: the chosen one, or that of the chosen path."""
        row = self.row_list.chosen_row
        name = row.link if isinstance(row, PathRow) else getattr(getattr(row, "row", None), "name", "")
        return next((each.row for each in self.watch_links.links if each.row.name == name), None)

    def say_copied(self, text: str, ink: Ink) -> None:
        """See `ListScreen`."""
        self.edits.say_copied(text, ink)

    # ---------------------------------------------------------------- keys

    def action_next_view(self) -> None:
        """Show links, paths, partners."""
        self._show_view((self._view + 1) % len(VIEWS))

    def _show_view(self, view: int) -> None:
        self._view = view
        for at, name in enumerate(VIEWS):
            self.set_class(at == self._view, f"-{name}")
        self.show_all()

    def action_worst(self) -> None:
        """Show the worst path first, or the paths by vehicle."""
        if VIEWS[self._view] != "paths":
            self._show_view(VIEWS.index("paths"))
            self._worst_first = True
        else:
            self._worst_first = not self._worst_first
        self.path_list.show(self._paths(), 0)
        self.show_all()

    def action_cancel(self) -> None:
        """Forget the report of the last key."""
        self.edits.report = ()
        self.show_all()

    def action_rate(self) -> None:
        """Ask for the rate of the chosen link."""
        link = self._link_to_change()
        if link is not None:
            self._rate_for = link
            limit = "none" if link.capacity_bytes_per_s is None else str(link.capacity_bytes_per_s)
            self.rate_bar.ask(f"{link.name} carries, B/s (none = no limit) =", limit)

    @on(PromptBar.Answered, "#rate")
    def _set_rate(self, message: PromptBar.Answered) -> None:
        self.set_focus(None)
        if message.text is not None and self._rate_for is not None:
            self.edits.set_rate(self._rate_for, message.text)

    def action_add(self) -> None:
        """Ask for the link to open; among the partners, for the address to forward to."""
        if self._view == PARTNERS:
            self.action_add_partner()
        elif self._may_change():
            self.edits.say(LINK_HINT, Ink.MUTED)
            self.link_bar.ask("add link", "udpin:127.0.0.1:14551")

    @on(PromptBar.Answered, "#link")
    def _add(self, message: PromptBar.Answered) -> None:
        self._prompt_closed()
        if message.text is not None and message.text.strip():
            self.edits.add(message.text)

    def action_add_partner(self) -> None:
        """Show the partners, and ask for the address to forward to."""
        if self._may_change():
            self._show_view(PARTNERS)
            self.edits.say(PARTNER_HINT, Ink.MUTED)
            self.partner_bar.ask("forward to", "udpout:127.0.0.1:14560")

    @on(PromptBar.Answered, "#partner")
    def _add_partner(self, message: PromptBar.Answered) -> None:
        self._prompt_closed()
        if message.text is not None and message.text.strip():
            self.edits.add_partner(message.text)

    def _prompt_closed(self) -> None:
        """Give the keys back to the lists, and take the hint away."""
        self.set_focus(None)
        self.edits.report = ()
        self.show_chosen()

    def action_close(self) -> None:
        """Ask whether the chosen link or partner is to be closed."""
        if self._view == PARTNERS:
            partner = self.partner_list.chosen_row
            if not self._may_change():
                return
            if isinstance(partner, PartnerRow):
                rows = [row for row in self.partner_list.rows if row.endpoint == partner.endpoint and row.address]
                self.edits.close_partner(partner, len(rows))
            else:
                self.edits.say("nothing is forwarded: + adds another station", Ink.CAUTION)
            return
        link = self._link_to_change()
        if link is not None:
            self.edits.close(link)

    def _may_change(self) -> bool:
        """Whether this console may change anything; else the operator is shown why not."""
        if why := self.edits.why_not():
            self.edits.say(why, Ink.CAUTION)
        return not why

    def _link_to_change(self) -> LinkRow | None:
        link = self._chosen_link()
        why = self.edits.why_not() or ("" if link is not None else "no link is chosen: Tab shows them")
        if why:
            self.edits.say(why, Ink.CAUTION)
            return None
        return link
