"""MPPI: what it predicts comes true, and it holds what it is asked to hold."""

from dataclasses import replace

import numpy as np
import pytest

from robofish_agents.controllers.mppi import MPPIController, MPPISettings
from robofish_agents.controllers.pid import PIDController
from robofish_agents.controllers.prediction import LIFT, MOMENT, UNKNOWNS, Costs, Prediction
from robofish_agents.controllers.seen import Seen
from robofish_agents.evaluation.record import swim_suite
from robofish_agents.evaluation.suites import load_suite

SEED = 4_000_000
CALM = replace(load_suite("calm"), seed=SEED)
FISH, STEPS = 4, 20


@pytest.fixture(scope="module")
def swum() -> tuple[Seen, np.ndarray, dict[str, np.ndarray]]:
    """What four fish saw after 10 s, what they did then, and what became of it."""
    env = CALM.make("hold", FISH)
    controller = PIDController()
    observations, _ = env.reset(seed=SEED)
    controller.reset(FISH)
    for _ in range(100):
        observations, *_ = env.step(controller.act(observations))
    seen = Seen.of(observations)
    actions, infos = [], []
    rng = np.random.default_rng(0)
    for _ in range(STEPS):
        # Held for two control steps, as in a prediction with a stride of two.
        action = np.clip(controller.act(observations) + 0.2 * rng.standard_normal(5), -1, 1)
        action[:, 4] = 0.0
        for _ in range(2):
            observations, _, _, _, info = env.step(action.astype(np.float32))
        actions.append(action)
        infos.append(info)
    keys = ("depth_error", "heading_error", "speed_error")
    return seen, np.array(actions), {key: np.array([i[key] for i in infos]) for key in keys}


def test_what_is_predicted_comes_true(swum):
    """Errors 4 s ahead, although the prediction steps ten times as coarsely as the physics."""
    seen, actions, truth = swum
    prediction = Prediction("zheng-2021-a", STEPS, 2, 0.05, Costs())
    trace, failed = prediction._swim(seen, actions[:, :, None], np.zeros((3, FISH)))
    depth, heading, speed = prediction._errors(seen, trace)[..., 0]
    assert not failed.any()
    assert np.max(np.abs(depth - truth["depth_error"])) < 0.002
    # The beat over which a mean is taken is the present one's, and it changes.
    assert np.sqrt(np.mean((heading - truth["heading_error"]) ** 2)) < 0.04
    assert np.sqrt(np.mean((speed - truth["speed_error"]) ** 2)) < 0.006


def test_another_fish_is_predicted_otherwise(swum):
    seen, actions, truth = swum
    prediction = Prediction("zheng-2021-b", STEPS, 2, 0.05, Costs())
    trace, _ = prediction._swim(seen, actions[:, :, None], np.zeros((3, FISH)))
    depth = prediction._errors(seen, trace)[0, ..., 0]
    assert np.max(np.abs(depth - truth["depth_error"])) > 0.01


def test_costs_are_a_parabola_then_a_line():
    costs = Costs(weights=(1.0, 0.0, 0.0), margins=(0.1, 1.0, 1.0))
    small, large, larger = (
        float(costs.of(np.array([[e], [0.0], [0.0]]))[0]) for e in (0.001, 10.0, 11.0)
    )
    assert small == pytest.approx(0.5 * 0.01**2, rel=1e-3)
    assert larger - large == pytest.approx(10.0, rel=1e-3)


def test_it_holds_depth_and_heading():
    record = swim_suite(CALM, "hold", MPPIController(), 3)
    assert record.info["is_success"][-1].sum() >= 2
    assert not record.info["failure"].any()


def test_without_candidates_that_differ_it_does_not_hold():
    blind = MPPISettings(spread=(0.0,) * 5)
    record = swim_suite(CALM, "hold", MPPIController(settings=blind), 3)
    assert record.info["is_success"][-1].sum() == 0


def test_fish_side_by_side_act_as_alone():
    observations, _ = CALM.make("hold", FISH).reset(seed=SEED)
    together = MPPIController()
    together.reset(FISH)
    alone = [MPPIController() for _ in range(FISH)]
    for _ in range(3):
        actions = together.act(observations)
        for lane, controller in enumerate(alone):
            np.testing.assert_array_equal(controller.act(observations[[lane]])[0], actions[lane])


def test_it_learns_how_the_fish_is_trimmed():
    """Half a millimetre of trim and a gram of lift are found while it swims."""
    truth = {MOMENT: -0.0055, LIFT: 2.001}
    env = CALM.make("hold", 3)
    observations, _ = env.reset(seed=SEED, options={"parameters": truth})
    controller = MPPIController()
    controller.reset(3)
    for _ in range(150):
        observations, *_ = env.step(controller.act(observations))
    found = dict(zip(UNKNOWNS, controller._unknown, strict=True))
    assert np.mean(found[MOMENT]) == pytest.approx(0.0005, abs=0.0001)
    assert np.mean(found[LIFT]) == pytest.approx(0.001, abs=0.0005)
