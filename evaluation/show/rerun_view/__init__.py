"""A run to look into with rerun: every stage in sensor time, as it happened.

Entities under `/truth` show what only the evaluator knows."""
