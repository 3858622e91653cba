"""Private names of other packages, which any release may rename, are not used: but two, each for its reason.

A name that this project defines, too, is not told from theirs.
"""

import ast
import importlib.util
import inspect
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
TREES = ("sitl", "darko_gcs", "protocol", "scripts", "tests")
OTHERS = ("textual", "numba", "hypothesis", "xdist", "_pytest", "pyulog")
PRIVATE = re.compile(r"_[a-z]\w*")
USED = {"_compositor": "of Textual, by tests alone: nothing public gives the text on a screen"}
OVERRIDDEN = {"_handle_exception": "an error in Textual's own timers, workers and widgets comes to nothing public"}


@cache
def defined_by_others():
    """Private names of functions, classes and attributes."""
    names = set()
    for package in OTHERS:
        folder = Path(importlib.util.find_spec(package).origin).parent
        text = "\n".join(path.read_text(encoding="utf-8") for path in folder.rglob("*.py"))
        names |= set(re.findall(r"(?:\b(?:def|class) |\bself\.|^    )(_[a-z]\w*)\b(?=\(|:| = )", text, re.MULTILINE))
    return names


def private_names(tree):
    """Private names that a module uses, in attributes, imports and texts, and those that it defines."""
    used, defined = set(), set()
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(value=ast.Name(id="os")):  # ``os._exit`` is documented
                pass
            case ast.Attribute(attr=name, ctx=ast.Load()) | ast.Constant(value=str(name)):
                used.add(name)
            case ast.ImportFrom(module=str(module), names=aliases) if module.split(".")[0] in OTHERS:
                used |= {*module.split("."), *(alias.name for alias in aliases)}
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                defined.add(name)
            case ast.Attribute(attr=name) | ast.Name(id=name, ctx=ast.Store()):
                defined.add(name)
    return {name for name in used if PRIVATE.fullmatch(name)}, defined


@pytest.mark.long
def test_no_private_name_of_another_package_is_used():
    modules = [ast.parse(path.read_text(encoding="utf-8")) for tree in TREES for path in (ROOT / tree).rglob("*.py")]
    used, defined = (set().union(*names) for names in zip(*map(private_names, modules), strict=True))
    foreign = {name for name in used - defined if name in defined_by_others()}
    assert foreign == USED.keys()


def test_no_private_name_of_textual_is_overridden():
    overridden = {}
    for path in (ROOT / "darko_gcs" / "tui").rglob("*.py"):
        module = importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
        for _, kind in inspect.getmembers(module, inspect.isclass):
            theirs = [base for base in kind.__mro__ if base.__module__.split(".")[0] == "textual"]
            if kind.__module__ == module.__name__ and theirs:
                names = {
                    name for name, own in vars(kind).items() if PRIVATE.fullmatch(name) and inspect.isfunction(own)
                }
                overridden |= {name: kind for name in names if any(name in vars(base) for base in theirs)}
    assert overridden.keys() == OVERRIDDEN.keys()
