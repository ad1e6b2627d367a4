"""What holds for all tests."""

import os

# Windows are opened where nobody sees them; tests that need a real screen ask for one themselves.
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
