"""Section VI: height maps, cost maps and Monte Carlo localization."""
