"""One flight looked at closely, and the pictures drawn from it."""
