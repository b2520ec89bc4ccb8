"""Critical gains that are looked at: none of the two ways hides the other."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from design.frequency.nearest import nearest_each_way


@given(
    st.lists(
        st.tuples(st.integers(0, 3), st.sampled_from([-1.0, 0.0, np.nan, np.inf]) | st.floats(1e-6, 1e6)), max_size=40
    ),
    st.integers(1, 6),
)
def test_against_a_plain_sort(entries: list[tuple[int, float]], width: int) -> None:
    entries.sort(key=lambda each: each[0])
    rows = np.array([row for row, _ in entries], dtype=np.int64)
    ratio = np.array([value for _, value in entries], dtype=float)
    kept = nearest_each_way(rows, ratio, 4, width)
    for row in range(4):
        mine = ratio[rows == row]
        chosen = mine[kept[rows == row]]
        assert len(chosen) == min(width, len(mine))
        known = mine[(mine > 0.0) & np.isfinite(mine)]
        taken: list[float] = []
        ways = [sorted(known[known >= 1.0]), sorted(known[known < 1.0], reverse=True)]
        for k in range(len(known)):
            # A turn is one of each way; of one turn the nearer goes first.
            turn = [way[k] for way in ways if k < len(way)]
            taken += sorted(turn, key=lambda value: abs(np.log(value)))
        np.testing.assert_array_equal(
            np.sort(chosen[(chosen > 0.0) & np.isfinite(chosen)]), np.sort(taken[: min(width, len(taken))])
        )


def test_the_last_way_down_is_kept_among_many_ways_up() -> None:
    ratio = np.array([1.5, 2.0, 3.0, 4.0, 5.0, 1e-3, 6.0])
    kept = nearest_each_way(np.zeros(7, dtype=np.int64), ratio, 1, 3)
    np.testing.assert_array_equal(ratio[kept], [1.5, 2.0, 1e-3])
