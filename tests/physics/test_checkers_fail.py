"""Each checker of the physics fails on a model that is wrong in what it checks.

The replaced texts are lines of the composed model; where one is gone, the test says so.
"""

from functools import partial

import pytest

from tests.broken import broken_simulator
from tests.physics import checkers
from tests.physics.cases import WATER_EFFECTS

EULER_LIKE = {"weight = 1.0 if (stage == 0) | (stage == 3) else 2.0": "weight = 2.0 - stage % 2"}
NO_CORIOLIS = {
    "inertial = inertial_wrench(motion, centre)": "inertial = Wrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)"
}
CORIOLIS_SIGN = {
    "inertial = inertial_wrench(motion, centre)": (
        "inertial = inertial_wrench(motion, centre)\n"
        "    inertial = inertial._replace(fx=-inertial.fx)"
    )
}
NO_GYROSCOPIC = {
    "inertial = inertial_wrench(motion, centre)": (
        "inertial = inertial_wrench(motion, centre._replace(jx=0.0, jy=0.0, jz=0.0))"
    )
}
BUOYANCY_SIGN = {"total = Wrench(gravity.fx + buoyancy.x": "total = Wrench(gravity.fx - buoyancy.x"}
SKEWED = {"flow_xy.s, flow_xy.cosine": "abs(flow_xy.s), flow_xy.cosine"}
TAIL_TO_ONE_SIDE = {"arm, normal = tail_arm(tail, fish)": (
    "arm, normal = tail_arm(tail, fish)\n    arm = arm._replace(y=abs(arm.y))"
)}  # fmt: skip
UNTURNED_FLOW = {
    "velocity, omega, attitude, flow, flow_rate)": "velocity, omega, attitude, water, flow_rate)"
}
FLOW_IN_INERTIA = {
    "inertial = inertial_wrench(motion, centre)": (
        "inertial = inertial_wrench(\n        motion._replace(ground_u=motion.u, "
        "ground_v=motion.v, ground_w=motion.w), centre)"
    )
}
DRAG_SIGN = {"f_drag = drag_force(v_tail, speed_tail, scale_tail,": (
    "f_drag = drag_force(v_tail, speed_tail, -scale_tail,"
)}  # fmt: skip
DAMPING_SIGN = {"damping = damping_moment(motion, fish)": (
    "damping = damping_moment(motion._replace(p=-motion.p), fish)"
)}  # fmt: skip
LIFT_SIGN = {"speed_tail, s_tail, scale_tail,": "speed_tail, -s_tail, scale_tail,"}
GRAVITY_OFF_CENTRE = {"gravity = gravity_wrench(attitude, centre, fish)": (
    "gravity = gravity_wrench(attitude, centre._replace(x=centre.x + 1e-3), fish)"
)}  # fmt: skip
ROUNDED_OTHERWISE = {"(h / 6.0) * total": "((h / 6.0) * total if width == 1 else h * total / 6.0)"}
LATE_SWITCH = {"plan_actuators(work, width, h)\n": (
    "gather_targets(work, width, commands, slots[max(segment - (i == 0), 0)], first, count)\n"
    "            plan_actuators(work, width, h)\n"
)}  # fmt: skip
ADDED_MASS_OVER_GROUND = {"t_added_mass = added_mass_wrench(motion,": (
    "t_added_mass = added_mass_wrench(motion._replace(water_u=0.0),"
)}  # fmt: skip

CASES = [
    (checkers.check_order, EULER_LIKE),
    (checkers.check_order_through_switch, LATE_SWITCH),
    (checkers.check_energy, CORIOLIS_SIGN),
    (checkers.check_momentum, NO_CORIOLIS),
    (checkers.check_momentum, NO_GYROSCOPIC),
    (checkers.check_total_energy, BUOYANCY_SIGN),
    (checkers.check_mirror, SKEWED),
    (checkers.check_mirror, TAIL_TO_ONE_SIDE),
    (checkers.check_galilean, UNTURNED_FLOW),
    (checkers.check_galilean, FLOW_IN_INERTIA),
    (partial(checkers.check_galilean, effects=WATER_EFFECTS), ADDED_MASS_OVER_GROUND),
    (checkers.check_drag_power, DRAG_SIGN),
    (checkers.check_drag_power, DAMPING_SIGN),
    (checkers.check_drag_power, LIFT_SIGN),
    (checkers.check_trim, GRAVITY_OFF_CENTRE),
    (checkers.check_reference_derivative, LIFT_SIGN),
    (checkers.check_reference_derivative, NO_CORIOLIS),
    (checkers.check_golden, SKEWED),
    (partial(checkers.check_scalar_equals_batch, count=7, steps=12), ROUNDED_OTHERWISE),
]


def name(checker) -> str:
    return getattr(checker, "func", checker).__name__


@pytest.mark.parametrize(("checker", "replacements"), CASES, ids=[name(case[0]) for case in CASES])
def test_a_checker_fails_on_a_broken_model(checker, replacements):
    with pytest.raises(AssertionError):
        checker(partial(broken_simulator, replacements))


CHECKERS = {name(checker): checker for checker, _ in CASES}


@pytest.mark.parametrize("checker", CHECKERS.values(), ids=CHECKERS)
def test_a_checker_passes_on_the_same_model_unbroken(checker):
    """So a failure above is due to the replacement, not to the model being plain Python."""
    checker(partial(broken_simulator, {}))


def test_a_replacement_that_replaces_nothing_is_an_error():
    """A reworded kernel would otherwise pass for a broken one."""
    with pytest.raises(LookupError, match="no longer contains"):
        broken_simulator({"not in the model": ""}, "zheng-2021-a")
