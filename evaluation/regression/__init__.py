"""Did a change make it better or worse: watched metrics, accepted figures, verdicts."""
