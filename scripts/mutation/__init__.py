"""Parts of mutate.py: the changes it makes, and what it adds to pytest."""
