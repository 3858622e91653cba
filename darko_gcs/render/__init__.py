"""Drawing as pure functions: numbers in, styled text out."""
