"""Charts of a flight: the right numbers at the right times, in lines that can be told apart."""

import runpy
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from protocol.flight_log import flight_charts
from protocol.flight_log.flight_charts import (
    actuator_chart,
    energy_chart,
    error_chart,
    lyapunov_chart,
    wind_chart,
)
from protocol.flight_log.flight_series import FlightEvent, Series, flight_series
from protocol.tlog import read_tlog
from tests.support.paths import DATA

pytest.importorskip("plotly")
NONE = Series(np.zeros(0), {})
TIMES = np.array([0.0, 1.0, 2.0])


def series(times=TIMES, **fields):
    return Series(np.asarray(times, float), {name: np.asarray(values, float) for name, values in fields.items()})


@pytest.fixture(scope="module")
def flown():
    return flight_series(read_tlog(DATA / "square-flight.tlog"), "square")


@pytest.fixture(scope="module")
def nothing(flown):
    """A flight of which nothing was recorded."""
    parts = ("position", "truth", "target", "hybrid", "actuators", "servos", "energy", "air")
    return replace(flown, events=(), **dict.fromkeys(parts, NONE))


def lines(figure):
    return {trace.name: (list(trace.x), list(trace.y)) for trace in figure.data}


def test_without_messages_there_is_no_chart(nothing):
    for chart in (lyapunov_chart, actuator_chart, energy_chart, error_chart, wind_chart):
        assert chart(nothing) is None


def test_distances_are_from_the_set_point_and_from_the_truth_which_is_told_north_east_down(nothing):
    times = [0.0, 1.0, 2.0, 3.0]
    flight = replace(
        nothing,
        position=series(times, x=times, y=[0.0] * 4, z=[-5.0] * 4),
        target=series([0.0, 2.0], x=[0.0, 5.0], y=[4.0, 4.0], z=[-5.0, -5.0]),
        truth=series(times, position=[[0.0, 0.0, -5.0], [1.0, 2.0, -5.0], [2.0, 0.0, -8.0], [3.0, 0.0, -5.0]]),
    )
    drawn = lines(error_chart(flight))
    assert drawn["from the set-point"] == (times, pytest.approx([4.0, np.hypot(1.5, 4.0), 5.0, np.hypot(2.0, 4.0)]))
    assert drawn["estimate from truth"] == (times, pytest.approx([0.0, 2.0, 3.0, 0.0]))
    assert len({line.line.color for line in error_chart(flight).data}) == 2
    assert all(line.showlegend for line in error_chart(flight).data)
    assert list(lines(error_chart(replace(flight, truth=NONE)))) == ["from the set-point"]


def test_energy_is_counted_from_the_beginning_for_each_law_that_used_some(nothing):
    totals = np.zeros((3, max(Law) + 1))
    totals[:, Law.HOVER_LINEAR] = 100.0, 130.0, 150.0
    totals[:, Law.LANDED] = 7.0
    figure = energy_chart(replace(nothing, energy=series(energy_by_law=totals)))
    assert lines(figure) == {Law.HOVER_LINEAR.label: (TIMES.tolist(), [0.0, 30.0, 50.0])}


def test_energy_of_several_laws_is_stacked_at_common_times_and_grows_over_a_restart(nothing):
    count = 20_000
    totals = np.zeros((count, max(Law) + 1))
    totals[:, Law.HOVER_LINEAR] = np.minimum(np.arange(count), 15_000)
    totals[:, Law.FORWARD_LINEAR] = np.maximum(np.arange(count) - 5000, 0)
    totals[18_000:] -= totals[18_000]  # the vehicle restarted, and counts from zero
    totals[18_000:, Law.LANDED] = np.arange(2000)
    figure = energy_chart(replace(nothing, energy=series(np.arange(count) * 0.1, energy_by_law=totals)))
    drawn = [np.array(trace.y) for trace in figure.data]
    assert [trace.name for trace in figure.data] == [
        law.label for law in Law if law in {Law.HOVER_LINEAR, Law.FORWARD_LINEAR, Law.LANDED}
    ]
    assert len({tuple(trace.x) for trace in figure.data}) == 1
    assert all((np.diff(y) >= 0.0).all() for y in drawn)
    assert sorted(y[-1] for y in drawn) == [1999.0, 14_998.0, 15_000.0]


def test_where_a_message_lacked_no_line_is_drawn(nothing):
    times = np.arange(0.0, 60.0, 0.5)
    shown = (times > 20.0) & (times < 40.0)  # the truth is recorded only while its panel is shown
    flight = replace(
        nothing,
        position=series(times, x=times, y=times * 0.0, z=times * 0.0),
        truth=series(times[shown], position=np.stack((times, times * 0.0, times * 0.0), axis=1)[shown]),
    )
    x, y = map(np.array, lines(error_chart(flight))["estimate from truth"])
    assert np.isnan(y[x < 17.0]).all()
    assert np.isnan(y[x > 43.0]).all()
    assert np.nanmax(y) < 3.0


def test_propellers_and_elevons_stand_below_each_other_with_their_limits(nothing):
    acting = series(
        [0.0, 1.0, 5.0],
        motor_speed=[[600.0, 610.0], [620.0, 630.0], [640.0, 650.0]],
        elevon=np.radians([[1.0, -1.0], [2.0, -2.0], [3.0, -3.0]]),
        motor_min=[100.0] * 3,
        motor_max=[1000.0] * 3,
        elevon_max=np.radians([30.0] * 3),
        limits=[0b0, 0b10, 0b0],
    )
    figure = actuator_chart(replace(nothing, actuators=acting))
    drawn = {(trace.name, trace.xaxis): list(trace.y) for trace in figure.data if "limits" not in trace.name}
    assert drawn == {
        ("motor left [rad/s]", "x"): [600.0, 620.0, 640.0],
        ("elevon left [deg]", "x2"): pytest.approx([1.0, 2.0, 3.0]),
        ("motor right [rad/s]", "x"): [610.0, 630.0, 650.0],
        ("elevon right [deg]", "x2"): pytest.approx([-1.0, -2.0, -3.0]),
    }
    bounds = [(trace.xaxis, round(trace.y[0]), trace.showlegend) for trace in figure.data if "limits" in trace.name]
    assert bounds == [("x", 100, True), ("x", 1000, False), ("x2", -30, True), ("x2", 30, False)]
    titles = [axis.title.text for axis in (figure.layout.yaxis, figure.layout.yaxis2)]
    assert titles == ["propellers [rad/s]", "elevons [deg]"]
    assert figure.layout.xaxis2.title.text == "time [s]"
    top, bottom = figure.layout.yaxis.domain, figure.layout.yaxis2.domain
    assert 0.0 == bottom[0] < bottom[1] < top[0] < top[1] == 1.0
    assert [(shade.x0, shade.x1, shade.xref) for shade in figure.layout.shapes] == [(1.0, 5.0, "x")]


def test_times_at_a_limit_that_are_close_together_are_shaded_as_one(nothing):
    times = [0.0, 1.0, 1.1, 1.2, 2.0, 2.25, 3.5]
    zeros = np.zeros(7)
    acting = series(
        times,
        motor_speed=np.zeros((7, 2)),
        elevon=np.zeros((7, 2)),
        motor_min=zeros,
        motor_max=zeros,
        elevon_max=zeros,
        limits=[0b100, 0, 0b1000, 0b1100, 0, 0b100, 0b100],
    )
    figure = actuator_chart(replace(nothing, actuators=acting))
    assert [(shade.x0, shade.x1, shade.xref) for shade in figure.layout.shapes] == [(0.0, 2.0, "x2"), (2.25, 3.5, "x2")]


def test_only_a_motor_at_its_limit_shades_the_motors_and_only_an_elevon_the_elevons(nothing):
    zeros = np.zeros(2)
    for bits, axis in ((0b1, "x"), (0b10, "x"), (0b100, "x2"), (0b1000, "x2")):
        acting = series(
            [0.0, 1.0],
            motor_speed=np.zeros((2, 2)),
            elevon=np.zeros((2, 2)),
            motor_min=zeros,
            motor_max=zeros,
            elevon_max=zeros,
            limits=[bits, bits],
        )
        (shade,) = actuator_chart(replace(nothing, actuators=acting)).layout.shapes
        assert (shade.xref, shade.line.width) == (axis, 0)


def test_servo_outputs_that_never_change_are_not_drawn(nothing):
    servos = series(servo1_raw=[1000, 1500, 1200], servo2_raw=[1000] * 3, servo16_raw=[1, 1, 2])
    assert list(lines(actuator_chart(replace(nothing, servos=servos)))) == ["servo 1", "servo 16"]
    assert actuator_chart(replace(nothing, servos=series(servo1_raw=[1000] * 3))) is None


def test_the_wind_is_drawn_north_and_east_as_estimated_and_as_it_is(nothing):
    air = series(wind_estimate=[[1.0, 2.0, 9.0]] * 3, wind_true=[[3.0, 4.0, 9.0]] * 3)
    figure = wind_chart(replace(nothing, air=air))
    drawn = {name: y[0] for name, (_, y) in lines(figure).items()}
    assert drawn == {"estimate north": 1.0, "truth north": 3.0, "estimate east": 2.0, "truth east": 4.0}
    estimates, truths = figure.data[::2], figure.data[1::2]
    assert [line.line.dash for line in (*estimates, *truths)] == ["solid"] * 2 + ["dot"] * 2
    assert max(line.line.width for line in truths) < min(line.line.width for line in estimates)
    assert estimates[0].line.color != estimates[1].line.color


def test_lyapunov_values_of_laws_that_did_not_fly_are_left_out_and_jumps_are_marked(nothing):
    fields = {f"v_{law}_{edge}": [1.0] * 3 for law in ("hover", "forward") for edge in ("enter", "leave")}
    hybrid = series(v_hover=[0.0, 2.0, 3.0], v_forward=[0.0] * 3, v_attitude=[np.nan] * 3, **fields)
    events = (FlightEvent(1.5, "jump", "a to b", "b"), FlightEvent(1.7, "mode", "mode HOLD", "HOLD"))
    figure = lyapunov_chart(replace(nothing, hybrid=hybrid, events=events))
    assert [name for name in lines(figure) if name.startswith("V")] == ["V hover"]
    assert np.array_equal(figure.data[0].y, [np.nan, 2.0, 3.0], equal_nan=True)
    assert [shape.x0 for shape in figure.layout.shapes] == [1.5]
    value, *thresholds = figure.data
    assert [line.line.dash for line in thresholds] == ["dash", "dot"] * 2
    assert max(line.line.width for line in (*thresholds, figure.layout.shapes[0])) < value.line.width


def test_a_long_line_keeps_its_greatest_and_least_values(nothing):
    count = 12_005
    times, values = np.arange(count) * 0.01, np.sin(np.arange(count))
    values[[777, 7000]] = 5.0, -5.0
    thin_times, thin = flight_charts._thinned(times, values)
    assert 1000 < len(thin) <= 4002
    assert (thin.max(), thin.min(), thin_times[-1]) == (5.0, -5.0, times[-1])
    assert (np.diff(thin_times) > 0.0).all()
    assert thin.tolist() == values[np.searchsorted(times, thin_times)].tolist()
    energies = np.zeros((count, max(Law) + 1))
    energies[:, Law.LANDED] = np.arange(count)
    drawn = lines(energy_chart(replace(nothing, energy=series(times, energy_by_law=energies))))[Law.LANDED.label]
    assert drawn[0] == pytest.approx(np.array(drawn[1]) * 0.01)


def test_a_line_of_4000_points_is_drawn_as_it_is_and_a_longer_one_is_thinned():
    times = np.arange(4001.0)
    assert len(flight_charts._thinned(times[:-1], times[:-1])[0]) == 4000
    assert len(flight_charts._thinned(times, times)[0]) < 4000


def test_each_law_has_a_colour_and_another_name_is_grey():
    colours = [flight_charts.law_colour(law.name) for law in Law]
    assert len(set(colours)) == len(Law)
    assert flight_charts.law_colour("") == flight_charts.GREY
    assert {flight_charts.law_colour(law.name) for law in Law} <= {*flight_charts.COLOURS}


@pytest.mark.parametrize("paper", ["#ffffff", "#14171a"])
def test_each_colour_reads_on_a_light_and_on_a_dark_page(paper):
    ratios = {colour: contrast(colour, paper) for colour in (*flight_charts.COLOURS, flight_charts.GREY)}
    assert {colour: ratio for colour, ratio in ratios.items() if ratio < 3.0} == {}


def contrast(first, second):
    """Of WCAG 2.2."""
    dark, light = sorted(map(luminance, (first, second)))
    return (light + 0.05) / (dark + 0.05)


def luminance(colour):
    parts = (int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5))
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_names_of_jumps_that_follow_closely_do_not_cover_each_other(nothing):
    times = np.arange(100.0)
    hybrid = series(times, **{f"v_{name}": times + 1.0 for name in (
        "hover", "forward", "attitude", "hover_enter", "hover_leave", "forward_enter", "forward_leave"
    )})  # fmt: skip
    events = [FlightEvent(at, "jump", "x", name) for at, name in ((10.0, "a"), (12.5, "b"), (50.0, "c"))]
    chart = lyapunov_chart(replace(nothing, hybrid=hybrid, events=tuple(events)))
    assert [note.text for note in chart.layout.annotations if note.text] == ["a", "c"]
    assert len(chart.layout.shapes) == 3


def test_a_chart_has_a_title_below_its_time_axis(nothing):
    position = series(range(3), x=[0, 1, 2], y=[0] * 3, z=[0] * 3)
    flight = replace(nothing, position=position, target=position)
    assert error_chart(flight).layout.xaxis.title.text == "time [s]"


def test_the_page_is_imported_without_plotly(monkeypatch):
    for name in ("plotly", "plotly.graph_objects"):
        monkeypatch.setitem(sys.modules, name, None)
    runpy.run_path(str(Path(flight_charts.__file__)))
