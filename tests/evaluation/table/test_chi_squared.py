"""Quantiles of distributions."""

from __future__ import annotations

from scipy.stats import chi2

from evaluation.table.chi_squared import chi2_quantile


def test_quantiles_of_chi2_are_those_of_scipy_stats() -> None:
    for freedom in (1, 2, 3, 6):
        for share in (0.5, 0.68, 0.9, 0.95, 0.99):
            assert chi2_quantile(share, freedom) == chi2.ppf(share, freedom)
