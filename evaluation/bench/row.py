"""What a row of the benchmark is: some work, what the paper took for it, who else does it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from evaluation.bench.material import Material
from evaluation.setup.published import TABLE_I, TimedStage


@dataclass(frozen=True)
class Speed:
    """What a number of cores can do at best, as probed.

    Attributes:
        bytes_per_s: To and from memory.
        operations_per_s: float32 additions and multiplications.
    """

    bytes_per_s: float
    operations_per_s: float

    def at_least(self, other: Speed) -> Speed:
        """The higher of both, figure by figure."""
        return Speed(
            max(self.bytes_per_s, other.bytes_per_s),
            max(self.operations_per_s, other.operations_per_s),
        )


@dataclass(frozen=True)
class Floor:
    """What any program must do for one call of a row, whoever writes it.

    Attributes:
        bytes_moved: To and from memory, where it fits no cache.
        operations: float32 additions and multiplications.
    """

    bytes_moved: float
    operations: float

    def __add__(self, other: Floor) -> Floor:
        return Floor(self.bytes_moved + other.bytes_moved, self.operations + other.operations)

    def __mul__(self, count: float) -> Floor:
        return Floor(count * self.bytes_moved, count * self.operations)

    def least_ms(self, speed: Speed) -> float:
        """The time where memory and arithmetic overlap perfectly [ms]."""
        seconds = max(
            self.bytes_moved / speed.bytes_per_s, self.operations / speed.operations_per_s
        )
        return 1e3 * seconds


def _nothing() -> None:
    pass


@dataclass(frozen=True, eq=False)
class Work:
    """Something to time.

    Attributes:
        run: One call of it.
        before: What must be in place before each call, and is not timed.
        size: How large it is, in words.
        floor: The least that it takes; None where nobody can say.
    """

    run: Callable[[], object]
    before: Callable[[], None] = _nothing
    size: str = ""
    floor: Floor | None = None


@dataclass(frozen=True)
class Peer:
    """What a user would take from another library.

    Attributes:
        name: For readers.
        package: The module that it needs.
        differs: How its work differs from ours.
        make: From the material to the work.
    """

    name: str
    package: str
    differs: str
    make: Callable[[Material], Work]


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        stage: Name, title, group, and what the paper took.
        make: From the material to the work.
        target_ms: What we want on two idle cores, in the median [ms]; None where no aim is set.
        peers: Who else does it.
    """

    stage: TimedStage
    make: Callable[[Material], Work]
    target_ms: float | None = None
    peers: tuple[Peer, ...] = ()

    @property
    def name(self) -> str:
        return self.stage.metric

    def peer(self, name: str) -> Peer:
        """The peer of that name."""
        return next(peer for peer in self.peers if peer.name == name)


class Contender(NamedTuple):
    """A row's own work, or a peer's."""

    row: str
    peer: str | None = None


def of_table(metric: str) -> TimedStage:
    """A stage of Table I by its name."""
    return next(stage for stage in TABLE_I if stage.metric == metric)
