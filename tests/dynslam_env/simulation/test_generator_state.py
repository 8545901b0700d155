import numpy as np
import pytest

from dynslam_env.simulation.generator_state import GeneratorState


@pytest.mark.parametrize("bits", [np.random.PCG64, np.random.Philox])
def test_a_generator_goes_on_from_where_it_was(bits):
    rng = np.random.Generator(bits(np.random.SeedSequence(3, spawn_key=(1, 2))))
    rng.random(5)
    rng.spawn(2)
    state = GeneratorState(rng)
    expected = rng.random(4), rng.integers(0, 9, 3), rng.spawn(1)[0].random(2)
    again = state.generator()
    for one, other in zip(expected, (again.random(4), again.integers(0, 9, 3)), strict=False):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(again.spawn(1)[0].random(2), expected[2])
    assert rng.random() == again.random()  # neither draws from the other
