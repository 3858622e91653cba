"""The report's experiments as named scenarios, and the runner that flies them as fast as possible."""
