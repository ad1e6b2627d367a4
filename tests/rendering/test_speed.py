"""Pictures are drawn fast enough to watch."""

import pytest

from scripts.bench.rendering import single


@pytest.mark.slow
def test_thirty_pictures_a_second_on_one_core():
    """640 x 480, with wake, goal and instruments; processor time, so that load matters less."""
    assert single((640, 480)) < 1.0 / 30.0
