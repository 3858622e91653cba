"""Control laws as pure functions: one law per file, state and gains passed in, nothing kept."""
