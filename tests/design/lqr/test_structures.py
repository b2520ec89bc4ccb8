import pytest

from design.lqr.structures import Structure
from model.actuators import Actuator
from model.linear_model import STATES

LAGGED = Actuator(torque_loop_bandwidth=300.0, delay=0.004)


@pytest.mark.parametrize(
    ("reference", "references", "integrals"),
    [("none", (), ()), ("aileron", ("r_a",), ("int_a",)), ("aileron_and_tab", ("r_a", "r_t"), ("int_a", "int_t"))],
)
def test_references_and_integrals(reference, references, integrals):
    structure = Structure(reference)
    assert structure.references == references
    assert structure.integrals == integrals
    assert structure.weighted_states() == (*STATES, *integrals)
    assert structure.states(STATES) == structure.weighted_states()


def test_the_order_of_the_states():
    structure = Structure("aileron_and_tab", LAGGED, LAGGED, delay_states=2)
    assert structure.states((*STATES, "lag_1", "lag_2")) == (
        "dt", "dt_rate", "da", "da_rate", "int_a", "int_t", "tab_torque", "aileron_torque", "lag_1", "lag_2",
        "tab_delay_1", "tab_delay_2", "aileron_delay_1", "aileron_delay_2",
    )  # fmt: skip


def test_only_what_there_is_has_states():
    tab, aileron = Structure("none", Actuator(delay=0.004), Actuator(torque_loop_bandwidth=100.0), 3).drives
    assert (tab.torque_state, len(tab.chain)) == (None, 3)
    assert (aileron.torque_state, aileron.chain) == ("aileron_torque", ())
    without = Structure("none", Actuator(delay=0.004)).drives[0]
    assert (without.delay, without.chain) == (0.004, ())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"reference": "tab"}, "reference must be one of"),
        ({"tab": Actuator(torque_loop_bandwidth=0.0)}, "tab's torque loop"),
        ({"aileron": Actuator(torque_loop_bandwidth=float("nan"))}, "aileron's torque loop"),
        ({"aileron": Actuator(delay=-1e-3)}, "delay of the aileron"),
        ({"delay_states": -1}, "-1 states"),
    ],
)
def test_structures_that_do_not_exist(arguments, words):
    with pytest.raises(ValueError, match=words):
        Structure(**arguments)
