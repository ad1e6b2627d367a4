"""The checkers notice a device that computes something else.

Run by test_simulated.py in a process with ``NUMBA_ENABLE_CUDASIM=1``.
"""

import math

import pytest

from fish_env.errors import ConfigError
from fish_env.gpu import compiled, goals, loops, starting
from fish_env.gpu.target import Target
from fish_env.model import tail, trigonometry
from tests.gpu import checkers
from tests.gpu.simulated_physics import BACKLASH, BEATING, DELAY, LAG


def slightly_wrong(angle):
    return math.sin(angle) + 1e-8, math.cos(angle)


def no_power(tail, arm, force):
    return 0.0


def nothing(*_):
    """Does not do what it should."""


def forget():
    """Let no test have the kernels of another."""
    compiled.rollout_kernel.cache_clear()
    compiled.kernels_of.cache_clear()


@pytest.fixture(autouse=True)
def fresh():
    forget()
    yield
    forget()


@pytest.fixture
def broken(monkeypatch):
    """Puts a function in the place of a kernel, on the device alone."""

    def put(kernel, other):
        original = compiled._target

        def target(module, real, further):
            made = original(module, real, further)
            chosen = getattr(module, kernel) if isinstance(kernel, str) else kernel
            made._replacements |= Target(real, {chosen: other})._replacements
            return made

        monkeypatch.setattr(compiled, "_target", target)

    return put


@pytest.mark.parametrize(
    ("kernel", "other", "effects"),
    [
        (trigonometry.sincos, slightly_wrong, {}),
        ("accept_actuators", nothing, {}),
        ("lane_remember", nothing, BACKLASH),
        ("lane_command", nothing, DELAY),
        (tail.hinge_power, no_power, LAG),
    ],
    ids=["sine", "actuators", "memory", "late command", "power"],
)
def test_a_wrong_rollout_is_noticed(broken, kernel, other, effects):
    broken(kernel, other)
    with pytest.raises(AssertionError):
        checkers.check_rollout(effects)


@pytest.mark.parametrize(
    ("kernel", "options", "steps"),
    [
        (starting.start_pose, {}, 0),
        (starting.fill_ring, {}, 2),
        (starting.derive, {"randomization": "prior"}, 0),
        (starting.start_effects, BEATING, 0),
        (goals.track_goal, {"task": "track"}, 0),
        (goals.waypoints, {"task": "path"}, 0),
        (goals.station_goal, {"task": "station"}, 0),
        ("judge", {}, 1),
    ],
    ids=["pose", "ring", "derived", "effects", "track", "waypoints", "station", "judge"],
)
def test_a_wrong_start_or_step_is_noticed(broken, kernel, options, steps):
    broken(kernel, nothing)
    with pytest.raises((AssertionError, ConfigError)):
        checkers.check_environment(steps=steps, count=12, **options)


def test_a_fish_that_is_left_out_is_noticed(monkeypatch):
    """One block too few."""
    monkeypatch.setattr("fish_env.gpu.batch.blocks_for", lambda count: 1)
    monkeypatch.setattr("fish_env.gpu.batch.threads_for", lambda count: count - 1)
    with pytest.raises(AssertionError):
        checkers.check_environment(steps=0)


def test_a_type_that_is_left_as_it_was_is_noticed(monkeypatch):
    from tests.gpu import simulated_random

    monkeypatch.setattr(Target, "_constant", lambda self, constant: constant)
    with pytest.raises(AssertionError):
        simulated_random.test_every_number_of_a_kernel_has_the_type_of_the_device()


def test_a_stale_seed_is_noticed(monkeypatch):
    from tests.gpu import simulated_random

    monkeypatch.setattr(loops, "fill_draws", lambda draws, lane, number, seed: None)
    with pytest.raises(AssertionError):
        simulated_random.test_starts_are_uniform_and_independent_of_each_other()
