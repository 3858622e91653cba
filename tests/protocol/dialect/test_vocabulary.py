"""Each value of DarkO's own enums has one name and one label."""

import sys
from types import ModuleType

import pytest

from protocol.dialect import mavlink, vocabulary
from protocol.dialect.vocabulary import LabelledEnum, LabelledFlags, Law, Limit, Reason, Regime, Saturation
from tests.support.paths import DATA

ROOT = DATA.parents[1]
XML = ROOT / "protocol" / "dialect" / "darko.xml"
CLASSES = {
    kind.__name__: kind
    for kind in vars(vocabulary).values()
    if isinstance(kind, type)
    and issubclass(kind, LabelledEnum | LabelledFlags)
    and kind not in {LabelledEnum, LabelledFlags}
}
NAMED_OTHERWISE = {"DARKO_JUMP_REASON": Reason}
ENUMS = [name for name in mavlink.enums if name.startswith("DARKO_")]


@pytest.fixture(scope="module")
def build():
    """The script that generates the module, without the build tool that calls it."""
    interface = ModuleType("hatchling.builders.hooks.plugin.interface")
    interface.BuildHookInterface = object
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, interface.__name__, interface)
        from scripts import build_dialect

        yield build_dialect


def class_of(enum):
    return NAMED_OTHERWISE.get(enum) or CLASSES[enum.removeprefix("DARKO_").title().replace("_", "")]


@pytest.mark.parametrize("enum", ENUMS)
def test_every_number_of_the_dialect_has_one_member(enum):
    entries = {number: entry.name for number, entry in mavlink.enums[enum].items() if "_ENUM_END" not in entry.name}
    members = {int(member): f"{enum}_{name}" for name, member in class_of(enum).__members__.items()}
    assert members == entries


def test_there_is_one_class_for_every_enum():
    assert {class_of(enum) for enum in ENUMS} == set(CLASSES.values())
    assert len(ENUMS) == len(CLASSES)


@pytest.mark.parametrize("kind", CLASSES.values())
def test_every_member_has_its_own_label(kind):
    labels = [member.label for member in kind]
    assert all(labels)
    assert len(set(labels)) == len(kind)


def test_every_law_belongs_to_a_regime():
    assert {law.regime for law in Law} == set(Regime)
    assert [law.name for law in Law if law.regime is Regime.FORWARD] == ["FORWARD_LINE_OF_SIGHT", "FORWARD_LINEAR"]


def test_a_number_that_is_not_in_the_dialect_is_an_error():
    with pytest.raises(ValueError, match=f"{len(Law)} is not a valid Law"):
        Law(len(Law))


def test_the_label_of_flags_lists_all_set_bits():
    assert (Saturation.ROLL | Saturation.YAW).label == "yaw, roll"
    assert Limit(0).label == ""


def test_the_wire_has_room_for_the_energy_of_every_law():
    message = mavlink.MAVLink_darko_energy_message
    lengths = dict(zip(message.ordered_fieldnames, message.array_lengths, strict=True))
    assert max(Law) < lengths["energy_by_law"]


def test_the_module_is_generated_from_the_present_dialect(build, tmp_path):
    build.generate_vocabulary(XML, tmp_path / "vocabulary.py")
    assert (tmp_path / "vocabulary.py").read_text() == (XML.parent / "vocabulary.py").read_text()


@pytest.mark.parametrize(
    ("said", "instead", "complaint"),
    [
        (
            'LANDED"><?darko regime="GROUND"',
            'LANDED"><?darko regime="WATER"',
            "DARKO_LAW_LANDED: it names no entry of DARKO_REGIME",
        ),
        ('LANDED"><?darko regime="GROUND"?>', 'LANDED">', "DARKO_LAW_LANDED: it names no entry of DARKO_REGIME"),
        (
            'value="3" name="DARKO_LAW_ALIGN"',
            'value="2" name="DARKO_LAW_ALIGN"',
            "LAW: two entries have the same value",
        ),
        ('label="motor L"', 'label="motor R"', "DARKO_LIMIT: two entries have the same label"),
    ],
)
def test_an_ambiguous_dialect_is_not_built(build, tmp_path, said, instead, complaint):
    text = XML.read_text()
    assert text.count(said) == 1
    (tmp_path / "darko.xml").write_text(text.replace(said, instead))
    with pytest.raises(RuntimeError, match=complaint):
        build.generate_vocabulary(tmp_path / "darko.xml", tmp_path / "vocabulary.py")
    assert not (tmp_path / "vocabulary.py").exists()
