"""A harder suite: many small errors at once, runs that differ, dirty sensors, wrong inputs."""
