"""The planner log, as far as this console has asked the station for it."""

from collections import deque
from collections.abc import Callable

from tui_gcs.core.protocol.planner_log import GetPlannerLog, PlannerLogLine, PlannerLogPiece
from tui_gcs.feed.requests import ConsoleRequests

MAX_HELD_BYTES = 2_000_000
"""Of the file; about 20,000 lines. Beyond that the pieces at the other end are dropped, and asked for again later."""
MAX_PIECES_PER_LOOK = 4
"""A log that grows faster than this is caught up with by the following looks."""


class PlannerLogWatch:
    """Holds a stretch of the log. While nothing asks here, nothing is done at the station."""

    def __init__(self, requests: ConsoleRequests, on_news: Callable[[], None]) -> None:
        """Ask by `requests`; `on_news` is called whenever an answer has changed what is held."""
        self.problem = ""
        """Why the station gives no log; "" if it does."""
        self.left_out = 0
        self.path = ""
        self._requests = requests
        self._on_news = on_news
        self._pieces: deque[PlannerLogPiece] = deque()
        self._is_newest = True
        """Nothing newer was dropped: new lines follow what is held."""

    @property
    def lines(self) -> list[PlannerLogLine]:
        """The lines held, oldest first."""
        return [line for piece in self._pieces for line in piece.lines]

    @property
    def is_oldest(self) -> bool:
        """Whether nothing older is kept at the station."""
        return bool(self._pieces) and self._pieces[0].is_oldest

    def forget(self) -> None:
        """Begin anew at the end of the log: places of a station that was started again mean something else."""
        self._pieces.clear()
        self._is_newest = True

    async def look(self) -> None:
        """Ask for what is new; for the newest piece if nothing is held."""
        if not self._is_newest:
            return
        known: object = self.problem, self.left_out, len(self._pieces)
        for _ in range(MAX_PIECES_PER_LOOK):
            is_first = not self._pieces
            request = GetPlannerLog() if is_first else GetPlannerLog(self._pieces[-1].end, newer=True)
            piece = await self._ask(request)
            if piece is not None and not is_first and piece.end < request.at:
                # A replay went back, or the station began anew: what is held lies beyond the end of the log.
                self.forget()
                known = None
                continue
            if piece is None or (not is_first and not piece.lines):
                break
            self._pieces.append(piece)
            if is_first:
                break
        if (self.problem, self.left_out, len(self._pieces)) != known:
            while self._held_bytes() > MAX_HELD_BYTES and len(self._pieces) > 1:
                self._pieces.popleft()
            self._on_news()

    async def older(self) -> bool:
        """Ask for the piece before the oldest one held; returns whether there was one."""
        if not self._pieces or self.is_oldest:
            return False
        piece = await self._ask(GetPlannerLog(self._pieces[0].begin))
        if piece is None:
            return False
        self._pieces.appendleft(piece)
        while self._held_bytes() > MAX_HELD_BYTES and len(self._pieces) > 1:
            self._pieces.pop()
            self._is_newest = False
        return True

    async def newest(self) -> None:
        """Go back to the end of the log, if what lies there was dropped for older lines."""
        if not self._is_newest:
            self.forget()
        await self.look()

    def _held_bytes(self) -> int:
        return sum(piece.end - piece.begin for piece in self._pieces)

    async def _ask(self, request: GetPlannerLog) -> PlannerLogPiece | None:
        reply = await self._requests.send(request)
        piece = reply.planner_log
        self.problem = "" if piece is not None else reply.text
        if piece is not None:
            self.left_out, self.path = piece.left_out, piece.path
        return piece
