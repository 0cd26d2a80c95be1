"""`report.html`: tables, figures with captions, and what they say."""
