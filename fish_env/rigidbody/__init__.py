"""What any rigid vehicle's record must satisfy: kinematics, clocks, units, noise."""
