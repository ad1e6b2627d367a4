"""The errors a user meets."""

import pickle

import pytest

from fish_env import errors


def test_every_error_is_a_robotic_fish_error_and_says_when_it_is_raised():
    classes = [item for item in vars(errors).values() if isinstance(item, type)]
    raised = [item for item in classes if issubclass(item, Exception)]
    assert len(raised) == 10
    for item in raised:
        assert issubclass(item, errors.RoboticFishError)
        assert item.__doc__


def test_a_missing_extra_says_what_to_install():
    error = errors.missing_extra("Training a policy", "torch", "train")
    assert 'pip install "robotic-fish[train]"' in str(error)
    assert "Training a policy needs the package 'torch'" in str(error)
    with pytest.raises(ImportError):
        raise error


def test_a_divergence_carries_time_and_state_across_processes():
    error = pickle.loads(pickle.dumps(errors.SimulationDiverged(1.5, [1.0, 2.0])))
    assert (error.time_s, error.state) == (1.5, [1.0, 2.0])
    assert "t = 1.5000 s" in str(error)
    assert "smaller time step" in str(error)
