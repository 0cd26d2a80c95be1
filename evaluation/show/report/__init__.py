"""`report.html`: headline numbers, tables, and figures with captions."""
