"""Pictures are drawn fast enough to watch."""

import time

import pygame
import pytest

from scripts.bench.rendering import single

MOST = 12.0
"""Times as long as one reduction by the drawing library, measured beside it. A picture takes 7 to 9
times as long; one drawn by numpy took 13 to 15."""


def reduction() -> float:
    """Least processor seconds to halve a picture of the size that 640 x 480 is drawn at."""
    large = pygame.Surface((1280, 960), 0, 32)
    rounds = []
    for _ in range(20):
        start = time.process_time()
        for _ in range(5):
            pygame.transform.smoothscale(large, (640, 480))
        rounds.append((time.process_time() - start) / 5)
    return min(rounds)


@pytest.mark.slow
def test_a_picture_takes_few_times_as_long_as_its_last_step_did():
    """640 x 480, with wake, goal and instruments, against work of the same kind on this machine.

    Both are the least of several rounds, so that load hardly matters; a second try is given to a
    machine that becomes slow in between.
    """
    ratios = (single((640, 480)) / reduction() for _ in range(3))
    assert any(ratio < MOST for ratio in ratios)
