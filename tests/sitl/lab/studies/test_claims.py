"""The claims: winds in which the published gains are stable, by one choice of signs, and gusts they reject."""

import itertools
import math

import numpy as np
import pytest

from sitl.design.robust_pi_gains import CALM_TUNING, PRINTED_TUNING, WINDY_TUNING, robust_pi_gains
from sitl.lab.campaigns.campaign_run import CampaignResult
from sitl.lab.campaigns.campaign_summary import quantities
from sitl.lab.campaigns.case_flights import FlownCase, fly_shipped
from sitl.lab.campaigns.number_expressions import NumberWalker
from sitl.lab.campaigns.specification import load_specification
from sitl.lab.studies import claims
from sitl.lab.studies.claims import growth, growth_in, gust_claims, linear_plant
from sitl.lab.studies.seeded_flights import Craft
from sitl.lab.studies.spec_studies import FlownStudy, craft_changes
from sitl.model.airframe_files import load
from sitl.simulation.avionics import Navigation
from tests.support.paths import DATA

QUICK, THESIS = (str(DATA / f"{name}.toml") for name in ("darko-quick-servos", "thesis-darko"))
FLOWN_WINDS = (0.0, 1.74, 3.38, 4.91, 6.54)
TRUTH = Craft(airframe=QUICK, navigation=Navigation.TRUTH)


@pytest.mark.parametrize("tuning", [WINDY_TUNING, CALM_TUNING])
def test_one_choice_of_the_elevons_sign_and_of_the_sides_is_stable(tuning):
    a, gains = load(QUICK).parameters, robust_pi_gains(tuning)
    plant, stable = linear_plant(a, 0.0, 0.0), []
    for sign, sides in itertools.product((1.0, -1.0), ((0, 1, 2, 3), (1, 0, 3, 2))):
        outputs = np.array((1.0, 1.0, sign, sign))[:, None]
        mixed = gains._replace(K=(gains.K * outputs)[list(sides)], H=gains.H * np.array((1.0, sign))[:, None])
        stable.append(growth(plant, mixed, a) < 0.0)
    assert stable == [True, False, False, False]


@pytest.mark.parametrize("airframe", [QUICK, THESIS])
def test_the_printed_table_is_stable_in_calm_by_no_choice_of_signs(airframe):
    a, gains = load(airframe).parameters, robust_pi_gains(PRINTED_TUNING)
    plant = linear_plant(a, 0.0, 0.0)
    assert growth(plant, gains, a) == pytest.approx(0.4, abs=0.1)
    for elevons, proportional, integral in itertools.product((1.0, -1.0), repeat=3):
        K = gains.K * np.array((1.0, 1.0, elevons, elevons))[:, None] * proportional
        mixed = gains._replace(K=K, H=gains.H * np.array((1.0, elevons))[:, None] * integral)
        assert growth(plant, mixed, a) > 0.2


@pytest.mark.parametrize("airframe", [QUICK, THESIS])
def test_the_law_that_flew_is_stable_in_the_winds_it_flew_in(airframe):
    a = load(airframe).parameters
    assert all(growth_in(a, WINDY_TUNING, wind, 0.0) < -0.05 for wind in FLOWN_WINDS)


def test_tuned_without_wind_it_is_unstable_beyond_5_metres_per_second_on_the_model_of_its_author():
    a = load(THESIS).parameters
    assert growth_in(a, CALM_TUNING, 0.0, 0.0) < -0.1
    assert growth_in(a, CALM_TUNING, 5.0, 0.0) < 0.0 < growth_in(a, CALM_TUNING, 6.5, 0.0)
    assert growth_in(a, CALM_TUNING, 5.0, 4.0) > 0.1 > growth_in(a, WINDY_TUNING, 5.0, 4.0) + 0.1


def test_the_printed_servos_are_too_slow_for_it():
    a = load("darko").parameters
    found = [growth_in(a._replace(elevon_tau=tau), WINDY_TUNING, 0.0, 0.0) for tau in (0.0125, 0.02, 0.03, 0.05)]
    assert found[0] < 0.0
    assert found[1] < 0.0
    assert 0.0 < found[2] < found[3]


def test_there_is_no_growth_where_there_is_no_trim():
    assert math.isnan(growth_in(load(QUICK).parameters, WINDY_TUNING, 0.0, 8.0))


def gust(name, rate, mean_wind, by):
    grids = {"gust": name, "rate": rate, "mean_wind": mean_wind, "by": by}
    changes = {f"vary.{key}.grid": [value] for key, value in grids.items()}
    return {**craft_changes(TRUTH), "vehicle.controller": "by", **changes}


@pytest.mark.long
def test_a_gust_moves_it_and_is_rejected():
    found = fly_shipped("gusts", gust("Mexican hat, 0.2 Hz", 0.2, 3.0, "robust-pi")).measures
    assert found["rejected"]
    assert 0.3 < found["farthest"] < 1.5
    assert found["left"] < 0.05
    assert found["higher"] > 0.05


@pytest.mark.long(after=1)
@pytest.mark.parametrize("rate", [0.2, 1.2, 0.0])
def test_wavelets_peak_at_one_and_have_no_mean(rate):
    """A wind from the south is a negative one."""
    parameters = load_specification("gusts").flight.parameters
    values = []
    for time in np.arange(0.0, 40.0, 0.01):
        at = NumberWalker({"rate": rate, "mean_wind": 0.0, "t": float(time)})
        speed, azimuth = (at.number(parameters[key]) for key in ("SIM_WIND_SPD", "SIM_WIND_DIR"))
        values.append(0.2 * speed * (1.0 if azimuth == 0.0 else -1.0))
    assert max(values) == pytest.approx(1.0)
    assert abs(sum(values)) * 0.01 < 2e-3


def test_a_gust_that_is_not_rejected_refutes_its_controller():
    specification = load_specification("gusts", {"run.cases": 36})
    at = list(specification.measures).index("rejected")
    cases = [FlownCase(k, "time", "", tuple(float(k != 5 or m != at) for m in range(4))) for k in range(36)]
    result = CampaignResult(specification, cases, ended_early=False)
    claims = gust_claims(FlownStudy(result, quantities(specification, range(36)), ""))
    assert [claim.holds for claim in claims] == [True, False, True, True]
    assert claims[1].text == "report rejects the gusts"


def test_verdicts_on_the_winds():
    holds = [claim.holds for claim in claims.stability_claims(load(QUICK).parameters)]
    assert holds == [True, True, True]
