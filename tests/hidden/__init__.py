"""Hidden-effect cases: another implementation of the physics, with something hidden in it."""
