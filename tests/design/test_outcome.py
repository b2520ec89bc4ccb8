import numpy as np

from design.outcome import Outcome, Outcomes


def test_first_failure_keeps_its_reason():
    outcomes = Outcomes.all_ok((2, 2))
    first = np.array([[True, False], [False, False]])
    both = np.array([[True, True], [False, False]])
    outcomes = outcomes.failing(first, Outcome.OUTSIDE_MODEL, lambda index: f"first {index}")
    outcomes = outcomes.failing(both, Outcome.INFEASIBLE, lambda index: f"second {index}")
    assert outcomes.codes.tolist() == [["outside_model", "infeasible"], ["ok", "ok"]]
    assert outcomes.reasons.tolist() == [["first (0, 0)", "second (0, 1)"], [None, None]]
    assert outcomes.ok.tolist() == [[False, False], [True, True]]


def test_single_point():
    outcomes = Outcomes.all_ok(()).failing(np.array(True), Outcome.NOT_CERTIFIED, lambda index: f"at {index}")
    assert not outcomes.ok
    assert outcomes.reasons[()] == "at ()"


def test_outcomes_are_read_only_and_the_original_is_untouched():
    original = Outcomes.all_ok((3,))
    original.failing(np.array([True, False, False]), Outcome.INFEASIBLE, lambda index: "x")
    assert original.ok.all()
    assert not original.codes.flags.writeable
    assert original.codes[0] is Outcome.OK


def test_one_point_of_a_grid_can_fail_too():
    one = Outcomes.all_ok((2, 2)).take((0, 1)).failing(np.array(True), Outcome.INFEASIBLE, lambda index: "no")
    assert one.codes[()] is Outcome.INFEASIBLE
