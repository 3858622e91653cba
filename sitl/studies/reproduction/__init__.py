"""The report's experiments flown again: each beside what the report says of it, with a verdict and its cause."""
