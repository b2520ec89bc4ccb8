"""Which states are the controller's, by name and by what drives them."""

import pytest

from design.estimation.kalman_filter import kalman_filter
from design.estimation.observer import with_kalman_filter
from design.estimation.rate_filters import with_rate_filters
from design.estimation.readings import controller_states
from tests.design.estimation.estimation_cases import CASES, NOISE, full_state


@pytest.mark.parametrize("name", CASES)
def test_the_controllers_states_are_driven_by_measured_angles_torques_and_their_own_alone(name):
    """A digital controller can run them: no command drives one but through its own model, and none drives the plant."""
    loop = full_state(name)
    for made in (with_rate_filters(loop, 300.0), with_kalman_filter(loop, kalman_filter(loop, NOISE))):
        own = [made.states.index(state) for state in controller_states(made.states)]
        outside = [i for i in range(len(made.states)) if i not in own]
        assert set(range(len(loop.states), len(made.states))) <= set(own)
        assert not made.B[..., own, :].any()
        assert not made.A[..., outside, :][..., own].any()
        measured = {"dt", "da", "tab_torque", "aileron_torque"}
        hidden = [i for i in outside if made.states[i] not in measured]
        assert not made.A[..., own, :][..., hidden].any()
        assert not made.K[..., hidden].any()


def test_names():
    plant = ("dt", "dt_rate", "da", "da_rate", "tab_torque", "aileron_torque", "lag_1", "lag_2")
    own = ("int_a", "int_t", "tab_delay_1", "aileron_delay_12", "da_filtered", "lag_1_filtered", "est_dt", "est_lag_2")
    assert controller_states((*plant, *own)) == own
