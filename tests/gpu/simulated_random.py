"""Random numbers, number types and end of episodes on simulated CUDA.

Run by test_simulated.py in a process with ``NUMBA_ENABLE_CUDASIM=1``.
"""

import math

import numpy as np
import pytest
import torch
from gymnasium.vector import AutoresetMode
from scipy.special import ndtri
from scipy.stats import kstest

from fish_env.envs.options import env_options
from fish_env.errors import ConfigError
from fish_env.gpu import arithmetic, random
from fish_env.gpu.batch import DeviceBatch
from fish_env.gpu.target import Target
from fish_env.gpu.vector import RoboticFish3DDeviceEnv
from fish_env.model import trigonometry
from tests.gpu import checkers

ANSWERS = (
    ((0, 0, 0, 0, 0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((0xFFFFFFFF,) * 6, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344, 0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
)
"""Counter and key, and the words: from the authors' file kat_vectors of Random123."""


@pytest.mark.parametrize(("given", "words"), ANSWERS)
def test_philox_gives_the_known_answers(given, words):
    assert tuple(map(int, random.philox(*map(np.uint64, given)))) == words


def test_the_normal_quantile_is_that_of_scipy():
    p = np.concatenate([np.linspace(1e-3, 1 - 1e-3, 400), [1e-9, 1 - 1e-9]])
    ours = [random.normal_quantile(float(value)) for value in p]
    np.testing.assert_allclose(ours, ndtri(p), rtol=0, atol=2e-8)
    np.testing.assert_allclose(ours[:-1], ndtri(p[:-1]), rtol=1e-14, atol=1e-14)


def drawn(seed, count=400, resets=1):
    device = DeviceBatch(env_options(), count, precision="float64")
    device.reset(seed)
    for _ in range(resets - 1):
        device.reset()
    return device._draws.copy_to_host()


def test_starts_are_uniform_and_independent_of_each_other():
    numbers = drawn(5)
    assert kstest(numbers.ravel(), "uniform").pvalue > 0.001
    correlation = np.corrcoef(numbers) - np.eye(len(numbers))
    assert np.abs(correlation).max() < 5 / math.sqrt(numbers.shape[1])


def test_seeds_and_episodes_draw_other_numbers_and_a_seed_repeats_them():
    first = drawn(5, 8)
    np.testing.assert_array_equal(first, drawn(5, 8))
    for other in (drawn(6, 8), drawn(5 + 2**32, 8), drawn(5, 8, resets=2)):
        assert (np.abs(first - other) > 1e-9).all()


def test_noise_has_the_deviations_that_were_asked_for():
    deviations = {"depth": 0.02, "velocity": 0.01, "rates": 0.1}
    device = DeviceBatch(env_options(observation_noise=deviations), 500, precision="float64")
    device.reset(3)
    noise = device._noise.copy_to_host()
    sd = device.options.noise_sd
    assert (noise[sd == 0.0] == 0.0).all()
    scaled = noise[sd > 0.0] / sd[sd > 0.0][:, None]
    assert kstest(scaled.ravel(), "norm").pvalue > 0.001
    correlation = np.corrcoef(scaled) - np.eye(len(scaled))
    assert np.abs(correlation).max() < 5 / math.sqrt(500)


def test_noise_is_drawn_anew_in_every_step():
    device = DeviceBatch(env_options(observation_noise={"depth": 0.02}), 2)
    device.reset(3)
    seen = [device._noise.copy_to_host()[0]]
    for _ in range(3):
        device.step()
        seen.append(device._noise.copy_to_host()[0])
    assert len({float(value) for row in seen for value in row}) == 8


@pytest.mark.parametrize("angle", [0.0, 0.7853, 1.6, -2.4, 3.2, -4.8, 40.0, -611.7, 5000.3])
def test_sine_and_cosine_hold_in_float32(angle):
    own = Target(np.float32, arithmetic.FLOAT32).device(trigonometry.sincos)
    sine, cosine = own(np.float32(angle))
    exact = float(np.float32(angle))
    assert abs(float(sine) - math.sin(exact)) < 2e-7
    assert abs(float(cosine) - math.cos(exact)) < 2e-7
    assert type(sine) is type(cosine) is np.float32


def test_every_number_of_a_kernel_has_the_type_of_the_device():
    """A literal of another type would make the arithmetic float64, and ten times slower or more."""
    own = Target(np.float32, arithmetic.FLOAT32)
    module = env_options(effects={"wave": {"amplitude": 0.05}}).model.kernels.module
    seen, waiting = set(), [own.device(module.lane_derivative)]
    while waiting:
        function = waiting.pop().py_func
        constants = [c for c in function.__code__.co_consts if isinstance(c, tuple)]
        numbers = [*function.__code__.co_consts, *(n for c in constants for n in c)]
        numbers += function.__globals__.values()
        assert not any(isinstance(number, float) for number in numbers), function
        for value in function.__globals__.values():
            if hasattr(value, "py_func") and value not in seen:
                seen.add(value)
                waiting.append(value)
    assert len(seen) > 30


def test_a_swim_in_float32_stays_near_that_in_float64():
    checkers.check_environment(steps=10, precision="float32", tolerance=2e-4)


def test_tensors_are_the_memory_of_the_device():
    env = RoboticFish3DDeviceEnv(2)
    observed, infos = env.reset(seed=0)
    before = observed.clone()
    assert observed.data_ptr() == env.batch.obs._ary.ctypes.data
    observed, reward, *_ = env.step(torch.full((2, 5), 0.5))
    assert (observed != before).any()
    assert reward.data_ptr() == env.batch.reward._ary.ctypes.data
    assert infos["time_s"].tolist() == pytest.approx([0.1, 0.1])


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_episodes_end_as_gymnasium_says(mode):
    env = RoboticFish3DDeviceEnv(2, max_episode_steps=2, autoreset_mode=mode, precision="float64")
    env.reset(seed=0)
    seen = []
    for _ in range(4):
        _, reward, terminated, truncated, infos = env.step(torch.zeros(2, 5))
        times = infos["time_s"].tolist()
        seen.append((round(10 * times[0]), bool(truncated[0]), bool(reward[0] != 0)))
        assert not terminated.any()
    expected = {
        AutoresetMode.SAME_STEP: [(1, 0, 1), (0, 1, 1), (1, 0, 1), (0, 1, 1)],
        AutoresetMode.NEXT_STEP: [(1, 0, 1), (2, 1, 1), (0, 0, 0), (1, 0, 1)],
        AutoresetMode.DISABLED: [(1, 0, 1), (2, 1, 1), (3, 1, 1), (4, 1, 1)],
    }[mode]
    assert seen == expected
    if mode is AutoresetMode.DISABLED:
        mask = torch.tensor([True, False])
        env.reset(options={"reset_mask": mask})
        assert infos["time_s"].tolist() == pytest.approx([0.0, 0.4])


def test_a_fish_that_fails_is_terminated_and_starts_anew():
    env = RoboticFish3DDeviceEnv(2, precision="float64")
    env.reset(seed=0)
    data = env.batch._data
    data[2, 0] = 0.01
    _, _, terminated, truncated, infos = env.step(torch.zeros(2, 5))
    assert terminated.tolist() == [True, False]
    assert not truncated.any()
    assert infos["final_info"]["failure"].tolist() == [1.0, 0.0]
    assert infos["final_info"]["depth"][0] < 0.05 < infos["depth"][0]


def test_success_takes_its_time_in_float32_too():
    """A hundred periods of 0.1 s in float32 may be a little less than 10 s."""
    config = {"success": {"depth": 9.0, "heading": 3.2, "speed": 99.0, "time": 1.0}}
    env = RoboticFish3DDeviceEnv(1, config=config)
    _, infos = env.reset(seed=0)
    reached = []
    for _ in range(11):
        env.step(torch.zeros(1, 5))
        reached.append(bool(infos["is_success"][0]))
    assert reached == [False] * 9 + [True] * 2


def test_actions_that_are_not_numbers_are_told():
    env = RoboticFish3DDeviceEnv(2)
    env.reset(seed=0)
    env.step(torch.tensor([[0.0, 0, 0, 0, 0], [0, math.nan, 0, 0, math.nan]]))
    with pytest.raises(ConfigError, match="2 action values were NaN"):
        env.reset()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda env: env.step(torch.zeros(2, 5)), "call reset"),
        (lambda env: env.reset(options={"goal": {}}), "batch.load"),
        (lambda env: env.reset(options={"reset_mask": torch.tensor([True, False])}), "first reset"),
        (lambda env: env.batch.reset(draws=np.zeros((2, 2))), "draws must have shape"),
        (lambda env: env.reset(seed=-1), "seed"),
    ],
)
def test_errors_say_what_to_change(wrong, message):
    with pytest.raises(ConfigError, match=message):
        wrong(RoboticFish3DDeviceEnv(2))


@pytest.mark.parametrize(
    ("options", "message"),
    [({"precision": "float16"}, "float32"), ({"autoreset": "always"}, "next_step")],
)
def test_unknown_names_are_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        DeviceBatch(env_options(), 2, **options)
