"""Rollouts and the environment on simulated CUDA in float64, against the compiled CPU kernels.

Run by test_simulated.py in a process with ``NUMBA_ENABLE_CUDASIM=1``.
"""

import numpy as np
import pytest
import torch

from fish_env.envs.options import env_options
from fish_env.errors import ConfigError
from fish_env.gpu import random
from fish_env.gpu.batch import DeviceBatch
from fish_env.gpu.starting import STREAM_START
from robofish_agents.training.privileged import Sight
from robofish_agents.training.tensor_shoal import TensorTruth
from tests.gpu import checkers

LAG = {"servo_lag": {"time_constant": 0.05}}
BACKLASH = {"servo_backlash": {"gap": 0.05}}
DELAY = {"servo_delay": {"delay": 0.12}}
BEATING = {
    "effects": LAG,
    "config": {"actuators": {"tail_amplitude": {"low": 0.2}, "tail_frequency": {"low": 1.0}}},
}
"""The tail beats from the start, so that states of effects do not start at zero."""
WALLS = {"tank": {"walls": [-1.2, 1.2, -1.2, 1.2]}}


@pytest.mark.parametrize("effects", [{}, LAG, BACKLASH, DELAY], ids=["lean", "lag", "play", "late"])
def test_a_rollout_on_the_device_is_that_of_the_cpu(effects):
    checkers.check_rollout(effects)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"task": "track"},
        {"task": "path"},
        {"task": "path", "config": WALLS},
        {"task": "station"},
        BEATING,
        {"effects": BACKLASH},
        {"observation_delay_s": 0.05, "action_delay_s": 0.13},
    ],
    ids=["hold", "track", "path", "walls", "station", "lag", "play", "delays"],
)
def test_the_environment_starts_and_steps_as_on_the_cpu(options):
    checkers.check_environment(**options)


@pytest.mark.parametrize(
    "task", ["track", "path", "station"], ids=["signals", "all three shapes of a path", "places"]
)
def test_many_starts_are_those_of_the_cpu(task):
    checkers.check_environment(steps=0, count=40, task=task, config=WALLS)


@pytest.mark.parametrize(
    "randomization",
    [
        "prior",
        {"mass.total": {"relative": 0.001}, "body.area[0]": [0.004, 0.006]},
        {"effects.servo_delay.delay": [0.0, 0.2], "tail.area": {"relative": 0.1}},
    ],
    ids=["correlated", "independent", "a delay of the tail"],
)
def test_drawn_parameters_are_those_of_the_cpu(randomization):
    checkers.check_environment(steps=2, randomization=randomization)


def test_a_batch_goes_on_from_one_of_the_cpu():
    options = env_options(effects=DELAY)
    batch = checkers.started(options, checkers.uniforms(options, 2))
    actions = np.full((2, 5), 0.4, np.float32)
    batch.step(actions)
    batch.step(-actions)
    device = DeviceBatch(options, 2, precision="float64", autoreset="disabled")
    device.load(batch)
    checkers.check_alike(device, batch)
    for _ in range(3):
        batch.step(actions)
        device.actions.copy_to_device(actions)
        device.step()
        checkers.check_alike(device, batch)


def test_a_fish_that_diverges_stays_where_it_was():
    options = env_options()
    batch = checkers.started(options, checkers.uniforms(options, 2))
    batch.state[7, 0] = 9e3
    device = DeviceBatch(options, 2, precision="float64", autoreset="disabled")
    device.load(batch)
    batch.step(np.zeros((2, 5)))
    device.step()
    assert np.isfinite(batch._data[device._rows.ROW_FAILED]).tolist() == [True, False]
    checkers.check_alike(device, batch)


def test_episodes_go_on_alike_behind_a_restart_within_a_step():
    """The device draws by itself; the CPU starts the same fish from what was drawn."""
    options = env_options(task="track", randomization={"tail.area": {"relative": 0.1}})
    count, actions = 3, np.full((3, 5), 0.3, np.float32)
    device = DeviceBatch(
        options, count, precision="float64", autoreset="same_step", max_episode_steps=2
    )
    device.reset(seed=7)
    batch = checkers.started(options, drawn_by(device))
    for step in range(1, 5):
        device.actions.copy_to_device(actions)
        device.step()
        batch.step(actions)
        ended = device.truncated.copy_to_host() | device.terminated.copy_to_host()
        assert ended.all() == (step % 2 == 0)
        if ended.any():
            outputs = batch.outputs.copy()
            assert checkers.difference(device.final_outputs.copy_to_host(), outputs) <= 1e-10
            last = device.final_obs.copy_to_host()
            assert np.allclose(last, batch.obs, atol=1e-6)
            checkers.restart(batch, np.flatnonzero(ended), drawn_by(device))
        checkers.check_alike(device, batch)


def drawn_by(device):
    """Uniform numbers (numbers, N) of the present episodes, as philox gives them."""
    numbers, seed = np.zeros(device._draws.shape), device._seed.copy_to_host()
    for lane in range(device.count):
        episode = np.uint64(device._whole.copy_to_host()[0, lane] - 1)
        for i in range(0, len(numbers), 4):
            words = random.philox(np.uint64(i), np.uint64(lane), episode, STREAM_START, *seed)
            rows = numbers[i : i + 4, lane]
            rows[:] = [random.unit(word) for word in words][: len(rows)]
    return numbers


def test_a_critic_sees_the_same_fish_on_the_device():
    options = env_options(task="track", randomization={"mass.buoyancy": {"sd": 0.001}})
    batch = checkers.started(options, checkers.uniforms(options, 3))
    batch.step(np.full((3, 5), 0.5))
    device = DeviceBatch(options, 3, precision="float64", autoreset="disabled")
    device.load(batch)
    found = Sight([TensorTruth(device)], torch).see(torch.from_numpy(batch.obs))
    assert np.allclose(found.numpy(), Sight([batch]).see(batch.obs), atol=1e-6)


def test_fish_that_count_steps_as_taken_end_earlier():
    device = DeviceBatch(env_options(), 3, precision="float64", max_episode_steps=4)
    device.reset(seed=0)
    device.set_elapsed([0, 2, 3])
    ended = []
    for _ in range(4):
        device.step()
        ended.append(device.truncated.copy_to_host().tolist())
    assert np.array(ended).argmax(0).tolist() == [3, 1, 0]
    with pytest.raises(ConfigError, match="elapsed steps: 3 whole numbers from 0 to 3"):
        device.set_elapsed([0, 2, 4])
