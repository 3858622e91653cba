"""The README and the other pages name what is there, and the supervisor's diagram is that of its table."""

import re
from pathlib import Path

from sitl.supervisor.table import diagram

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
SUPERVISOR = (ROOT / "docs" / "supervisor.md").read_text(encoding="utf-8")
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]
SOURCES = ("sitl", "protocol", "darko_gcs", "scripts", "tests")


def missing(pattern, exists):
    """Names on the pages that match a pattern and do not exist, each with the page."""
    named = [(page, name) for page in PAGES for name in re.findall(pattern, page.read_text(encoding="utf-8"))]
    assert named
    return sorted({(page.name, name) for page, name in named if not exists(page, name)})


def anchors(page):
    """The names of a page's headings in links."""
    headings = re.findall(r"^#+ (.*)", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_the_supervisors_diagram_is_generated_from_its_table():
    shown = SUPERVISOR.split("<!-- supervisor diagram: begin -->\n")[1].split("<!-- supervisor diagram: end -->")[0]
    assert shown == f"```mermaid\n{diagram()}\n```\n"


def test_every_file_a_page_names_is_there():
    pattern = r"(?:\b(?:docs|scripts|tests)|`(?:sitl|protocol|darko_gcs))/[\w./-]*\w"
    assert missing(pattern, lambda _, name: (ROOT / name.lstrip("`")).exists()) == []


def test_every_module_a_page_names_without_its_folder_is_there():
    there = {path.name for folder in SOURCES for path in (ROOT / folder).rglob("*.py")}
    assert missing(r"`(\w+\.py)`", lambda _, name: name in there) == []


def test_every_test_a_page_names_is_there():
    written = set(re.findall(r"def (test_\w+)", "".join(p.read_text() for p in (ROOT / "tests").rglob("test_*.py"))))
    assert missing(r"`(test_\w+)`", lambda _, name: name in written) == []


def test_every_link_between_pages_leads_somewhere():
    def leads(page, link):
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        return target.exists() and (not anchor or anchor in anchors(target))

    assert missing(r"\]\((?!https?:)([^)\s]+)\)", leads) == []


def test_the_readme_names_every_page_and_is_short():
    pages = [page.relative_to(ROOT).as_posix() for page in PAGES if page.name != "README.md"]
    assert [page for page in pages if f"]({page})" not in README] == []
    assert len(README.splitlines()) < 120
