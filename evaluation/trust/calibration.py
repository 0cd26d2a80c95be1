"""Whether the particles know how wrong they are: errors against their spread (Fig. 11 and 12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import chi2, spearmanr

from evaluation.results.table import SEQUENCE_KEYS, ResultTable
from evaluation.statistics.intervals import Rate, wilson

METRIC = "squared_mahalanobis"
"""Of the stage "localization"."""
ELLIPSES = (0.50, 0.90, 0.99)
"""Shares of a Gaussian that lie in the ellipses that are looked at."""
FREEDOM = 2
"""Degrees of freedom of a horizontal position."""


@dataclass(frozen=True)
class Localizations:
    """All that localization said of its own errors, one entry an aerial map.

    Attributes:
        error_m, spread_m: (N,) horizontal error and the particles' standard deviation [m].
        squared_mahalanobis: (N,) of the true position in the particles' covariance.
        accepted: (N,) whether a position was claimed.
    """

    error_m: NDArray[np.float64]
    spread_m: NDArray[np.float64]
    squared_mahalanobis: NDArray[np.float64]
    accepted: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.accepted)

    def only_accepted(self) -> Localizations:
        """Those that claim a position."""
        kept = self.accepted
        return Localizations(
            self.error_m[kept], self.spread_m[kept], self.squared_mahalanobis[kept], kept[kept]
        )

    def coverage(self, share: float) -> Rate:
        """How often the truth lies in the ellipse that holds this share of a Gaussian."""
        inside = self.squared_mahalanobis <= chi2.ppf(share, FREEDOM)
        return wilson(int(inside.sum()), len(self))

    def mean_normalized_error(self) -> float:
        """Mean NEES over its degrees of freedom: 1 is right, above is too sure; NaN for none."""
        return float(self.squared_mahalanobis.mean() / FREEDOM) if len(self) else float("nan")

    def median_normalized_error(self) -> float:
        """Median NEES over a Gaussian's: 1 is right, and outliers do not matter; NaN for none."""
        if len(self) == 0:
            return float("nan")
        return float(np.median(self.squared_mahalanobis) / chi2.ppf(0.5, FREEDOM))

    def rank_correlation(self) -> float:
        """Spearman's, of spread and error: 1 where a larger spread always means a larger error.

        NaN for fewer than three localizations, or where one of both never changes.
        """
        if len(self) < 3 or np.ptp(self.error_m) == 0 or np.ptp(self.spread_m) == 0:
            return float("nan")
        return float(spearmanr(self.spread_m, self.error_m).statistic)


def localizations(table: ResultTable) -> Localizations:
    """All beliefs of a table; aerial maps that never came gave none."""
    keys = [*SEQUENCE_KEYS, "iteration"]
    metrics = ["error_m", "spread_m", METRIC, "converged"]
    frame = table.frame[
        (table.frame["stage"] == "localization") & table.frame["metric"].isin(metrics)
    ]
    wide = frame.pivot(index=keys, columns="metric", values="value").reindex(columns=metrics)
    believed = wide[wide[METRIC].notna()]
    error_m, spread_m, distance, converged = (_column(believed, name) for name in metrics)
    return Localizations(error_m, spread_m, distance, converged > 0)


def _column(frame: pd.DataFrame, name: str) -> NDArray[np.float64]:
    return frame[name].to_numpy(np.float64)
