"""What of a plan is flown, what is refused by which construct, and what a user can say that names mean."""

import pytest

from protocol.flight_plans import FlightPlanError, load_flight_plan
from protocol.flight_plans.known_names import FUNCTIONS
from protocol.flight_plans.name_mapping import load_name_mapping, parse_name_mapping
from protocol.flight_plans.plan_check import check_flown
from tests.support.plans import VOLIERE, plan_of, public_plans


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
        ('<set var="other" value="1"/>', "set other"),
        ('<set var="nav.radius" value="speed"/>', "speed"),
        ('<stay wp="A" until="$i == 2"/>', "$i"),
        ('<stay wp="A" until="InsideNowhere(1, 2)"/>', "InsideNowhere()"),
        ('<stay wp="A" until="WaypointX(WP_Q) == 2"/>', "WP_Q"),
        ('<stay wp="A" until="stateGetPositionEnu_f()"/>', "stateGetPositionEnu_f()"),
        ('<stay wp="A" until="stateGetPositionEnu_f()->w"/>', "stateGetPositionEnu_f()->w"),
        ('<stay wp="A" until="nav_block == IndexOfBlock(\'c\')"/>', "'c'"),
        ('<stay wp="A" until="\'a\' == 1"/>', "'a'"),
        ('<stay wp="A" until="waypoints[2] == 1"/>', "waypoints[]"),
        ('<set var="list[1]" value="2"/>', "set list[1]"),
        ('<guided commands="1,2"/>', "<guided> commands"),
        ('<stay wp="A" vmode="climb"/>', "vmode 'climb'"),
        ('<go wp="A" vmode="glide"/>', "vmode 'glide'"),
        ('<go wp="A" nav_type="spiral"/>', "nav_type 'spiral'"),
        ('<call_once fun="increase_nav_heading(1, 2)"/>', "increase_nav_heading()"),
        ('<exception cond="sonar" deroute="a"/>', "sonar"),
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
    for before in (
        '<exceptions><exception cond="sonar" deroute="a"/></exceptions>',
        '<variables><variable var="v" init="sonar"/></variables>',
    ):
        check = check_flown(plan_of(block(""), before))
        assert [finding.block for finding in check.refusals] == [None]
        with pytest.raises(FlightPlanError, match="sonar: no such variable"):
            check.require_flown()


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
    assert len(findings(block(stages))) == 5
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
