"""One training under many seeds and settings, by Ray Tune."""
