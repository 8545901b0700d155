import numpy as np
import pytest

from dynslam_env.navigation.door_belief import HORIZONS
from dynslam_env.patrol.dwell_laws import (
    LOOK_ERROR,
    MEAN_DWELLS,
    PHASES,
    TICK,
    DoorFilter,
    DwellLaws,
    responsibilities,
    with_still,
)

LAWS = DwellLaws()
PRIOR = with_still(LAWS.prior, 0.5)


def is_closed(dwells, time):
    """Whether a door, open at first, is closed at `time`."""
    return bool(np.searchsorted(np.cumsum(dwells), time, "right") % 2)


def watched(dwells, end=None, period=0.2):
    """A filter that looked at a door, open at first, all the time until `end`."""
    door = DoorFilter(LAWS)
    for time in np.arange(0.0, end or sum(dwells), period):
        door.look(float(time), is_closed(dwells, time))
    return door


def own(door):
    return responsibilities(door.evidence, PRIOR)


def test_steps_are_probabilities_and_leave_the_stationary_distribution():
    assert LAWS.steps.sum(axis=-1) == pytest.approx(np.ones(LAWS.steps.shape[:-1]))
    for j in (0, 5):
        assert np.einsum("hi,hij->hj", LAWS.begin, LAWS.steps[:, j]) == pytest.approx(LAWS.begin)


def test_a_gap_is_the_product_of_the_steps_of_each_law():
    door, ticks = DoorFilter(LAWS), 37
    phases = LAWS.begin * np.repeat([1.0 - LOOK_ERROR, LOOK_ERROR], PHASES)
    phases /= phases.sum(axis=1, keepdims=True)
    door.look(0.0, False)
    gap = np.array([np.linalg.matrix_power(law, ticks) for law in LAWS.steps[:, 0]])
    after = np.einsum("hi,hij->hj", phases, gap)
    closed = after[:, PHASES:].sum(axis=1)
    assert door.phases == pytest.approx(phases, abs=1e-12)
    assert door.closed(ticks * TICK) == pytest.approx(closed, abs=1e-9)
    door.look(ticks * TICK, True)
    shown = after * np.repeat([LOOK_ERROR, 1.0 - LOOK_ERROR], PHASES)
    assert door.phases == pytest.approx(shown / shown.sum(axis=1, keepdims=True), abs=1e-9)
    first = np.log(LAWS.begin @ np.repeat([1.0 - LOOK_ERROR, LOOK_ERROR], PHASES))
    assert door.evidence == pytest.approx(first + np.log(shown.sum(axis=1)), abs=1e-9)


def test_the_law_that_made_the_flips_is_found():
    rng = np.random.default_rng(3)
    share = own(watched(rng.uniform(5.0, 20.0, 60)))[:-1].reshape(2, len(MEAN_DWELLS), -1)
    assert share[1].sum() > 0.99  # regular, not memoryless
    for axis in (1, 2):  # of the open, and of the closed state
        mean = share.sum(axis=tuple({0, 1, 2} - {axis})) @ MEAN_DWELLS
        assert 9.0 < mean < 16.0


def test_a_door_that_never_flips_is_known_to_be_still_in_the_end():
    still = [own(watched([seconds]))[-1] for seconds in (5.0, 60.0, 1200.0)]
    assert still == sorted(still)
    assert still[-1] > 0.8


def test_forecasts_of_regular_doors_beat_a_guess_and_fade_with_the_gap():
    rng = np.random.default_rng(5)
    errors = {gap: [] for gap in (1.0, 4.0, 300.0)}
    for _ in range(40):
        dwells = rng.uniform(5.0, 20.0, 80)
        door = watched(dwells, end=rng.uniform(200.0, 220.0))
        assert door.time is not None
        for gap, found in errors.items():
            p = float(own(door) @ door.closed(door.time + gap))
            found.append((p - is_closed(dwells, door.time + gap)) ** 2)
    mean = {gap: np.mean(found) for gap, found in errors.items()}
    assert mean[1.0] < mean[4.0] < mean[300.0] < 0.26


def test_flips_are_counted_and_a_gap_is_not_watched():
    door = DoorFilter(LAWS)
    for time, closed in ((0.0, False), (0.2, False), (0.4, True), (50.0, True), (50.2, False)):
        door.look(time, closed)
    assert door.flips == 2
    assert door.watched == pytest.approx(0.6)
    assert door.time == 50.2
    assert not door.state


def test_a_look_decides_now_and_less_later():
    door = DoorFilter(LAWS)
    door.look(1.0, True)
    p = [float(PRIOR @ door.closed(1.0 + gap)) for gap in (0.0, TICK, 5.0, 100.0, 1e6)]
    assert p[0] > 0.99
    assert p == sorted(p, reverse=True)
    assert p[-1] > 0.5


def test_a_forecast_is_what_is_believed_at_each_horizon():
    door = DoorFilter(DwellLaws())
    door.look(1.0, True)
    door.look(30.0, False)
    expected = np.stack([door.closed(47.3 + ahead) for ahead in HORIZONS], axis=1)
    assert door.expected(47.3).forecast == pytest.approx(expected)


@pytest.mark.parametrize("closed", [False, True])
def test_what_a_look_would_show_is_what_it_shows(closed):
    door = DoorFilter(DwellLaws())
    door.look(1.0, True)
    expected = door.expected(47.3)
    door.look(47.3, closed)
    assert expected.evidence[int(closed)].tolist() == door.evidence.tolist()
    assert expected.looked[int(closed)].tolist() == door.expected(47.3).forecast.tolist()
