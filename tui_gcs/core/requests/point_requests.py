"""Requests about tasks from outside: points of interest are added and cancelled."""

from tui_gcs.core.protocol.common import Reply
from tui_gcs.core.protocol.points import AddPoints, CancelPoints, NewPoint
from tui_gcs.core.requests.handler import Access, RequestHandler
from tui_gcs.core.station.assembly import StationParts


class PointRequests:
    """Passes points on to the table that planners see; vehicles may fly elsewhere because of them."""

    def __init__(self, parts: StationParts) -> None:
        self._points = parts.flight.points
        self._parts = parts

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
        return Reply(ok=True, text=f"{len(request.points)} added: {names}{self._may_stay_open(request.points)}")

    def cancel(self, request: CancelPoints) -> Reply:
        """Cancel open points."""
        found = self._points.cancel(request.names)
        if unknown := [name for name in request.names if name not in found]:
            done = f"; cancelled: {', '.join(found)}" if found else ""
            return Reply(ok=False, text=f"no open task {', '.join(unknown)}{done}")
        return Reply(ok=True, text=f"cancelled: {', '.join(found) or 'none was open'}")

    def _may_stay_open(self, points: tuple[NewPoint, ...]) -> str:
        """Return a warning if no planner that they are for declares that it is judged by tasks.

        Nothing is said where a planner has not declared itself yet.
        """
        named = {point.team for point in points}
        teams = [team for team in self._parts.active.scenario.teams if "" in named or team.name in named]
        planners = {team.planner for team in teams}
        declared = [self._parts.config.planners.get(name) for name in planners]
        if any(info is None or info.judged_by == "tasks" for info in declared):
            return ""
        return f"; {', '.join(sorted(planners))}: not made for tasks, so they may stay open"
