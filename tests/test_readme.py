"""The README says what is so."""

from pathlib import Path

from sitl.hybrid.supervisor import diagram

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_supervisors_diagram_is_generated_from_its_table():
    shown = README.split("<!-- supervisor diagram: begin -->\n")[1].split("<!-- supervisor diagram: end -->")[0]
    assert shown == f"```mermaid\n{diagram()}\n```\n"


def test_every_file_it_names_is_there():
    for name in ("docs/screenshot.svg", "docs/model.md", "docs/figures.md", "scripts/fly", "scripts/test"):
        assert name in README
        assert (ROOT / name).exists()
