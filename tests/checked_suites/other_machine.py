"""Whether flights that another machine measured are as good as those of the suites that passed.

Another processor rounds otherwise, and a flight then ends elsewhere within what chance decides. So
its figures must not be worse than those of the suite's worst flight by more than a margin: half
of the range of all flights, or what matters for the metric, or one where a metric counts. Of the
first 19 flights that two processors measured, none was worse by more than 0.23 of the range, and
one had an aerial map fewer.
"""

from __future__ import annotations

from collections.abc import Iterator

from evaluation.judge.accepted import Measured, figure, flight_value
from evaluation.judge.metrics import WATCHED, Metric
from evaluation.judge.samples import Flight, Samples

SHARE_OF_RANGE = 0.5
ONE_COUNTED = 1.0


def as_good(before: Measured, after: Measured, flight: Flight) -> bool:
    """Whether no watched metric of a flight is worse than those of `before` by its margin."""
    return not list(worse_metrics(before, after, flight))


def worse_metrics(before: Measured, after: Measured, flight: Flight) -> Iterator[str]:
    """The names of the metrics by which a flight is too bad, or not to be compared."""
    for metric in WATCHED:
        known, found = before.samples[metric.name], after.samples[metric.name].get(flight)
        if (flight in known) != (found is not None):
            yield metric.name
        elif found is not None:
            sign = 1.0 if metric.better == "lower" else -1.0
            worst = max(sign * flight_value(metric, values) for values in known.values())
            # A failure may be infinite: then another failure is as good.
            if sign * flight_value(metric, found) > worst + margin(metric, known):
                yield metric.name


def margin(metric: Metric, known: Samples) -> float:
    """How much worse than the worst of these flights another may be, in the metric's unit."""
    values = [flight_value(metric, of_flight) for of_flight in known.values()]
    finite = [value for value in values if abs(value) != float("inf")]
    spread = SHARE_OF_RANGE * (max(finite) - min(finite)) if finite else 0.0
    matters = metric.matters * (abs(figure(metric, known)) if metric.relative else 1.0)
    return max(spread, matters, ONE_COUNTED if metric.unit == "count" else 0.0)
