import math

import numpy as np
import pytest
from scipy import stats

from dynslam_env.simulation.laws import (
    Coupled,
    Exponential,
    Fixed,
    Law,
    Periodic,
    Scripted,
    Uniform,
)
from slam import InputError

LAWS = [
    Uniform(),
    Exponential(),
    Periodic(),
    Scripted(((3.0, 1), (0.5, 7), (3.0, 0), (90.0, 1))),
    Fixed(),
    Coupled(),
    Coupled(Exponential(), opposed=True),
]
RANDOM = [Uniform(), Exponential(), Periodic(), Coupled()]


def generator(seed=0):
    return np.random.default_rng(seed)


def flips(law, count=8, until=math.inf, most=1000, seed=0):
    """(time, door) of the first flips, each at its exact time."""
    clock, found = law.clock(count, generator(seed)), []
    while clock.next_flip <= until and clock.next_flip < math.inf and len(found) < most:
        at = clock.next_flip
        told = clock.flips_until(at)
        assert told
        found += [(at, door) for door in told]
    return found


def flips_in_steps(law, step, until, count=8, seed=0):
    """(step, door) in the order told, asked every `step` s."""
    clock = law.clock(count, generator(seed))
    return [
        (i, door) for i in range(round(until / step) + 1) for door in clock.flips_until(i * step)
    ]


def dwells(law, each=500, count=8, seed=0):
    """The first `each` dwell times of every door. (All until some moment: too few long ones.)"""
    times = [[0.0] for _ in range(count)]
    for time, door in flips(law, count, most=4 * each * count, seed=seed):
        times[door].append(time)
    assert min(map(len, times)) > each
    return np.concatenate([np.diff(t[: each + 1]) for t in times])


def p_value(sample, distribution):
    return stats.kstest(sample, distribution.cdf).pvalue


U_5_20, EXP_12_5 = stats.uniform(5, 15), stats.expon(scale=12.5)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("law", "right", "wrong"),
    [
        (Uniform(), U_5_20, [stats.uniform(5, 16), stats.uniform(4, 16), EXP_12_5]),
        (Uniform(1.0, 2.0), stats.uniform(1, 1), [stats.uniform(1, 1.1), U_5_20]),
        (Exponential(), EXP_12_5, [stats.expon(scale=14.0), stats.expon(scale=11.0), U_5_20]),
        (Exponential(1.0), stats.expon(), [stats.expon(scale=1.2), EXP_12_5]),
    ],
    ids=["uniform", "uniform 1 to 2 s", "exponential", "exponential 1 s"],
)
def test_dwell_times_have_the_laws_distribution(law, right, wrong, seed):
    sample = dwells(law, seed=seed)
    assert p_value(sample, right) > 0.001
    assert all(p_value(sample, other) < 0.001 for other in wrong)


def test_uniform_dwell_times_keep_their_bounds():
    sample = dwells(Uniform())
    assert 5.0 <= sample.min() + 1e-9 < 5.1
    assert 19.9 < sample.max() - 1e-9 <= 20.0


def test_dwell_times_do_not_depend_on_each_other():
    for law in (Uniform(), Exponential()):
        rows = dwells(law, each=500).reshape(8, 500)
        for a, b in ((rows[:, :-1], rows[:, 1:]), (rows[:-1], rows[1:])):
            correlation = np.corrcoef(a.ravel(), b.ravel())[0, 1]
            assert abs(correlation) < 3.3 / math.sqrt(a.size)


def test_exponential_doors_together_are_one_poisson_process():
    merged = np.diff([0.0, *(time for time, _ in flips(Exponential(), most=4000))])
    assert p_value(merged, stats.expon(scale=12.5 / 8)) > 0.001
    uniform = np.diff([0.0, *(time for time, _ in flips(Uniform(), most=4000))])
    assert p_value(uniform, stats.expon(scale=12.5 / 8)) < 0.001


@pytest.mark.parametrize("seed", range(3))
def test_periodic_phases_are_uniform_and_periods_constant(seed):
    count = 4000
    found = flips(Periodic(3.0), count, most=3 * count, seed=seed)
    phases = [time for time, _ in found[:count]]
    assert sorted(door for _, door in found[:count]) == list(range(count))
    assert p_value(phases, stats.uniform(0, 3)) > 0.001
    assert p_value(phases, stats.uniform(0, 3.2)) < 0.001
    assert np.abs(dwells(Periodic(3.0)).reshape(8, 500)[:, 1:] - 3.0).max() < 1e-9


def test_a_script_is_followed_to_the_bit():
    script = ((7.3, 2), (0.1 + 0.2, 0), (0.0, 1), (7.3, 0), (7.3, 2), (1e9, 1))
    assert flips(Scripted(script), count=3) == sorted(script)
    clock = Scripted(script).clock(3, generator())
    assert [clock.flips_until(t) for t in (0.0, 0.3, 0.1 + 0.2, 7.29, 7.3)] == [
        [1],
        [],
        [0],
        [],
        [0, 2, 2],
    ]
    assert clock.next_flip == 1e9
    assert clock.flips_until(2e9) == [1]
    assert clock.next_flip == math.inf


def test_a_script_can_be_told_again():
    law = Scripted(((2.0, 0), (1.0, 1)))
    assert flips(law, count=2) == flips(law, count=2) == [(1.0, 1), (2.0, 0)]


def test_lists_make_a_script_too():
    law = Scripted([[2.0, 0], [1.0, 1]])  # pyright: ignore[reportArgumentType]
    assert law == Scripted(((2.0, 0), (1.0, 1)))
    assert hash(law) == hash(Scripted(((2.0, 0), (1.0, 1))))


def test_static_doors_never_flip():
    clock = Fixed().clock(8, generator())
    assert clock.next_flip == math.inf
    assert not any(clock.flips_until(time) for time in np.arange(0.0, 1e4, 100.0))


@pytest.mark.parametrize("count", [1, 2, 7, 8])
@pytest.mark.parametrize("law", [Uniform(), Exponential(), Periodic()], ids=str)
def test_coupled_doors_flip_in_pairs_at_the_laws_times(law, count):
    alone = flips(law, (count + 1) // 2, until=200.0)
    pairs = [(t, door) for t, k in alone for door in (2 * k, 2 * k + 1) if door < count]
    assert flips(Coupled(law), count, until=200.0) == pairs
    assert {door for _, door in pairs} == set(range(count))


def test_a_coupled_script_names_pairs():
    law = Coupled(Scripted(((1.0, 1), (2.0, 0))))
    assert flips(law, count=3) == [(1.0, 2), (2.0, 0), (2.0, 1)]
    with pytest.raises(InputError, match="below their count of 1, got door 1"):
        law.clock(2, generator())


def test_pairs_begin_alike_or_contrary():
    drawn = np.array([True, True, False, True, True])
    alike, opposed = (Coupled(opposed=o).initial_states(drawn, generator()) for o in (False, True))
    assert alike.tolist() == [True, True, False, False, True]
    assert opposed.tolist() == [True, False, False, True, True]
    assert drawn.tolist() == [True, True, False, True, True]


@pytest.mark.parametrize("law", LAWS[:5], ids=str)
def test_other_doors_begin_as_drawn(law):
    rng, drawn = generator(), generator(1).random(9) < 0.5
    assert (law.initial_states(drawn, rng) == drawn).all()
    assert rng.bit_generator.state == generator().bit_generator.state


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_the_same_seed_gives_the_same_flips(law):
    assert flips(law) == flips(law)


@pytest.mark.parametrize("law", RANDOM, ids=str)
def test_another_seed_gives_other_flips(law):
    assert flips(law)[0][0] != flips(law, seed=1)[0][0]


@pytest.mark.parametrize("law", LAWS, ids=str)
@pytest.mark.parametrize("step", [0.1, 1.0, 100.0])
def test_how_often_one_asks_changes_no_flip(law, step):
    exact = flips(law, until=1000.0)
    told = flips_in_steps(law, step, until=1000.0)
    assert [door for _, door in told] == [door for _, door in exact]
    for (i, _), (time, _) in zip(told, exact, strict=True):
        assert (i - 1) * step < time <= i * step


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_before_the_next_flip_there_are_none(law):
    skipping, asking = (law.clock(8, generator(3)) for _ in range(2))
    for time in np.arange(0.0, 200.0, 0.1).tolist():
        skipped = skipping.flips_until(time) if skipping.next_flip <= time else []
        assert list(asking.flips_until(time)) == list(skipped)


def test_uniform_flips_are_those_of_version_0_1():
    """A plain copy of its rule: seeds keep their episodes."""
    rng, other, found = generator(5), generator(5), []
    due = rng.uniform(5.0, 20.0, 8).tolist()
    while len(found) < 500:
        door = due.index(min(due))
        found.append((due[door], door))
        due[door] += rng.uniform(5.0, 20.0)
    clock = Uniform().clock(8, other)
    assert [(clock.next_flip, *clock.flips_until(clock.next_flip)) for _ in range(500)] == found
    assert rng.bit_generator.state == other.bit_generator.state


def test_doors_that_flip_at_once_are_told_by_number():
    assert flips(Uniform(5.0, 5.0), count=3, until=10.0) == [
        (time, door) for time in (5.0, 10.0) for door in range(3)
    ]


@pytest.mark.parametrize("law", [*RANDOM, Fixed(), Scripted(), Coupled(Fixed())], ids=str)
def test_no_doors_no_flips(law):
    assert flips(law, count=0) == []
    assert len(law.initial_states(np.zeros(0, dtype=np.bool_), generator())) == 0


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_each_is_a_law_that_can_be_compared_and_hashed(law):
    assert isinstance(law, Law)
    assert len({law, eval(repr(law))}) == 1


@pytest.mark.parametrize("time", [math.inf, math.nan])
@pytest.mark.parametrize("law", LAWS, ids=str)
def test_a_clock_is_not_asked_for_ever(law, time):
    with pytest.raises(InputError, match="time must be a finite number"):
        law.clock(8, generator()).flips_until(time)


@pytest.mark.parametrize(
    ("law", "wrong", "message"),
    [
        (Uniform, {"shortest": 0.0}, "Uniform.shortest .* at least 0.001, got 0.0"),
        (Uniform, {"shortest": 1e-300, "longest": 1e-300}, "Uniform.shortest .* at least 0.001"),
        (Uniform, {"shortest": -1.0}, "Uniform.shortest .* got -1.0"),
        (Uniform, {"longest": math.inf}, "Uniform.longest must be a finite number"),
        (Uniform, {"shortest": math.nan}, "Uniform.shortest must be a finite number"),
        (Uniform, {"shortest": "5"}, "Uniform.shortest must be a finite number .* got '5'"),
        (Uniform, {"shortest": 30.0}, "Uniform needs shortest <= longest, got 30 > 20 s"),
        (Exponential, {"mean": 0.0}, "Exponential.mean .* at least 0.001, got 0.0"),
        (Exponential, {"mean": math.inf}, "Exponential.mean must be a finite number"),
        (Periodic, {"period": 0.0}, "Periodic.period .* at least 0.001, got 0.0"),
        (Periodic, {"period": True}, "Periodic.period must be a finite number .* got True"),
        (Scripted, {"flips": ((-0.1, 0),)}, "a time of Scripted.flips .* at least 0, got -0.1"),
        (Scripted, {"flips": ((math.inf, 0),)}, "a time of Scripted.flips .* got inf"),
        (Scripted, {"flips": ((1.0, 1.5),)}, "a door of Scripted.flips .* whole .* got 1.5"),
        (Scripted, {"flips": ((1.0, -1),)}, "a door of Scripted.flips .* at least 0, got -1"),
        (Scripted, {"flips": (1.0, 2)}, r"Scripted.flips must hold pairs \(time, door\), got 1.0"),
        (Scripted, {"flips": ((1.0, 2, 3),)}, r"pairs \(time, door\), got \(1.0, 2, 3\)"),
        (Scripted, {"flips": 4.0}, r"Scripted.flips must hold pairs \(time, door\), got 4.0"),
        (Coupled, {"law": "uniform"}, "Coupled.law must be a Law, got 'uniform'"),
        (Coupled, {"opposed": 1}, "Coupled.opposed must be a bool, got 1"),
    ],
)
def test_wrong_values_are_refused(law, wrong, message):
    with pytest.raises(InputError, match=message):
        law(**wrong)


def test_a_script_for_other_doors_is_refused():
    with pytest.raises(InputError, match="below their count of 8, got door 8 at 4"):
        Scripted(((1.0, 7), (4.0, 8))).clock(8, generator())
