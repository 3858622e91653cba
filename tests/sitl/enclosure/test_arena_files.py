"""Arena files: what is read, and one line for each thing that is wrong."""

import math

import pytest

from sitl.enclosure.arena_files import ArenaError, load_arena, shipped_arenas, solids, touched_name

HALL = """
name = "hall"
size = [20.0, 10.0, 6.0]
centre = [100.0, 50.0]
heading = 90.0
net = true
margin = 1.0
[[box]]
name = "crate"
place = [2.0, 1.0]
size = [1.0, 2.0]
heading = 90.0
top = 1.5
[[pillar]]
name = "post"
place = [-2.0, 0.0]
radius = 0.2
[[hanging_net]]
name = "curtain"
from = [5.0, -5.0]
to = [5.0, 0.0]
bottom = 2.0
[wind_wall]
place = [9.0, 0.0]
height = 2.0
size = [3.0, 4.0]
heading = 180.0
turbulence = 0.1
length = 0.3
schedule = [[0, 0], [10, 5]]
gusts = [[20, 2, 3]]
"""


def written(tmp_path, text):
    file = tmp_path / "hall.toml"
    file.write_text(text)
    return str(file)


@pytest.fixture
def hall(tmp_path):
    return load_arena(written(tmp_path, HALL))


def test_the_arena_lies_where_its_centre_and_heading_say(hall):
    """Its length points east: 2 m ahead and 1 m to the right is 2 m east and 1 m south of the centre."""
    crate = hall.obstacles[0]
    assert (crate.north, crate.west) == pytest.approx((99.0, -52.0))
    assert math.cos(crate.course) == pytest.approx(-1.0)  # as its length: 90 degrees further on, south
    assert hall.refuse((100.0, -60.0, 2.0)) is not None
    assert hall.refuse((100.0, -58.9, 2.0)) is None
    assert hall.refuse((104.1, -50.0, 2.0)) == "4.1 m to the left is outside the arena 'hall' (limit 4 m)"
    assert hall.refuse((100.0, -50.0, 5.1)) == "altitude 5.1 m is outside the arena 'hall' (0 to 5 m)"


def test_obstacles_stand_from_the_ground_to_the_ceiling_unless_they_say_otherwise(hall):
    assert [(o.name, o.bottom, o.top) for o in hall.obstacles] == [
        ("crate", 0.0, 1.5), ("post", 0.0, 6.0), ("curtain", 2.0, 6.0)
    ]  # fmt: skip
    curtain = hall.obstacles[2]
    assert (curtain.half_length, curtain.half_width) == pytest.approx((2.5, 0.02))
    assert curtain.gap((102.5, -55.0, 3.0)) == 0.0  # in the middle between its ends


def test_the_wall_blows_back_along_the_length(hall):
    wall = hall.wall
    assert wall.outlet.along == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)  # west
    assert wall.outlet.centre == pytest.approx((100.0, -59.0, 2.0))
    assert (wall.schedule, wall.bursts) == (((0.0, 0.0), (10.0, 5.0)), ((20.0, 2.0, 3.0),))


def test_what_is_touched_has_a_name(hall):
    assert solids(hall).shape == (4, 9)
    assert [touched_name(hall, n) for n in (1, 2, 4)] == ["the net of hall", "crate", "curtain"]


def test_shipped_arenas():
    assert shipped_arenas() == ["obstacle-course", "open", "voliere"]
    voliere = load_arena("voliere")
    assert (2 * voliere.half_length, 2 * voliere.half_width, voliere.height) == (10.0, 10.0, 7.0)
    assert voliere.has_net
    assert voliere.wall.schedule == ()
    assert not load_arena("open").has_net


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('name = "hall"\n', "", "name is missing"),
        ('name = "hall"', "name = 3", "name = 3 is not a name"),
        ("size = [20.0, 10.0, 6.0]", "size = [20.0, 10.0]", "size = [20.0, 10.0] must be 3 numbers in brackets"),
        ("size = [20.0, 10.0, 6.0]", "size = [20.0, -10.0, 6.0]", "size = -10 is not within 0.2 and 100000"),
        ("size = [20.0, 10.0, 6.0]", "size = [20.0, nan, 6.0]", "size = nan is not a finite number"),
        ("size = [20.0, 10.0, 6.0]", "size = [20.0, true, 6.0]", "size = True is not a finite number"),
        ("margin = 1.0", "margin = 5.0", "margin = 5 leaves no room in 20 x 10 x 6 m"),
        ("net = true", "net = 1", "net = 1 is neither true nor false"),
        ("heading = 90.0\nnet", "haeding = 90.0\nnet", "haeding is not known; did you mean 'heading'?"),
        ("radius = 0.2", "radius = 0", "pillar 1.radius = 0 is not within 0.02 and 100000"),
        ("radius = 0.2", "radius = 0.2\nsize = 1", "pillar 1.size is not known"),
        ("bottom = 2.0", "bottom = 7.0\ntop = 6.5", "hanging_net 1.top = 6.5 is not above its bottom at 7"),
        ("to = [5.0, 0.0]", "to = [5.0, -5.0]", "hanging_net 1.to is where it begins"),
        ('name = "post"', 'name = "crate"', "name 'crate' is given to two obstacles"),
        ("[[pillar]]", "[pillar]", "pillar must be written [[pillar]]"),
        ("[10, 5]]", "[0, 5]]", "wind_wall.schedule has times that do not increase"),
        ("[10, 5]]", "[10, 50]]", "wind_wall.schedule or gusts are faster than 30 m/s"),
        ("[[20, 2, 3]]", "[[20, 0, 3]]", "wind_wall.gusts has one that lasts no time"),
        ("[[20, 2, 3]]", "[[20, 2]]", "wind_wall.gusts must be lines of 3 numbers in brackets"),
        ("turbulence = 0.1\n", "", "wind_wall.turbulence is missing"),
        ("[wind_wall]", "[wind_wall", "not a TOML file"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line_with_file_and_key(tmp_path, old, new, reason):
    assert old in HALL
    file = written(tmp_path, HALL.replace(old, new, 1))
    with pytest.raises(ArenaError) as error:
        load_arena(file)
    assert str(error.value).startswith(f"{file}: ")
    assert reason in str(error.value)
    assert "\n" not in str(error.value)
