"""The README says what is so."""

import re
from pathlib import Path

from sitl.hybrid.supervisor import diagram

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_supervisors_diagram_is_generated_from_its_table():
    shown = README.split("<!-- supervisor diagram: begin -->\n")[1].split("<!-- supervisor diagram: end -->")[0]
    assert shown == f"```mermaid\n{diagram()}\n```\n"


def test_every_file_it_names_is_there():
    named = set(re.findall(r"(?:docs|scripts|tests)/[\w./-]*\w", README))
    assert {"docs/screenshot.svg", "docs/laws.md", "scripts/fly", "scripts/test"} <= named
    assert not [name for name in named if not (ROOT / name).exists()]


def test_every_page_of_the_documentation_is_named():
    assert not [page.name for page in (ROOT / "docs").glob("*.md") if f"docs/{page.name}" not in README]
