"""A register of laws with contradictions is refused in words, before anything flies."""

from enum import IntEnum
from typing import NamedTuple

import pytest

from protocol.dialect.vocabulary import Law, Reason
from sitl.compiled import kernel
from sitl.control.laws import LAWS, LawRow, ValueRow
from sitl.errors import SitlError
from sitl.model.airframe_files import load
from sitl.model.state import Actuators
from sitl.simulation.simulation import Simulation
from sitl.supervisor import guards
from sitl.supervisor.guards import Guard
from sitl.supervisor.resets import Reset
from sitl.supervisor.table import TABLE, Jump
from tests.support.flights.own_laws import FORGET, OWN, Ascended, AscendGains, OwnLaw, ascend, enough, forget, register


@kernel
def asks_for_the_plant(plant):
    return Actuators(0.0, 0.0, 0.0, 0.0), 0


@kernel
def asks_for_its_gains(gains):
    return Actuators(0.0, 0.0, 0.0, 0.0), 0


class OddState(NamedTuple):
    ascended: Ascended
    plant: float


@kernel
def keeps_the_plant(state: OddState):
    return Actuators(0.0, 0.0, 0.0, 0.0), 0, state


@kernel
def keeps_a_number(state: float):
    return Actuators(0.0, 0.0, 0.0, 0.0), 0, state


@kernel
def keeps_what_is_not_said(state):
    return Actuators(0.0, 0.0, 0.0, 0.0), 0, state


def jump(**parts):
    return {**OWN.table, OwnLaw.ASCEND: (Jump("odd", Law.HOVER_ZERO_MOMENT, Reason.SPEED, **parts),)}


def compiled(*arguments, **changes):
    return lambda: register(*arguments, **changes).compile()


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (
            compiled(asks_for_the_plant),
            "law ASCEND asks for 'plant': there is a, ascend_gains, ascended, at_rest",
        ),
        *(
            (compiled(step), "the state of law ASCEND is no NamedTuple of slots: integral, side, pointing")
            for step in (keeps_the_plant, keeps_a_number, keeps_what_is_not_said)
        ),
        (
            compiled(laws=[*LAWS, LawRow(OwnLaw.ASCEND, asks_for_its_gains)], table={**TABLE, **OWN.table}),
            "law ASCEND asks for 'gains'",
        ),
        (
            compiled(table=jump(when=(Guard("seer", "Sees.", 1 << 41, asks_for_the_plant),))),
            "guard seer asks for 'plant'",
        ),
        (compiled(table=jump(resets=(Reset("odd", ("pointing",), asks_for_the_plant),))), "reset odd asks for 'plant'"),
        (compiled(values=(*OWN.values.values(), ValueRow("v", asks_for_the_plant, "ascend"))), "value v asks for"),
        (
            compiled(table=jump(resets=(Reset("odd", ("nothing",), forget),))),
            "reset odd sets 'nothing': there is ascended, at_",
        ),
        (
            compiled(laws=[*LAWS, LawRow(OwnLaw.ASCEND, ascend, "slope")], table={**TABLE, **OWN.table}),
            "law ASCEND takes gains 'slope': there is ascend, forward_linear",
        ),
        (compiled(laws=[*LAWS, LawRow(IntEnum("Odd", {"NEW": 2}).NEW, ascend)]), "law number 2 stands for two"),
        (
            compiled(laws=[*LAWS, LawRow(IntEnum("Odd", {"ALIGN": 99}).ALIGN, ascend)]),
            "law name 'ALIGN' stands for two",
        ),
        (
            compiled(table=jump(when=(guards.v_below_enter, Guard("v_below_enter", "", 1 << 41, enough)))),
            "guard name 'v_below_enter' stands for",
        ),
        (
            compiled(table=jump(when=(guards.v_below_enter, Guard("odd", "", guards.v_below_enter.bit, enough)))),
            "guard bit 8 stands for",
        ),
        (
            compiled(table=jump(resets=(FORGET, Reset("forget", ("pointing",), forget)))),
            "reset name 'forget' stands for",
        ),
        (compiled(states={"ascended": Ascended, "pointing": Ascended}), "state slot 'pointing' is there already"),
        (compiled(gains={"ascend": AscendGains(1.0, 1), "wind": AscendGains(1.0, 1)}), "gains 'wind' is there already"),
        (compiled(table={Law.LANDED: (), Law.HOVER_ZERO_MOMENT: ()}), "no row of the table for ASCEND"),
        (
            compiled(table={**OWN.table, Law.LANDED: (Jump("odd", Law.ALIGN, Reason.COMMAND),)}),
            "jump 'odd' of LANDED leads to <Law.ALIGN: 3>: it is not registered",
        ),
    ],
)
def test_what_does_not_fit_together_is_refused_in_words(made, said):
    with pytest.raises(SitlError) as refused:
        made()
    assert said in str(refused.value)


def test_a_simulation_is_not_made_with_what_is_refused():
    with pytest.raises(SitlError, match="asks for 'plant'"):
        Simulation(load("nominal").parameters, register=register(asks_for_the_plant))
