"""What request handlers share: the parts of the station that they act on."""

from dataclasses import dataclass

from tui_gcs.core.preflight.checklist import PreflightChecklist
from tui_gcs.core.preflight.readiness import Readiness
from tui_gcs.core.station.assembly import StationParts
from tui_gcs.core.station.publisher import Publisher


@dataclass(frozen=True)
class RequestContext:
    """The parts of a station for its request handlers, with the checks before a start."""

    parts: StationParts
    publisher: Publisher
    """Makes the fleet frame and the status that some replies hold."""
    readiness: Readiness
    checklist: PreflightChecklist
