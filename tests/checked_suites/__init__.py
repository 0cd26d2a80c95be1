"""Lets .ci/run measure a sample of the suites where all of them passed with the same sources.

`python -m tests.checked_suites keep RESULTS`, after `make regression`, writes figures.json: the
version of the code that makes results, and the figures of all flights.

`python -m tests.checked_suites sample RESULTS` holds these figures against the accepted ones anew,
measures some flights of each suite, and compares.

Exit codes are those of `airground check`, and 3 where the suites must run whole: sources changed,
other metrics are watched, or another processor rounds differently.
"""
