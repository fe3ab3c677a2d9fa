"""Requests about tasks from outside: points of interest are added and cancelled."""

from tui_gcs.core.protocol.common import Reply
from tui_gcs.core.protocol.points import AddPoints, CancelPoints
from tui_gcs.core.requests.handler import Access, RequestHandler
from tui_gcs.core.station.assembly import StationParts


class PointRequests:
    """Passes points on to the table that planners see; vehicles may fly elsewhere because of them."""

    def __init__(self, parts: StationParts) -> None:
        self._points = parts.flight.points

    def handlers(self) -> dict[type, RequestHandler]:
        """The entries of the request table that this class answers."""
        return {
            AddPoints: RequestHandler(Access.COMMAND, lambda _, r: self.add(r)),
            CancelPoints: RequestHandler(Access.COMMAND, lambda _, r: self.cancel(r)),
        }

    def add(self, request: AddPoints) -> Reply:
        """Add all points, or none and say why."""
        problem, names = self._points.add(request.points)
        if problem:
            return Reply(ok=False, text=problem)
        return Reply(ok=True, text=f"{len(request.points)} added: {names}")

    def cancel(self, request: CancelPoints) -> Reply:
        """Cancel open points."""
        found = self._points.cancel(request.names)
        if unknown := [name for name in request.names if name not in found]:
            done = f"; cancelled: {', '.join(found)}" if found else ""
            return Reply(ok=False, text=f"no open task {', '.join(unknown)}{done}")
        return Reply(ok=True, text=f"cancelled: {', '.join(found) or 'none was open'}")
