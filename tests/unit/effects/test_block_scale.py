"""A block with another stroke."""

import pytest

from tests.unit.effects.support import assert_same_motion, run


def test_it_equals_another_commanded_displacement():
    """The bracket's angle is not scaled."""
    told = {"t": 0.0, "block_displacement": 0.01, "block_angle": 0.4}
    scaled = run({"block_scale": {"scale": 1.2}}, [told], 3.0)
    assert_same_motion(scaled, run(None, [{**told, "block_displacement": 0.012}], 3.0))
    assert scaled["pitch"][-1] > run(None, [told], 3.0)["pitch"][-1] + 0.02


def test_nothing_changes_with_the_block_at_rest():
    still = [{"t": 0.0, "block_angle": 0.4}]
    one, two = run({"block_scale": {"scale": 0.8}}, still), run(None, still)
    assert one["roll"][-1] == pytest.approx(two["roll"][-1], abs=0.0)
