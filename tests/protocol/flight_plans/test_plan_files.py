"""Plans as files: what is read, how it is written again, and what is refused where."""

import os
from dataclasses import replace

import pytest

from protocol.errors import FileError
from protocol.flight_plans import FlightPlanError, load_flight_plan, read_flight_plan, render_flight_plan
from protocol.flight_plans.flight_plan import GoStage, PathStage, StayStage, inside_polygon, waypoint_position
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.plan_loader import SHIPPED_PLANS
from protocol.flight_plans.xml_elements import MAX_ELEMENTS
from protocol.ranges import MAX_PLAN_FILE
from tests.support.plans import HEAD, OUR_PLANS, VOLIERE, WAYPOINTS, plan_of, plan_text, public_plans


def refusal(text, name="t.xml"):
    with pytest.raises(FlightPlanError) as caught:
        read_flight_plan(text if isinstance(text, bytes) else text.encode(), name)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(f"{name}:")
    return caught.value


@pytest.mark.parametrize(
    "path", sorted([*OUR_PLANS.glob("*.xml"), *SHIPPED_PLANS.glob("*.xml")]), ids=lambda path: path.name
)
def test_what_is_written_loads_to_the_same_plan(path):
    plan = load_flight_plan(path)
    text = render_flight_plan(plan)
    again = read_flight_plan(text.encode(), "again")
    assert again == plan
    assert render_flight_plan(again) == text


def test_the_room():
    plan = load_flight_plan(VOLIERE)
    assert plan.lat0 == pytest.approx(43 + 33 / 60 + 50.73 / 3600)
    assert plan.comments == (" A plan for a flying room of 8 x 8 x 6 m: everything hovered, nobody inside. ",)
    assert plan.blocks[1].strip_button == "Take off"
    assert [e.deroute.name for e in plan.exceptions] == ["Safe landing", "Safe landing", "Standby"]
    heights = {p.name: waypoint_position(plan, p).z for p in plan.waypoints}
    assert (heights["HOME"], heights["p2"], heights["CENTRE"]) == (2.0, 3.0, 2.5)
    route = plan.blocks[plan.block_index("Route")]
    first, second, _, third = route.stages[0].stages
    assert isinstance(first, GoStage)
    assert second.from_wp.name == "p1"
    assert isinstance(third, PathStage)
    assert [use.name for use in third.wpts] == ["p2", "p3", "p4"]


def test_comments_keep_their_places():
    blocks = '<!-- one --><block name="b"><!-- two --><stay wp="A"/><!-- three --></block><!-- four -->'
    plan = plan_of(blocks, "<!-- zero -->")
    written = render_flight_plan(plan)
    order = [written.index(f"<!-- {word} -->") for word in ("zero", "one", "two", "three", "four")]
    assert order == sorted(order)


def test_attributes_are_written_as_they_were():
    plan = plan_of('<block name="a &amp; &lt;b&gt; &quot;c&quot;"><stay wp="A" until="1 &lt; stage_time"/></block>')
    assert plan.blocks[0].name == 'a & <b> "c"'
    assert read_flight_plan(render_flight_plan(plan).encode(), "x") == plan
    assert isinstance(plan.blocks[0].stages[0], StayStage)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<a>", "t.xml:1:4: not XML: no element found"),
        ("", "t.xml:1:1: not XML"),
        ('<!DOCTYPE a [<!ENTITY e "x">]><a b="&e;"/>', "entities"),
        ('<!DOCTYPE a [<!ENTITY % e SYSTEM "file:///etc/passwd"> %e;]><a/>', "entities"),
        ('<!DOCTYPE a SYSTEM "no.dtd"><a b="&e;"/>', "undefined entity &e;"),
        ('<!DOCTYPE a SYSTEM "no.dtd"><a>&e;</a>', "undefined entity &e;"),
        ("<a>" * 40 + "</a>" * 40, "nested more than 32 deep"),
        ('<a xmlns:x="y" x:b="1"/>', "namespaces"),
        (b'<?xml version="1.0" encoding="utf-16"?><a/>', "t.xml:1:1: not a text in UTF-8"),
        (b"<a b='\xff'/>", "not utf-8"),
        ("<a/>" + " " * MAX_PLAN_FILE, "t.xml:1:1: longer than"),
        ("<a>" + "<b/>" * (MAX_ELEMENTS + 1) + "</a>", "elements"),
        ("<procedure/>", "a procedure is flown by a plan that includes it"),
    ],
    ids=lambda value: repr(value[:30]),
)
def test_what_is_not_a_plan_is_refused(text, words):
    assert words in str(refusal(text))


@pytest.mark.parametrize(
    ("blocks", "words"),
    [
        ('<block name="b"><fly wp="A"/></block>', "t.xml:3:25: <fly> is not a stage"),
        ('<block name="b"><go/></block>', "t.xml:3:25: <go> needs the attribute 'wp'"),
        ('<block name="b"><heading course="1"/></block>', "needs the attribute 'until'"),
        ('<block name="b"><go wp="A" hmode="fast"/></block>', "is not one of direct, route"),
        ('<block name="b"><call fun="f()" loop="maybe"/></block>', "neither TRUE nor FALSE"),
        ('<block name="b"><set var="1a" value="1"/></block>', "'1a' is not expected here"),
        ('<block name="b"><go wp="A"><go wp="B"/></go></block>', "<go> holds no <go>"),
        ('<block name="b">words</block>', "holds the text 'words'"),
        ('<block name="b"/><block name="b"/>', "a second block is called 'b'; the first is in line 3"),
        ('<block name=""/>', "is not a name"),
        ("", "<blocks> holds no block"),
        ('<block name="b"><stay wp="A" until="1 +&#10; )"/></block>', "t.xml:3:"),
        ('<block name="b"><path wpts="A"/></block>', "two waypoints"),
    ],
)
def test_blocks_that_are_refused(blocks, words):
    assert words in str(refusal(plan_text(blocks)))


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ('<sectors><sector name="S">' + '<corner name="Q"/>' * 3 + "</sector></sectors>", "no waypoint 'Q'"),
        ('<variables><variable var="v" min="2" max="1"/></variables>', "min 2 is above max 1"),
        ('<variables><variable var="v" step="0"/></variables>', "step 0 is not positive"),
        ('<variables><variable var="v v"/></variables>', "not the name of a variable"),
        ('<variables><abi_binding name="X"/></variables>', "needs vars or handler"),
        ("<modules/><modules/>", "a second <modules>"),
        ('<exceptions><exception cond="1" deroute="c"/></exceptions>', "there is no block 'c'"),
        ("<extras/>", "<flight_plan> holds no <extras>"),
        ('<sectors colour="red"/>', "has no attribute 'colour'"),
    ],
)
def test_sections_that_are_refused(section, words):
    assert words in str(refusal(plan_text('<block name="b"/>', section)))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('lat0="43.5641"', 'lat0="91"', "not on the globe"),
        ('lat0="43.5641"', 'lat0="43 61 2"', "from 0 to 60"),
        ('lat0="43.5641"', 'lat0="north"', "not a number"),
        ('lat0="43.5641"', "", "needs the attribute 'lat0'"),
        ('max_dist_from_home="100"', 'max_dist_from_home="0"', "not positive"),
        ('name="HOME"', 'name="HOUSE"', "no waypoint is called HOME"),
        ('x="3" y="4"', 'x="3"', "needs x and y, or lat and lon"),
        ('x="3" y="4"', 'x="3" y="4" alt="1" height="2"', "both alt and height"),
        ('x="3" y="4"', 'x="nan" y="4"', "not a number"),
        ('x="3" y="4"', 'x="1e9" y="4"', "farther than"),
    ],
)
def test_values_that_are_refused(old, new, words):
    text = plan_text('<block name="b"/>')
    assert old in text
    assert words in str(refusal(text.replace(old, new)))


def test_an_expression_is_refused_at_its_character():
    text = plan_text('<block name="b">\n <stay wp="A"\n  until="1 &lt; (2 +"/>\n</block>')
    error = refusal(text)
    assert (error.place.line, error.place.column) == (5, 21)
    error = refusal(text.replace("(2 +", "@ 2"))
    assert (error.place.line, error.place.column) == (5, 17)
    error = refusal(text.replace("1 &lt;", "1\n\n    &lt;"))
    assert (error.place.line, error.place.column) == (7, 14)


def test_every_line_ending_and_latin_1_are_read():
    text = plan_text('<block name="é"/>')
    plan = read_flight_plan(text.encode(), "t")
    assert read_flight_plan(text.replace("\n", "\r\n").encode("utf-8-sig"), "t") == plan
    latin = '<?xml version="1.0" encoding="ISO-8859-1"?>' + text
    assert read_flight_plan(latin.encode("latin-1"), "t").blocks[0].name == "é"


def test_a_file_that_cannot_be_read(tmp_path):
    for path in (tmp_path / "none.xml", tmp_path):
        with pytest.raises(FileError, match=str(path)):
            load_flight_plan(path)


def test_a_device_is_not_opened(tmp_path):
    pipe = tmp_path / "pipe.xml"
    os.mkfifo(pipe)
    with pytest.raises(FlightPlanError, match="not a file"):
        load_flight_plan(pipe)


def test_waypoints_on_the_globe_and_inside():
    text = plan_text('<block name="b"/>').replace('x="3" y="4"', 'lat="43.5642" lon="1.4829"')
    plan = read_flight_plan(text.encode(), "t")
    at = waypoint_position(plan, plan.waypoint("A"))
    assert at.x == pytest.approx(0.0, abs=1e-6)
    assert at.y == pytest.approx(11.11, abs=0.01)
    corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]
    assert inside_polygon(corners, 1.0, 1.0)
    assert not inside_polygon(corners, 3.0, 1.0)
    assert not inside_polygon(corners, -1.0, 1.0)


def test_a_header_is_kept():
    text = f"{HEAD}<header><![CDATA[#define A(x) (x && 1 < 2)]]></header><waypoints>{WAYPOINTS}</waypoints>"
    text += '<blocks><block name="b"/></blocks></flight_plan>'
    plan = read_flight_plan(text.encode(), "t")
    assert plan.header.text == "#define A(x) (x && 1 < 2)"
    assert read_flight_plan(render_flight_plan(plan).encode(), "t") == plan


@pytest.mark.skipif(not public_plans(), reason="the public plans are not here")
@pytest.mark.parametrize("path", public_plans(), ids=lambda path: path.name)
def test_public_plans_load_or_are_refused_with_their_place(path):
    try:
        plan = load_flight_plan(path)
    except FlightPlanError as error:
        assert "not XML" in error.reason or "procedure" in error.reason  # noqa: PT017
        return
    assert read_flight_plan(render_flight_plan(plan).encode(), "again") == plan


@pytest.mark.parametrize(
    ("text", "degrees"),
    [("43 0.6", 43.01), ("-43 0.6 0", -43.01), ("-0 30", -0.5), ("43 59.9 59.9", 43 + 59.9 / 60 + 59.9 / 3600)],
)
def test_minutes_and_seconds_may_be_parts_of_one_and_count_with_the_sign_of_the_degrees(text, degrees):
    written = plan_text('<block name="b"><stay wp="A"/></block>').replace('lat0="43.5641"', f'lat0="{text}"')
    plan = read_flight_plan(written.encode(), "t.xml")
    assert plan.lat0 == pytest.approx(degrees)


@pytest.mark.parametrize("given", ["", 'x="3" y="4" lat="43.5"', 'y="4"', 'lon="1.4"'])
def test_a_waypoint_has_one_whole_position_at_least_and_no_half_ones(given):
    text = plan_text('<block name="b"/>').replace('x="3" y="4"', given)
    assert "needs x and y, or lat and lon" in str(refusal(text))


def test_the_origin_in_utm_is_kept_and_nothing_else_stands_there():
    text = plan_text('<block name="b"/>').replace("<waypoints>", '<waypoints utm_x0="360284.8" utm_y0="4813595.5">')
    plan = read_flight_plan(text.encode(), "t")
    assert (plan.utm_x0, plan.utm_y0) == (360284.8, 4813595.5)
    assert read_flight_plan(render_flight_plan(plan).encode(), "again") == plan
    assert "utm_y0 'far' is not a number" in str(refusal(text.replace("4813595.5", "far")))
    assert "<waypoints> has no attribute 'utm_z0'" in str(refusal(text.replace("utm_y0", "utm_z0")))


def test_a_file_has_a_million_bytes_at_most():
    text = plan_text('<block name="b"/>').ljust(1_000_000)
    assert read_flight_plan(text.encode(), "t").blocks[0].name == "b"
    assert "longer than 1000000 bytes" in str(refusal(text + " "))


@pytest.mark.long
@pytest.mark.parametrize(("elements", "is_read"), [(MAX_ELEMENTS, True), (MAX_ELEMENTS + 1, False)])
def test_a_file_may_hold_this_many_elements(elements, is_read):
    error = refusal("<a>" + "<b/>" * (elements - 1) + "</a>")
    assert ("<flight_plan> was expected" in str(error)) is is_read


def test_an_empty_section_keeps_its_comments():
    for tag in ("sectors", "variables", "modules", "exceptions"):
        for before in (f"<!-- one --><{tag}/>", f"<{tag}><!-- one --></{tag}>"):
            plan = plan_of('<block name="b"/>', before)
            written = render_flight_plan(plan)
            assert "<!-- one -->" in written
            assert read_flight_plan(written.encode(), "again") == plan
    assert "<sectors>" not in render_flight_plan(plan_of('<block name="b"/>'))


@pytest.mark.parametrize(
    ("written", "strict"),
    [
        ('until="1 > 0 && 2 > 1"', 'until="1 > 0 &amp;&amp; 2 > 1"'),
        ('until="1 < 2 &&\n 2 &gt; 1"', 'until="1 &lt; 2 &amp;&amp;\n 2 &gt; 1"'),
        ("""height="2"until='1 < 2'climb="1\"""", 'height="2" until="1 &lt; 2" climb="1"'),
        ('until="1 > 0"/><!-- a -- <stay wp="A"/> ---><stay wp="B"', 'until="1 > 0"/><!-- --><stay wp="B"'),
    ],
)
def test_a_plan_is_read_that_paparazzi_takes_though_it_is_no_xml(written, strict):
    found, expected = (
        plan_of(f'<block name="b"><go wp="A" {written}/></block>'),
        plan_of(f'<block name="b"><go wp="A" {strict}/></block>'),
    )
    assert [type(stage) for stage in found.blocks[0].stages] == [type(stage) for stage in expected.blocks[0].stages]
    for stage, other in zip(found.blocks[0].stages, expected.blocks[0].stages, strict=True):
        assert replace(stage, comments=()) == replace(other, comments=())
    assert not check_flown(found).refusals


def test_places_are_those_of_the_file_also_behind_what_was_mended():
    plan = plan_of('<block key="<Control>a"name="b"><go wp="A" until="1 < 2 && 3 > 2"from="Q"/></block>')
    line = '<blocks><block key="<Control>a"name="b"><go wp="A" until="1 < 2 && 3 > 2"from="Q"/></block>'
    stage = plan.blocks[0].stages[0]
    assert plan.blocks[0].key == "<Control>a"
    assert (stage.from_wp.place.line, stage.from_wp.place.column) == (3, line.index("Q") + 1)
    assert stage.until.text == "1 < 2 && 3 > 2"


def test_an_attribute_that_no_stage_has_is_ignored_with_a_notice_as_paparazzi_ignores_it():
    check = check_flown(plan_of('<block name="a"><stay wp="A" precall="x()"/></block>'))
    assert not check.refusals
    assert [str(notice) for notice in check.notices] == ["t.xml:3:47: attribute 'precall': no such attribute: ignored"]


def test_names_of_elements_and_attributes_may_be_in_capitals():
    text = plan_text('<BLOCK Name="b"><GO WP="A" Until="1"/></BLOCK>').replace('name="A"', 'NAME="A"')
    plan = read_flight_plan(text.replace("ground_alt", "GROUND_ALT").encode(), "t")
    assert plan == read_flight_plan(plan_text('<block name="b"><go wp="A" until="1"/></block>').encode(), "t")


def test_the_first_of_repeated_attributes_counts_and_the_others_are_told():
    text = plan_text("""<block name="b"><!-- <a b="1" b="2"> --><go wp="A" from='B'
      wp="C" FROM='>C'/></block>""")
    plan = read_flight_plan(text.encode(), "t.xml")
    (stage,) = plan.blocks[0].stages
    assert (stage.wp.name, stage.from_wp.name) == ("A", "B")
    assert [(str(use), use.place.line, use.place.column) for use in plan.repeated_attributes] == [
        ("go wp", 4, 7),
        ("go FROM", 4, 14),
    ]
    assert [str(notice) for notice in check_flown(plan).notices] == [
        "t.xml:4:7: go wp: given before in the same tag: the first counts",
        "t.xml:4:14: go FROM: given before in the same tag: the first counts",
    ]


@pytest.mark.parametrize("text", ["<!--" * 50_000, "<a " * 50_000, "<a b='" * 50_000, '<a b="x' + "y='" * 50_000])
def test_a_file_of_beginnings_is_refused_soon(text):
    assert "not XML" in str(refusal(text))


def test_each_attribute_has_its_own_place_also_where_its_value_holds_the_end_of_a_tag():
    stages = """<go wp="A" until='1 > 2' from="Q"/><go from="B" wp="A"/>"""
    stage = read_flight_plan(plan_text(f'<block name="b">\n{stages}</block>').encode(), "t").blocks[0].stages[0]
    assert (stage.from_wp.place.line, stage.from_wp.place.column) == (4, stages.index("Q") + 1)


def test_a_waypoint_may_stand_on_an_axis_and_a_hundred_kilometres_away():
    for x, y in ((0.0, 4.0), (3.0, 0.0), (0.0, 0.0), (100_000.0, 0.0), (0.0, -100_000.0)):
        text = plan_text('<block name="b"/>').replace('x="3" y="4"', f'x="{x}" y="{y}"')
        plan = read_flight_plan(text.encode(), "t")
        at = waypoint_position(plan, plan.waypoint("A"))
        assert (at.x, at.y) == (x, y)
    text = plan_text('<block name="b"/>')
    assert "farther than 100000 m" in str(refusal(text.replace('x="3"', 'x="100001"')))
    assert "farther than 100000 m" in str(refusal(text.replace('y="4"', 'y="-100001"')))


def test_what_is_wrong_with_a_whole_file_has_no_line(tmp_path):
    with pytest.raises(FlightPlanError) as caught:
        load_flight_plan(tmp_path / "none.xml")
    assert (caught.value.place.line, caught.value.place.column) == (0, 0)


@pytest.mark.parametrize("before", [b"", b"\n", b"\n\n<a>\n"])
def test_a_byte_that_is_no_text_is_said_with_its_line(before):
    error = refusal(before + b"<b c='\xff'/>")
    assert (error.place.line, error.place.column) == (before.count(b"\n") + 1, 1)


def test_a_shipped_plan_is_read_by_its_name_and_a_name_that_is_none_tells_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_flight_plan("voliere").name == "Flying room"
    with pytest.raises(
        FlightPlanError, match=r"room\.xml cannot be read: No such file .*shipped plans: voliere, wind-wall"
    ):
        load_flight_plan("room.xml")
