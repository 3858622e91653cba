"""``darko-sitl campaign``: its files, one case again, one chunk, what it refuses."""

import pytest

from protocol.flight_log.field_expressions import quantity
from protocol.tlog import read_tlog
from sitl.__main__ import MOVED, main
from sitl.lab.campaigns.case_flights import fly_case
from sitl.lab.campaigns.chunks import ChunkStore
from sitl.lab.campaigns.specification import draw, load_specification
from tests.support.campaigns import SMALL, small_file


@pytest.fixture
def fly(tmp_path, capsys):
    def run(*arguments, text=SMALL):
        code = main(["campaign", str(small_file(tmp_path, text)), "--out", str(tmp_path / "out"), *arguments])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run


def test_without_a_name_the_shipped_ones_are_listed(capsys):
    assert main(["campaign"]) == 0
    assert "holds           Holding a point in wind" in capsys.readouterr().out
    assert "campaign" not in MOVED


@pytest.mark.long
def test_a_campaign_leaves_summary_table_and_page(fly, tmp_path):
    code, out, err = fly("--jobs", "1")
    assert code == 0
    assert out.startswith("small: 12 cases, seeds 1 to 6\n")
    assert (tmp_path / "out" / "summary.txt").read_text() == out[: out.index("written:")]
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"summary.txt", "cases.parquet", "page.html"}
    assert "12/12 cases" in err
    before = (tmp_path / "out" / "page.html").read_bytes()
    assert fly("--jobs", "1")[2] == ""  # nothing was left to fly
    assert (tmp_path / "out" / "page.html").read_bytes() == before


def test_values_of_the_file_are_set_and_the_command_of_a_case_says_so(fly):
    code, out, _ = fly("--jobs", "1", "--set", "vary.push.grid=[3]", "--set", "vehicle.controller=report")
    assert code == 0
    assert "seeds 1 to 12" in out
    assert "--set 'vary.push.grid=[3]' --set vehicle.controller=report" in fly(
        "--jobs", "1", "--set", "vary.push.grid=[3]", "--set", "vehicle.controller=report",
        text=SMALL.replace("chunk = 3", 'chunk = 3\nworst = ["reached"]'),
    )[1]  # fmt: skip
    assert "--set push: must be KEY=VALUE" in fly("--set", "push")[2]


def test_a_file_that_is_set_is_looked_for_from_here(fly, tmp_path, monkeypatch):
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    assert f"{here}/none.toml" in fly("--set", "vehicle.airframe=none.toml")[2]


def test_what_the_file_requires_is_the_exit_code(fly):
    assert fly("--jobs", "1", text=SMALL + "\n[require]\nstayed = 0.9\n")[0] == 1


def test_a_chunk_alone_is_that_of_the_whole(fly, tmp_path):
    code, out, _ = fly("--chunk", "1")
    campaign = load_specification(str(tmp_path / "small.toml"))
    found = ChunkStore(tmp_path / "out", campaign).read(range(3, 6))
    assert code == 0
    assert out.startswith("cases 3 to 5: ")
    assert found == [fly_case(campaign, draw(campaign, number)) for number in range(3, 6)]
    assert fly("--chunk", "4")[2] == "darko-sitl: --chunk 4: the campaign has the chunks 0 to 3\n"


def test_a_case_again_is_the_same_flight_with_its_log_and_page(fly, tmp_path):
    code, out, _ = fly("--case", "1")
    campaign = load_specification(str(tmp_path / "small.toml"))
    reached = fly_case(campaign, draw(campaign, 1)).measures[0]
    assert code == 0
    assert f"reached                 {reached:.6g} m\n" in out
    log = read_tlog(tmp_path / "out" / "case-1.tlog")
    far = quantity(log, "hypot(DARKO_TRUTH.position[0], DARKO_TRUTH.position[1])").values
    assert 0.3 * reached < far.max() < 1.001 * reached  # every tenth of a second
    assert "small, case 1" in (tmp_path / "out" / "case-1.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--case", "1", "--chunk", "1"), "--case and --chunk do not go together"),
        (("--jobs", "0"), "--jobs 0: there must be at least 1"),
        (("--case", "-1"), "case -1: cases are numbered from 0 on"),
        (("--cases", "0"), "run.cases = 0 is not within 1"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(fly, arguments, words):
    code, _, err = fly(*arguments)
    assert code == 2
    assert words in err
    assert err.count("\n") == 1
