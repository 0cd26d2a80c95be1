"""Results for people: figures, report, comparison, gallery, rerun."""
