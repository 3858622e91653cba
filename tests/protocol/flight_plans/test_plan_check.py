"""Check of a plan: constructs that are flown, refusals by construct, and a user's meanings for names."""

import pytest

from protocol.flight_plans import FlightPlanError, load_flight_plan, read_flight_plan
from protocol.flight_plans.expressions import expression_text
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.plan_names import FUNCTIONS, load_name_mapping, parse_name_mapping
from protocol.flight_plans.plan_package import render_flight_plan
from tests.support.plans import VOLIERE, plan_of, plan_text, public_plans


def findings(blocks, before="", mapping=""):
    check = check_flown(plan_of(blocks, before), parse_name_mapping(mapping, "m.toml"))
    return [(finding.construct, finding.block) for finding in check.refusals]


def block(inner):
    return f'<block name="a"/><block name="b">{inner}</block>'


def test_the_room_is_flown_without_a_rest():
    check = check_flown(load_flight_plan(VOLIERE))
    assert check.findings == ()
    check.require_flown()


@pytest.mark.parametrize(
    ("stage", "construct"),
    [
        ('<call fun="nav_fish_run()"/>', "nav_fish_run()"),
        ('<call_once fun="NavSetWaypointHere()"/>', "NavSetWaypointHere()"),
        ('<set var="autopilot.mode" value="1"/>', "set autopilot.mode"),
        ('<go wp="Z"/>', "waypoint 'Z'"),
        ('<deroute block="c"/>', "deroute 'c'"),
        ('<exception cond="1" deroute="c"/>', "deroute 'c'"),
        ('<set var="nav.radius" value="speed"/>', "speed"),
        ('<stay wp="A" until="$i == 2"/>', "$i"),
        ('<stay wp="A" until="InsideNowhere(1, 2)"/>', "InsideNowhere()"),
        ('<stay wp="A" until="WaypointX(WP_Q) == 2"/>', "WP_Q"),
        ('<stay wp="A" until="stateGetPositionEnu_f()"/>', "stateGetPositionEnu_f()"),
        ('<stay wp="A" until="stateGetPositionEnu_f()->w"/>', "stateGetPositionEnu_f()->w"),
        ('<stay wp="A" until="nav_block == IndexOfBlock(\'c\')"/>', "'c'"),
        ('<stay wp="A" until="\'a\' == 1"/>', "'a'"),
        ('<stay wp="A" until="waypoints[2] == 1"/>', "waypoints[]"),
        ('<set var="waypoints[WP_Q].a" value="2"/>', "WP_Q"),
        ('<set var="WaypointAlt(WP_A)" value="sonar"/>', "sonar"),
        ('<call_once fun="nav_fish_setup()"/>', "nav_fish_setup()"),
        ('<call fun="payload_run()"/>', "payload_run()"),
        ('<attitude roll="0" pitch="sonar"/>', "sonar"),
        ('<guided commands="1,2"/>', "<guided> commands"),
        ('<stay wp="A" vmode="climb"/>', "vmode 'climb'"),
        ('<go wp="A" vmode="glide"/>', "vmode 'glide'"),
        ('<go wp="A" nav_type="spiral"/>', "nav_type 'spiral'"),
        ('<call_once fun="increase_nav_heading(1, 2)"/>', "increase_nav_heading()"),
        ('<while cond="1"><stay wp="A" until="sonar"/></while>', "sonar"),
    ],
)
def test_a_refusal_locks_its_block(stage, construct):
    assert findings(block(stage)) == [(construct, "b")]


def test_a_block_and_home_are_known_by_their_titles():
    stage = '<stay wp="A" until="nav_block == IndexOfBlock(\'{}\')"/>'
    assert [findings(block(stage.format(title))) for title in ("a", "HOME")] == [[], []]


def test_a_refusal_has_its_place():
    check = check_flown(plan_of(block('<stay wp="A" until="1 @AND sonar"/>')))
    (refusal,) = check.refusals
    assert str(refusal) == "t.xml:3:69: sonar: no such variable or constant"
    assert check.locked_blocks == {"b": refusal}
    check.require_flown()


def test_a_refusal_outside_of_blocks_refuses_the_plan():
    check = check_flown(plan_of(block(""), '<variables><variable var="v" init="sonar"/></variables>'))
    assert [finding.block for finding in check.refusals] == [None]
    with pytest.raises(FlightPlanError, match="sonar: no such variable"):
        check.require_flown()


@pytest.mark.parametrize(
    ("stage", "construct"),
    [
        ('<call_once fun="jevois_stream(sonar)"/>', "jevois_stream(sonar)"),
        ('<call fun="DropOpen()"/>', "DropOpen()"),
        ('<stay wp="A" pre_call="dc_Survey(40)"/>', "dc_Survey(40)"),
        ('<call_once fun="LED_ON(2); NavResurrect()"/>', "LED_ON(2)"),
        ('<set var="camera_status" value="MODULES_START"/>', "set camera_status"),
        ('<set var="camera_gain" value="CAMERA_GAIN"/>', "set camera_gain"),
        ('<set var="ap_state->commands[COMMAND_YAW]" value="-MAX_PPRZ"/>', "set ap_state.commands[COMMAND_YAW]"),
        ('<exception cond="sonar" deroute="a"/>', "sonar"),
        ('<exception cond="tag.status == TAG_FOUND" deroute="a"/>', "tag.status"),
    ],
)
def test_what_a_build_does_beside_flying_is_left_out(stage, construct):
    check = check_flown(plan_of(block(stage)))
    assert check.refusals == ()
    assert [(finding.construct, finding.block) for finding in check.notices] == [(construct, "b")]


def test_an_exception_of_the_plan_that_only_a_build_could_answer_is_left_out():
    check = check_flown(plan_of(block(""), '<exceptions><exception cond="sonar" deroute="a"/></exceptions>'))
    check.require_flown()
    (notice,) = check.notices
    assert "the exception to a is left out" in str(notice)
    assert check.left_out == {check.plan.exceptions[0].place}


def test_a_variable_of_a_build_that_the_plan_sets_is_the_plans_own():
    stages = '<set var="distance" value="10"/><stay wp="A" until="distance > 5"/>'
    check = check_flown(plan_of(block(stages)))
    assert (check.refusals, check.adopted) == ((), {"distance"})
    unknown = check_flown(plan_of(block(stages.replace('"10"', '"sonar"'))))
    assert (unknown.adopted, [finding.construct for finding in unknown.refusals]) == (frozenset(), ["distance"])


def test_the_pitch_of_a_stage_that_holds_its_height_is_not_looked_at():
    assert findings(block('<circle wp="A" radius="5" pitch="my_pitch"/>')) == []


def test_macros_of_the_header_mean_what_they_say():
    header = """<header>
    #include "x.h"
    #define LIMIT 10 // metres
    #define HIGH (LIMIT + 5)
    #define Neq(a, b) (a != b)
    #define DropOpen SwitchServoOff
    #define LINE_START dc_Survey(40);
    </header>"""
    stages = (
        '<stay wp="A" until="Neq(stage_time, HIGH) @AND GetPosAlt() > LIMIT"/><call_once fun="DropOpen(1)"/>'
        '<exception cond="Neq(1, 2, 3)" deroute="a"/>'
    )
    text = plan_text(block(stages)).replace("<waypoints>", header + "<waypoints>")
    plan = read_flight_plan(text.encode(), "t")
    check = check_flown(plan)
    assert check.refusals == ()
    assert [finding.construct for finding in check.notices] == ["SwitchServoOff(1)", "Neq()"]
    until = plan.blocks[1].stages[0].until
    assert expression_text(until.tree) == "stage_time != 10 + 5 @AND GetPosAlt() @GT 10"
    assert read_flight_plan(render_flight_plan(plan).encode(), "again") == plan


def with_header(defines, stage):
    header = "<header>\n" + "\n".join(f"#define {define}" for define in defines) + "\n</header>"
    return read_flight_plan(plan_text(block(stage)).replace("<waypoints>", header + "<waypoints>").encode(), "t")


def test_a_macro_of_itself_is_a_name_that_nobody_knows():
    check = check_flown(with_header(["A A + 1"], '<stay wp="A" until="A"/>'))
    assert {finding.construct for finding in check.refusals} == {"A"}


def test_macros_that_grow_beyond_all_measure_are_refused():
    defines = [f"A{n} (A{n + 1} + A{n + 1} + A{n + 1} + A{n + 1})" for n in range(9)]
    with pytest.raises(FlightPlanError, match="more than 2000 parts"):
        with_header(defines, '<stay wp="A" until="A0"/>')


def test_a_plan_without_a_block_to_fly_is_refused():
    with pytest.raises(FlightPlanError, match="sonar"):
        check_flown(plan_of('<block name="a"><stay wp="A" until="sonar"/></block>')).require_flown()


def test_what_belongs_to_a_build_is_a_notice():
    before = '<sectors><kml file="x.kml"/></sectors><variables><abi_binding name="N" vars="far, near"/></variables>'
    check = check_flown(
        plan_of(block('<stay wp="A" until="far > near"/>'), before + '<modules><module name="m"/></modules>')
    )
    assert check.refusals == ()
    assert {finding.construct for finding in check.notices} == {"abi_binding N", "module m", "kml x.kml"}


def test_loops_variables_and_pitch_auto_are_known():
    inner = (
        '<for var="i" from="0" to="2"><circle wp="A" radius="$i" pitch="auto" until="v"/></for><set var="v" value="1"/>'
    )
    assert findings(block(inner), '<variables><variable var="v"/></variables>') == []


@pytest.mark.parametrize(
    "stage",
    [
        '<follow ac_id="1" distance="1" height="1"/>',
        '<manual roll="0" yaw="0" pitch="0"/>',
        '<attitude roll="10" pitch="-5" vmode="alt"/>',
        '<stay wp="A" vmode="xyz"/>',
    ],
)
def test_every_stage_is_flown(stage):
    assert findings(block(stage)) == []


def test_a_mapping_gives_names_a_meaning():
    stages = (
        '<call fun="nav_fish_run(1, 2, 3)"/><call_once fun="Here(WP_A)"/>'
        '<set var="gain" value="electrical.current"/><set var="AP_MODE_GUIDED" value="1"/>'
    )
    mapping = """
    [functions]
    nav_fish_run = 0
    Here = "NavSetWaypointHere"
    [variables]
    gain = "nav.radius"
    AP_MODE_GUIDED = 19
    electrical.current = 2.5
    """
    assert findings(block(stages)) == [("nav_fish_run()", "b")]
    assert findings(block(stages), mapping=mapping) == []


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[function]\nf = 1", "unknown table [function]"),
        ("[functions]\nf = 'g'", "'g' is not a known function"),
        ("[variables]\nf = 'g'", "'g' is not a known variable"),
        ("[functions]\nGetPosX = 1", "is known already"),
        ("[functions]\nf = [1]", "neither a number nor a known name"),
        ("[functions]\nf = nan", "neither a number nor a known name"),
        ("[functions]\n'a b' = 1", "not a name"),
        ("functions = 1", "is not a table"),
        ("[functions", "not TOML"),
    ],
)
def test_mappings_that_are_refused(text, words):
    with pytest.raises(FlightPlanError) as caught:
        parse_name_mapping(text, "m.toml")
    assert words in str(caught.value)
    assert str(caught.value).startswith("m.toml: ")


def test_a_mapping_that_cannot_be_read_is_named_without_a_line(tmp_path):
    path = tmp_path / "none.toml"
    with pytest.raises(FlightPlanError, match=f"^{path}: cannot be read: No such file") as caught:
        load_name_mapping(path)
    assert (caught.value.place.line, caught.value.place.column) == (0, 0)
    path.write_bytes(b"\xff")
    with pytest.raises(FlightPlanError, match=f"^{path}: not a text in UTF-8"):
        load_name_mapping(path)


def test_a_mapping_of_100000_bytes_is_read_and_a_longer_one_refused(tmp_path):
    path = tmp_path / "names.toml"
    path.write_bytes(b"[functions]\nf = 1\n".ljust(100_000, b"\n"))
    assert load_name_mapping(path).functions == {"f": 1}
    path.write_bytes(path.read_bytes() + b"\n")
    with pytest.raises(FlightPlanError, match="longer than 100000 bytes"):
        load_name_mapping(path)


def test_commands_of_guided_flight_are_parted_by_commas_outside_of_parentheses():
    assert findings(block('<guided commands="Max(Min(1, 2), fabs(3)), 2, (3), 4"/>')) == []
    assert findings(block('<guided commands="Max(fabs(1), 2), 2, 3"/>')) == [("<guided> commands", "b")]


@pytest.mark.skipif(not public_plans(), reason="the public plans are not here")
@pytest.mark.parametrize("name", ["fish_voliere.xml", "rotorcraft_optitrack.xml"])
def test_indoor_plans_are_flown(name):
    path = next(path for path in public_plans() if path.name == name)
    check = check_flown(load_flight_plan(path))
    check.require_flown()
    assert set(check.locked_blocks) <= {"Guided_run"}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_known_function_can_be_called(name):
    shape = FUNCTIONS[name]
    assert 0 <= shape.least <= shape.most
    assert all(0 <= index < shape.most for index in (*shape.waypoints, *shape.changes))


@pytest.mark.parametrize(("name", "found"), [("v", []), ("nothing", [("&nothing", "b")])])
def test_a_function_changes_only_a_variable_that_there_is(name, found):
    before = '<variables><variable var="v" init="0"/></variables>'
    stage = f'<call_once fun="increase_nav_heading(&amp;{name}, 1)"/>'
    assert findings(block(stage), before) == found
