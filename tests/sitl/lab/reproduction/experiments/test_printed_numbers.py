"""The rows of the printed matrices depend on the model that flies."""

import pytest

from sitl.lab.reproduction.experiment import Conditions, Verdict
from sitl.lab.reproduction.experiments.printed_numbers import forward_rows, gain_rows, hover_model_rows, inverse_rows


def verdicts(conditions):
    a = conditions.airframe("published")
    rows = [*hover_model_rows(a), *gain_rows(a)[0], *forward_rows(a)[0]]
    return [row.verdict for row in rows + inverse_rows(a, conditions.airframe("report-table"))[0]]


def test_every_printed_entry_is_in_a_table_with_what_it_needs():
    a = Conditions().airframe("published")
    _, tables = forward_rows(a)
    rows = {row[0]: row for table in tables for row in table.rows}
    assert len(rows) == 25 + 18
    assert rows["w_y, w_y"][1] == "-7.77"
    assert rows["w_y, w_y"][4] == "slips: area, damping"
    assert rows["p_z, v_z"][4] == "kernel"
    assert rows["w_x, T1"][4] == "slips: one_number"
    assert not [row for row in rows.values() if row[4] == "neither"]


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    "factors",
    [
        *[((name, 1.1),) for name in ("m", "J2", "S", "b", "c", "C_d0", "Delta_r", "k_m", "C_lr", "C_np")],
        tuple((name, 0.0) for name in ("C_lp", "C_lr", "C_mq", "C_np", "C_nr")),
    ],
    ids=lambda factors: factors[0][0] if len(factors) == 1 else "no damping",
)
def test_an_altered_model_changes_a_verdict(factors):
    before, after = verdicts(Conditions()), verdicts(Conditions(factors=factors))
    assert Verdict.UNEXPLAINED not in before
    assert Verdict.UNEXPLAINED in after
