"""A run to look into with rerun: every stage in sensor time, as it happened.

One file draws one thing from the pipeline's events; `run_view.py` joins them, `layout.py` says
where each is shown, `viewer.py` opens what was written. Truth lies under `/truth` alone.
"""
