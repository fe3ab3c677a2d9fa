"""The panel below the lists: everything about the chosen link, path or partner, and what became of the last key."""

import math
from collections.abc import Sequence

from tui_gcs.core.protocol.link_report import LinkRow, PartnerRow, PathRow
from tui_gcs.feed.link_watch import WatchedLink
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, wrapped
from tui_gcs.widgets.links.link_lists import bytes_words, others_words


class LinkPanel(LinesView):
    """Details of one row, in whole sentences."""

    DEFAULT_CSS = framed("LinkPanel", "height: 9;")

    _row: WatchedLink | PathRow | PartnerRow | None = None
    _outcome: Sequence[Run] = ()

    def show(self, row: WatchedLink | PathRow | PartnerRow | None, outcome: Sequence[Run]) -> None:
        """Show this row, and the lines of the last key."""
        self._row, self._outcome = row, outcome
        set_title(self, title_of(row))
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        outcome: list[Line] = [[(part, ink)] for text, ink in self._outcome for part in wrapped(text, width)]
        row = self._row
        texts: list[Run] = []
        if isinstance(row, WatchedLink):
            texts = link_texts(row)
        elif isinstance(row, PathRow):
            texts = path_texts(row)
        elif row is not None:
            texts = partner_texts(row)
        body: list[Line] = [[(part, ink)] for text, ink in texts for part in wrapped(text, width)]
        return [*body[: max(0, height - len(outcome))], *outcome]


def title_of(row: WatchedLink | PathRow | PartnerRow | None) -> str:
    """Return what the row is."""
    if isinstance(row, WatchedLink):
        return f"{row.row.name}   {origin(row.row)}"
    if isinstance(row, PathRow):
        return f"vehicle {row.vehicle}   {row.link} {row.address}"
    return f"{row.endpoint}   {origin(row)}" if row is not None else "link"


def origin(row: LinkRow | PartnerRow) -> str:
    """Return who opened a link or an endpoint, and for how long."""
    if not row.is_added:
        return "given at the start"
    return "added here, kept" if row.is_kept else "added here, until the station ends"


def link_texts(link: WatchedLink) -> list[Run]:
    """Return budget, counts, radio and options of a link."""
    row = link.row
    texts: list[Run] = [(f"DOES NOT WORK: {row.error}", Ink.CAUTION)] if not row.up else []
    budget = "no limit" if row.budget_bytes_per_s is None else f"{row.budget_bytes_per_s:.0f} B/s for telemetry"
    asked = f"{row.vehicles} vehicles are asked for set {row.set_name!r}: at most {row.telemetry_bytes_per_s:.0f} B/s"
    texts.append((f"{asked}; budget: {budget}" if row.set_name else f"nothing is asked; budget: {budget}", Ink.TEXT))
    texts.append(
        (f"in {bytes_words(link.in_bytes_per_s)} B/s, out {bytes_words(link.out_bytes_per_s)} B/s measured", Ink.TEXT)
    )
    if row.radio is not None:
        radio = row.radio
        rssi = f"rssi {radio.rssi}, at the vehicle {radio.remote_rssi}; noise {radio.noise}/{radio.remote_noise}"
        errors = f"{radio.rx_errors} errors, {radio.fixed} mended"
        buffer = f"buffer {radio.txbuf_pct} % free" if radio.txbuf_pct <= 100 else "buffer not known"
        texts.append((f"radio {radio.age_s:.0f} s ago: {rssi}; {buffer}; {errors}", Ink.TEXT))
    bad = f"{row.junk_bytes} bytes of no frame, {row.bad_crc} wrong CRC, {row.kernel_drops} dropped by the system"
    texts.append((f"{row.frames} frames; {bad}; {row.send_refused} could not be sent", Ink.TEXT))
    options = [f"network {row.network}"] if row.network else []
    options += ["cannot be overheard"] if row.secure else []
    options += ["satellite: commands only"] if row.high_latency else []
    return [*texts, (", ".join(options), Ink.MUTED)] if options else texts


def path_texts(path: PathRow) -> list[Run]:
    """Return use, losses, times and counts of a path."""
    use = "frames for the vehicle go this way" if path.in_use else "heard, and used for stops"
    if path.state != "used":
        use = f"NOT USED: {path.state}"
    up = "not reported" if math.isnan(path.up_loss_pct) else f"{path.up_loss_pct:.1f} %"
    rtt = "not measured"
    if not math.isnan(path.rtt_s):
        rtt = f"{1000 * path.rtt_s:.0f} ms (best {1000 * path.best_rtt_s:.0f})"
    return [
        (use, Ink.CAUTION if path.state != "used" else Ink.TEXT),
        (f"lost from the vehicle {path.loss_pct:.1f} % of {path.frames} frames; to the vehicle: {up}", Ink.TEXT),
        (f"round trip {rtt}; {path.duplicates} duplicates; {path.restarts} sequence restarts", Ink.TEXT),
        (f"frames: {path.signing}", Ink.TEXT),
    ]


def partner_texts(partner: PartnerRow) -> list[Run]:
    """Return what a partner may do, what reached vehicles of what it sent, and what was refused."""
    may = "its commands are judged, and may reach vehicles" if partner.takes_commands else "it only listens"
    if partner.is_closed:
        may = f"{partner.error}: nothing is sent there or taken from there"
    texts: list[Run] = [(may, Ink.CAUTION if partner.is_closed else Ink.TEXT)]
    if partner.error and not partner.is_closed:
        texts.insert(0, (f"DOES NOT WORK: {partner.error}", Ink.CAUTION))
    traffic = f"whole endpoint: {partner.bytes_out} bytes sent, {partner.bytes_in} received"
    whose = partner.address or others_words(partner)
    texts.append((f"{traffic}; {whose}: {partner.passed} frames reached vehicles", Ink.TEXT))
    if partner.refused:
        worst = sorted(partner.refused.items(), key=lambda item: -item[1])
        texts.append(("refused: " + ", ".join(f"{reason} {count}" for reason, count in worst), Ink.CAUTION))
    return texts
