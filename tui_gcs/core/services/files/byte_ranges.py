"""A set of bytes of a file that have arrived, kept as half-open ranges."""

from bisect import bisect_left, bisect_right


class ByteRanges:
    """Half-open ranges in ascending order that never touch each other."""

    def __init__(self, ranges: list[tuple[int, int]] | None = None) -> None:
        """Start with `ranges`, each (first byte, last byte + 1)."""
        self._starts: list[int] = []
        self._ends: list[int] = []
        self.held = 0
        """How many bytes the set contains."""
        for start, end in ranges or []:
            self.add(start, end)

    def add(self, start: int, end: int) -> int:
        """Add the bytes from `start` up to, but not including, `end`, and return how many of them are new."""
        if end <= start:
            return 0
        # Touching ranges are merged, so that a file that is read in order stays one range however many packets bring
        # it.
        first = bisect_left(self._ends, start)
        last = bisect_right(self._starts, end)
        before = sum(self._ends[i] - self._starts[i] for i in range(first, last))
        if first < last:
            start, end = min(start, self._starts[first]), max(end, self._ends[last - 1])
        self._starts[first:last], self._ends[first:last] = [start], [end]
        self.held += end - start - before
        return end - start - before

    def clear(self) -> None:
        """Remove all ranges from the set."""
        self._starts, self._ends, self.held = [], [], 0

    def first_gap(self) -> tuple[int, int | None]:
        """Return the first missing bytes as (begin, end). `end` is None if nothing beyond the gap has arrived."""
        if not self._starts or self._starts[0] > 0:
            return 0, self._starts[0] if self._starts else None
        return self._ends[0], self._starts[1] if len(self._starts) > 1 else None

    @property
    def pieces(self) -> int:
        """How many separate ranges there are."""
        return len(self._starts)

    @property
    def end(self) -> int:
        """The position after the last byte of the set; 0 if it is empty."""
        return self._ends[-1] if self._ends else 0

    def covers(self, size: int) -> bool:
        """Whether all bytes below `size` are in the set."""
        return size <= 0 or (bool(self._starts) and self._starts[0] <= 0 and self._ends[0] >= size)
