"""What a body without water keeps."""

from fish_env.simulator import Simulator
from tests.physics import checkers


def test_kinetic_energy_stays_in_empty_space():
    """1/2 [V, omega] M [V, omega]: the velocity-dependent inertia terms do no work."""
    checkers.check_energy(Simulator)


def test_momenta_stay_in_empty_space():
    """Linear momentum, and angular momentum about C_m, which lies off every axis through O_b."""
    checkers.check_momentum(Simulator)


def test_total_energy_stays_with_gravity_and_buoyancy():
    """Gravity acts at C_m, buoyancy at O_b; either in the wrong place would add energy."""
    checkers.check_total_energy(Simulator)
