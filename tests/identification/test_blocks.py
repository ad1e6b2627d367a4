"""The derivative of a block of fish: effects that are off are left out, and no bit changes."""

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.identification.filter_kernels import TEMPLATES
from fish_env.model.composition import Composition
from fish_env.params.io import as_fish
from fish_env.params.packing import RECORD_FIELDS, pack_tables, pack_values
from tests.broken import plain_module

NAMES = (
    "water_density",
    "block_lag",
    "wave",
    "servo_delay",
    "servo_lag",
    "servo_backlash",
    "servo_rate_limit",
    "servo_torque_limit",
    "com_offset",
    "surface_drag",
    "wake_fraction",
    "tail_stall",
    "wake_memory",
    "tether",
    "added_mass",
    "body_flexibility",
    "quadratic_damping",
)
"""Effects that have a hook for each stage among them, states, a memory, and a late command."""
WIDTH = 24
LENGTH = 0.005
"""Of the present part of a step (s)."""


@pytest.fixture(scope="module")
def effects():
    return tuple(effect for name, effect in catalogue().items() if name in NAMES)


@pytest.fixture(scope="module")
def module(effects):
    """The composed physics as plain Python, which takes no time to compile."""
    return plain_module(Composition(effects).in_blocks(TEMPLATES), {})


@pytest.fixture(scope="module")
def tables():
    return pack_tables(as_fish("msu-tail-fish"))


def block(module, effects, on, rng):
    """A block (rows, lanes) of swimming fish, each with some effects on.

    Args:
        module: the composed physics.
        effects: what it contains.
        on: names of effects that are on in some lanes.
        rng: for states and parameters.
    """
    work = np.zeros((module.WORK_ROWS, WIDTH))
    state = work[module.X : module.X + module.N_STATES]
    state[:] = 0.1 * rng.standard_normal(state.shape)
    state[3:7] /= np.linalg.norm(state[3:7], axis=0)
    work[module.LENGTH] = LENGTH
    work[module.U : module.U + 5] = np.array([[0.1], [0.3], [1.2], [0.004], [0.1]])
    heard = work[module.PAST : module.PAST_END]
    heard[:] = 0.1 * rng.standard_normal(heard.shape)
    parameters = work[module.PAR :]
    parameters[: len(RECORD_FIELDS)] = pack_values(as_fish("msu-tail-fish").values())
    row = len(RECORD_FIELDS)
    for effect in effects:
        active = (rng.random(WIDTH) < 0.5) & (effect.name in on)
        for parameter in effect.parameters:
            low, high = parameter.plausible
            values = np.clip(rng.uniform(low, high, WIDTH), parameter.lower, parameter.upper)
            parameters[row] = np.where(active, values, parameter.neutral)
            row += 1
    return work.reshape(-1)


def in_loops(module, work, tables):
    """Slopes (states, lanes) as the loops of the block find them."""
    work = work.copy()
    module.switch_effects(WIDTH, WIDTH, work)
    module.derive_lanes(WIDTH, 0.02, 1.0, LENGTH, work, tables)
    return slopes(module, work)


def lane_by_lane(module, work, tables):
    """The same by the function of one lane."""
    work = work.copy()
    for k in range(WIDTH):
        module.lane_derivative(k, WIDTH, 0.02, LENGTH, work, tables)
    return slopes(module, work)


def slopes(module, work):
    rows = module.N_STATES - module.N_MEMORY
    return work.reshape(-1, WIDTH)[module.DX : module.DX + rows]


@pytest.mark.parametrize("share", [0.0, 0.2, 0.6, 1.0])
def test_a_block_has_the_bits_of_its_lanes(module, effects, tables, share):
    rng = np.random.default_rng(int(10 * share))
    for _ in range(5):
        on = {name for name in NAMES if rng.random() < share}
        work = block(module, effects, on, rng)
        expected = lane_by_lane(module, work, tables)
        assert np.isfinite(expected).all()
        np.testing.assert_array_equal(in_loops(module, work, tables), expected)


def corners(module, work, in_loops):
    """When each lane's tail is at a corner, with what it remembers until then."""
    work = work.copy()
    module.switch_effects(WIDTH, WIDTH, work)
    heard = work[module.PAST * WIDTH : module.PAST_END * WIDTH]
    work[module.PAST_END * WIDTH :][: len(heard)] = heard + 0.001
    states = module.N_STATES * WIDTH
    work[module.X0 * WIDTH :][:states] = work[module.X * WIDTH :][:states]
    if in_loops:
        module.corner_lanes(WIDTH, 0.02, LENGTH, work)
    else:
        for k in range(WIDTH):
            module.lane_corner(k, WIDTH, 0.02, work)
    rows = work.reshape(-1, WIDTH)
    memory = rows[: module.DX]
    return np.vstack([rows[module.CORNER], memory])


@pytest.mark.parametrize("share", [0.2, 0.6, 1.0])
def test_a_block_has_the_corners_of_its_lanes(module, effects, share):
    rng = np.random.default_rng(int(10 * share))
    found = []
    for _ in range(5):
        on = {name for name in NAMES if rng.random() < share}
        work = block(module, effects, on, rng)
        expected = corners(module, work, in_loops=False)
        np.testing.assert_array_equal(corners(module, work, in_loops=True), expected)
        found.append(np.isfinite(expected[0]).any())
    assert any(found)


@pytest.mark.parametrize("name", NAMES)
def test_each_effect_is_seen_to_be_on(module, effects, tables, name):
    """Left out, it would change the slopes: the comparison above can fail."""
    rng = np.random.default_rng(7)
    work = block(module, effects, {name}, rng)
    off = block(module, effects, (), np.random.default_rng(7))
    assert np.any(in_loops(module, work, tables) != in_loops(module, off, tables))


def test_a_block_that_overlooks_effects_is_noticed(effects, tables):
    """Where no effect is ever found to be on, the comparison fails."""
    blind = {"    on = on if ": "    on = 0.0 if "}
    module = plain_module(Composition(effects).in_blocks(TEMPLATES), blind)
    work = block(module, effects, NAMES, np.random.default_rng(0))
    assert np.any(in_loops(module, work, tables) != lane_by_lane(module, work, tables))


def test_one_lane_switches_an_effect_on_for_its_block(module, effects):
    """And a memory or a past counts only where an effect with one is on."""
    work = block(module, effects, (), np.random.default_rng(0))
    module.switch_effects(WIDTH, WIDTH, work)
    assert not module.memory_matters(WIDTH, work)
    assert not module.past_matters(WIDTH, work)
    names = [f"{e.name}.{p.name}" for e in effects for p in e.parameters]
    row = module.PAR + len(RECORD_FIELDS) + names.index("servo_backlash.gap")
    work[row * WIDTH + 17] = 0.05
    module.switch_effects(WIDTH, WIDTH, work)
    assert module.memory_matters(WIDTH, work)
    assert module.past_matters(WIDTH, work)


@pytest.mark.parametrize("names", [(), NAMES])
def test_lanes_behind_those_that_move_have_no_slopes(names, tables):
    """And the others have the bits that they have in a full block."""
    effects = tuple(effect for name, effect in catalogue().items() if name in names)
    module = plain_module(Composition(effects).in_blocks(TEMPLATES), {})
    work = block(module, effects, names, np.random.default_rng(1))
    whole = in_loops(module, work, tables)
    part = work.copy()
    module.switch_effects(8, WIDTH, part)
    module.derive_lanes(WIDTH, 0.02, 1.0, LENGTH, part, tables)
    np.testing.assert_array_equal(slopes(module, part)[:, :8], whole[:, :8])
    assert not slopes(module, part)[:, 8:].any()
    assert whole[:, 8:].any()
