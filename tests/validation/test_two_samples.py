"""The tests of two samples find what differs, and only that as often as they say."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from validation.two_samples.__main__ import CONTACTS, NUMBERS, compared, numbers_of
from validation.two_samples.tests import energy_distance, energy_test


def test_the_energy_distance_of_one_number() -> None:
    """Cross-check: half of its root is the distance of SciPy's, of two distribution functions."""
    random = np.random.default_rng(2)
    one, other = random.normal(size=40), random.normal(0.5, 2.0, size=55)
    assert energy_distance(one[:, None], other[:, None]) == pytest.approx(stats.energy_distance(one, other) ** 2, rel=1e-12)


def test_p_is_uniform_for_equal_distributions_and_small_for_others() -> None:
    """Closed form: p of equal distributions lies below .25 in about a quarter of the cases; a shift by a deviation is found."""
    random = np.random.default_rng(3)
    below = 0
    for k in range(120):
        below += energy_test(random.normal(size=(20, 2)), random.normal(size=(25, 2)), permutations=39, seed=k)[1] <= 0.25
    assert 0.25 * 120 - 15 < below < 0.25 * 120 + 15
    shifted = random.normal(size=(60, 2)) + np.array([0.0, 1.0])
    assert energy_test(random.normal(size=(60, 2)), shifted)[1] == pytest.approx(0.001)


def test_stopped_runs_are_left_out_in_pairs() -> None:
    """Contract: a compliant run that stopped takes its pair with it, a hard one only itself."""
    random = np.random.default_rng(4)
    names = [*NUMBERS, CONTACTS]
    hard = pd.DataFrame(random.normal(20.0, 2.0, size=(40, 3)), columns=names)
    compliant = hard.iloc[:16] + 0.1 + 0.01 * random.normal(size=(16, 3))
    compliant.iloc[2] = np.nan
    hard.iloc[30] = np.nan
    rows, (_, p), sizes = compared(compliant, hard)
    assert sizes == (15, 23)
    assert [row[0] for row in rows] == names
    assert all(float(row[5]) == pytest.approx(-0.1, abs=0.02) for row in rows)
    assert all(float(row[7]) < 1e-3 for row in rows)
    assert p > 0.01


def test_numbers_of_a_table() -> None:
    """Identity: in mm and N m, the largest count of any joint; those of a run that stopped are not known."""
    table = pd.DataFrame({"status": ["complete", "failed"], **{column: [2e-3, 1.0] for column, _ in NUMBERS.values()}})
    table["O.contact_count [1]"], table["A.contact_count [1]"] = [3.0, 9.0], [5.0, 9.0]
    found = numbers_of(table)
    assert found.iloc[0].tolist() == [2.0, 2e-3, 5.0]
    assert found.iloc[1].isna().all()
