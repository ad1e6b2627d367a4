"""Pictures are drawn fast enough to watch."""

import time

import pygame
import pytest

from scripts.bench.rendering import single

MOST = 12.0
"""Times as long as one reduction by the drawing library, measured beside it. A picture takes 7 to
11 times as long; one drawn by numpy took 13 to 15."""


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
def test_thirty_pictures_a_second_on_one_core():
    """640 x 480, with wake, goal and instruments; processor time, the least of several rounds.

    A machine that is too slow or too busy for that is judged by work of the same kind. How the two
    compare depends on the processor: on some, a picture takes 10 times as long as a reduction.
    """
    pictures = (single((640, 480)) for _ in range(3))
    assert any(seconds < max(1.0 / 30.0, MOST * reduction()) for seconds in pictures)
