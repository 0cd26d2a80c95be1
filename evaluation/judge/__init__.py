"""What results mean: metrics, summary, claims, verdicts."""
