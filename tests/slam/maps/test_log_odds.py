import math

import numpy as np
import pytest

from slam.errors import InputError
from slam.maps.log_odds import Evidence, probability


def test_log_odds_and_probability_are_inverse() -> None:
    assert probability(np.array([0.0])) == 0.5
    evidence = Evidence(prior=0.2)
    assert evidence.prior_log_odds == pytest.approx(math.log(0.25))
    assert probability(np.array([evidence.prior_log_odds]))[0] == pytest.approx(0.2)


@pytest.mark.parametrize(
    "wrong",
    [{"hit": 0.0}, {"hit": -1.0}, {"free": 0.0}, {"free": 0.1}, {"prior": 0.0}, {"prior": 1.0}],
)
def test_evidence_that_says_nothing_is_refused(wrong: dict) -> None:
    with pytest.raises(InputError, match="hit > 0 > free"):
        Evidence(**wrong)


def test_what_was_seen_free_a_thousand_times_is_free() -> None:
    assert probability(np.array([-1000.0, 1000.0])).tolist() == [0.0, 1.0]
