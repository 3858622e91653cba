"""``scripts/where.py WORD...``: places in the source that have every word in name, description, value or text.

Best first, ten lines at most: file and line, name, value, what is said of it. Endings do not matter (``landed`` finds
``landing``), words that mean about the same count a little, and so does what the index of ARCHITECTURE.md and the
glossary call a place. Near misses say which word they lack.
"""

import os
import sys

from finding.answer import main

if __name__ == "__main__":
    try:
        code = main()
        sys.stdout.flush()
    except BrokenPipeError:  # the reader, such as `head`, has enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    sys.exit(code)
