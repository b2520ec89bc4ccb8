import numpy as np
import pytest

from design.specs import QUANTITIES, SPEC_PACKS, Spec, Verdict


@pytest.mark.parametrize(
    ("sense", "values", "met", "distance"),
    [
        ("min", [5.9, 6.0, 7.0, np.nan], [False, True, True, False], [-0.1, 0.0, 1.0, np.nan]),
        ("max", [5.9, 6.0, 7.0, np.nan], [True, True, False, False], [0.1, 0.0, -1.0, np.nan]),
    ],
)
def test_both_senses(sense, values, met, distance):
    spec = Spec("gain_margin", sense, 6.0)
    assert spec.met(np.array(values)).tolist() == met
    np.testing.assert_allclose(spec.distance(np.array(values)), distance, atol=1e-12)


def test_worst_point_is_the_smallest_distance_and_a_missing_value_is_worse():
    spec = Spec("settling_time", "max", 0.5)
    values = np.array([0.2, 0.4, np.nan, 0.45])
    judged = np.array([True, True, False, True])
    assert Verdict(spec, values, judged, judged & spec.met(values)).worst == 3
    judged = np.array([True, True, True, True])
    assert Verdict(spec, values, judged, judged & spec.met(values)).worst == 2
    assert Verdict(spec, values, ~judged, ~judged).worst is None


def test_packs_use_known_quantities():
    for pack in SPEC_PACKS.values():
        for spec in pack:
            assert spec.quantity in QUANTITIES
            assert spec.source == "spec_pack"
