"""What holds for all tests, and a browser for those that open pages."""

import gc
import os
from collections import Counter
from pathlib import Path

import pytest

from tests.replay.browser import Browser

# Windows are opened where nobody sees them; tests that need a real screen ask for one themselves.
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")


def pytest_collection_modifyitems(items):
    """Files with slow tests come first, so that no process waits while another ends one."""
    slow = Counter(item.path for item in items if item.get_closest_marker("slow"))
    items.sort(key=lambda item: -slow[item.path])


def pytest_collection_finish():
    """Tests and modules stay until the end: whoever collects garbage need not look at them."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    opened = Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """Where screenshots go, to be looked at: a folder of the user's, else one that goes again."""
    return Path(os.environ.get("ROBOFISH_SCREENSHOTS") or tmp_path_factory.mktemp("pictures"))
