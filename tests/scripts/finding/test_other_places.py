"""Places in tables of values, styles, pages' scripts, C and the dialect."""

from scripts.finding.other_places import other_places


def found(path, text):
    return [(place.line, place.name, place.value, place.about) for place in other_places(path, text)]


def test_a_value_with_unit_and_source_is_one_place():
    text = (
        '# Numbers\n\n[gnss.delay]\nvalue = 0.12\nunit = "s"\nsource = "a manual"\n\n'
        "[require]\n# of all\nshare = 0.9  # at least\n"
    )
    assert found("a.toml", text) == [
        (1, "", "", "Numbers"),
        (3, "gnss.delay", "0.12", "s a manual"),
        (8, "require", "", ""),
        (10, "require.share", "0.9", "at least; of all"),
    ]


def test_rules_of_a_style_sheet_are_found_by_selector_and_say_what_they_set():
    text = "/* Colours */\nScreen {\n    color: $accent;\n    height: 1;\n}\n.dim { color: grey; }\n"
    assert found("a.tcss", text)[1:] == [
        (2, "Screen", "", "color: $accent; height: 1;"),
        (6, ".dim", "", "color: grey;"),
    ]


def test_functions_of_scripts_and_of_c_have_the_comment_above_them():
    script = "// A view\n// turns it\nexport function turn(angle) {\n"
    assert found("a.js", script) == [(1, "", "", "A view"), (3, "turn", "", "A view turns it")]
    code = (
        "/* A tick. */\n#include <math.h>\n#define MAX 3\n/* One period. */\nvoid tick(State *s) {\n    turn(s);\n}\n"
    )
    assert [name for _, name, _, _ in found("a.c", code)] == ["", "MAX", "tick"]
    assert found("a.c", code)[-1] == (5, "tick", "", "One period.")


def test_messages_and_entries_of_the_dialect_have_their_description():
    text = (
        '<?xml version="1.0"?>\n<!-- Ours. -->\n<message id="1" name="JUMP">\n  <description>One jump.</description>\n'
        '<entry value="2" name="LAW_INDI"><description>Increments.</description></entry>\n'
    )
    assert found("a.xml", text) == [
        (1, "", "", "Ours."),
        (3, "JUMP", "", "One jump."),
        (5, "LAW_INDI", "", "Increments."),
    ]
