"""Tables of steady motion as a problem: beat means, orbits, noise of averages."""
