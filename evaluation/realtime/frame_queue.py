"""The bounded buffer in front of a tracker.

Nobody has to stand at the door: frames come by their stamps and leave when the tracker takes
them, so that whoever was let in, and whom the full buffer turned away, is known exactly
whenever the tracker looks.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence


class FrameQueue:
    """Frames that come on their own schedule, and are dropped whole where there is no room.

    Args:
        stamps_ns: When each frame comes, in order of time.
        capacity: How many may wait, besides the one that is being tracked.

    Attributes:
        dropped: Indices of the frames that found the buffer full.
        longest: The most that ever waited.
    """

    def __init__(self, stamps_ns: Sequence[int], capacity: int) -> None:
        self._stamps_ns, self._capacity = stamps_ns, capacity
        self._waiting: deque[int] = deque()
        self._next = 0
        self.dropped: list[int] = []
        self.longest = 0

    def take(self, now_ns: int) -> int | None:
        """Index of the frame to track next; it may still have to come. None after the last."""
        while self._next < len(self._stamps_ns) and self._stamps_ns[self._next] <= now_ns:
            if len(self._waiting) < self._capacity:
                self._waiting.append(self._next)
            else:
                self.dropped.append(self._next)
            self._next += 1
        self.longest = max(self.longest, len(self._waiting))
        if self._waiting:
            return self._waiting.popleft()
        if self._next == len(self._stamps_ns):
            return None
        self._next += 1
        return self._next - 1
