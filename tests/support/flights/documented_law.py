"""The law of docs/api.md, as its example registers it."""

import re
from typing import Any

from tests.support.paths import DATA

PAGE = (DATA.parents[1] / "docs" / "api.md").read_text(encoding="utf-8")


def example():
    """The names that the example defines before it flies."""
    found = re.search(r"^## A law of your own\n.*?```python\n(.*?)^simulation = ", PAGE, re.DOTALL | re.MULTILINE)
    assert found is not None
    names: dict[str, Any] = {"__name__": "documented_law"}
    exec(compile(found[1], "docs/api.md", "exec"), names)  # noqa: S102 - ours
    return names


EXAMPLE = example()
CLIMB, REGISTER = EXAMPLE["OwnLaw"].CLIMB, EXAMPLE["register"]
ROW, JUMPS = REGISTER.laws[CLIMB], REGISTER.table[CLIMB]
STATES, GAINS = {"climbed": EXAMPLE["ClimbState"]}, REGISTER.gains
