"""Foreign plants are foreign, and the further physics of real robots is what it says."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from fish_env.identification.generic_forces import regressors
from fish_env.model.frames import quaternion_from_euler
from fish_env.params import load_fish
from tests.hidden.excitation import exciting, merged
from tests.hidden.forces import added_accelerations, rows_of
from tests.hidden.measurement import channels_of
from tests.hidden.realistic.catalogue import NEUTRAL, PLANT_SIZES
from tests.hidden.records import GRAVITY, REAL, wave_number
from tests.hidden.servo import FREQUENCY, PHASE, TIME
from tests.hidden.simulate import DECIDED, Start, Swim, simulate
from tests.hidden.sizes import draw_effect, draw_values

FISH = load_fish("zheng-2021-a").values()
TIMES = np.arange(0.0, 30.01, 0.04)
SUBSTANTIAL = 0.2
"""Share of a foreign force (rms) that no sum of simple functions makes."""


def functions(swim, states):
    """The functions that the adequacy test knows, along a motion, (T, J)."""
    rows, seen = rows_of(swim, TIMES), channels_of(states)
    euler = np.column_stack([seen[name] for name in ("roll", "pitch", "yaw")])
    package = np.zeros((len(TIMES), 18))
    package[:, :3], package[:, 3:7] = states[:, :3], quaternion_from_euler(euler)
    package[:, 7:13] = states[:, 12:18]
    at = swim.table[rows]
    package[:, 13] = at[:, PHASE] + 2.0 * np.pi * at[:, FREQUENCY] * (TIMES - at[:, TIME])
    commands = SimpleNamespace(
        clock=TIMES, command_times=swim.table[:, TIME], command_values=swim.table[:, 1:6]
    )
    return np.column_stack(list(regressors(commands, SimpleNamespace(states=package)).values()))


def remainder(effects):
    """Share (rms over four runs) of what effects add that is in no sum of the functions.

    The direction in which most is added, in units of the others' accelerations.
    """
    known, wanted = [], []
    for run in range(4):
        rows = merged(exciting(25.0, 30.0, ("steps", "waves")[run % 2], np.random.default_rng(run)))
        swim = Swim(FISH, effects, Start(position=(0.0, 0.0, 0.7)))
        swim.command(rows)
        states = swim.run(30.0, TIMES)
        known.append(functions(swim, states))
        wanted.append(added_accelerations(swim, effects, TIMES, states))
    basis, added = np.concatenate(known), np.concatenate(wanted)
    basis = basis / np.sqrt(np.mean(basis**2, axis=0))
    left = added - basis @ np.linalg.lstsq(basis, added, rcond=1e-12)[0]
    # Metres a second squared and radians a second squared, each as a share of its own kind.
    size = np.sqrt(np.mean(added**2, axis=0))
    kinds = [slice(0, 3), slice(3, 6)]
    most = [kind.start + int(np.argmax(size[kind])) for kind in kinds]
    return max(float(np.sqrt(np.mean(left[:, i] ** 2)) / size[i]) for i in most)


@pytest.mark.parametrize("name", PLANT_SIZES)
def test_no_sum_of_simple_functions_makes_a_foreign_plant(name):
    values = draw_values(PLANT_SIZES[name], NEUTRAL[name], 1.0, np.random.default_rng(0))
    assert remainder({name: values}) > SUBSTANTIAL


@pytest.mark.parametrize("name", ["roll_yaw_damping", "swirl"])
def test_the_projection_notices_a_force_that_simple_functions_make(name):
    values = draw_effect(name, 1.0, np.random.default_rng(0))
    assert remainder({name: values}) < 0.05


def commands(offset=0.0, amplitude=0.3, frequency=1.5):
    return np.array([[0.0, offset, amplitude, frequency, 0.0, 0.0]])


def moved(effects, rows=None, depth=0.7, **fish):
    rows = commands() if rows is None else rows
    return simulate(FISH | fish, rows, TIMES[:251], effects, Start(position=(0.0, 0.0, depth)))


def difference(one, other):
    return float(np.abs(one[:, :18] - other[:, :18]).max())


@pytest.mark.parametrize("name", [*REAL, *PLANT_SIZES])
def test_everything_is_off_at_its_neutral_values(name):
    finer = name in DECIDED  # in shorter steps
    changed = difference(moved({}), moved({name: dict(NEUTRAL[name])}))
    assert changed < 1e-8 if finer else changed == 0.0


def test_offset_gain_is_another_offset():
    gained = moved({"offset_gain": {"gain": 0.5}}, commands(0.3))
    assert difference(gained, moved({}, commands(0.15))) < 1e-12
    assert difference(gained, moved({}, commands(0.3))) > 0.01


def test_swing_loss_is_another_amplitude():
    lost = moved({"swing_loss": {"per_radian": 0.5}}, commands(0.4))
    assert difference(lost, moved({}, commands(0.4, amplitude=0.3 * 0.8))) < 1e-12


def test_a_slowed_beat_is_another_frequency():
    slowing = {"beat_load": {"offset": 0.25, "load": 0.02}}
    left = (1 - 0.25 * 0.4) * (1 - 0.02 * 2 * math.pi * 0.3 * 1.5)
    slower = moved({}, commands(0.4, frequency=1.5 * left))
    assert difference(moved(slowing, commands(0.4)), slower) < 1e-6


def test_end_stops_that_are_never_met_do_nothing_and_tight_ones_hold_the_tail():
    wide = moved({"angle_limit": {"lower": -0.31, "upper": 0.31}})
    assert difference(wide, moved({})) < 1e-6
    held = moved({"angle_limit": {"lower": 0.0, "upper": 0.0}})
    assert difference(held, moved({}, commands(amplitude=0.0))) < 2e-3


def test_a_servo_without_torque_hardly_moves_and_a_strong_one_keeps_up():
    strong = moved({"servo_torque_limit": {"torque": 1e3}})
    assert difference(strong, moved({})) < 1e-3
    weak = moved({"servo_torque_limit": {"torque": 1e-4}})
    assert abs(weak[-1, 0]) < 0.5 * abs(moved({})[-1, 0])


def test_a_stiff_body_does_not_bend():
    assert difference(moved({"body_flexibility": {"stiffness": 1e6}}), moved({})) < 1e-3


def test_a_tail_of_stiff_links_is_one_plate_with_the_same_hinge():
    """Three plates on one line; their forces differ from one plate's only by the flow's shear."""
    stiff = moved({"linked_tail": {"share": 1.0, "stiffness": 50.0}})
    soft = moved({"linked_tail": {"share": 1.0, "stiffness": 0.03}})
    assert difference(stiff, soft) > 10 * abs(stiff[:, 39:41]).max()
    assert abs(soft[:, 39:41]).max() > 0.05 > abs(stiff[:, 39:41]).max()


def test_a_wall_out_of_reach_does_nothing():
    near = {"gain": 2.0, "distance": 0.2, "heading": 0.0, "range": 0.3}
    assert difference(moved({"wall_effect": near | {"distance": 50.0}}), moved({})) < 1e-9
    assert moved({"wall_effect": near})[-1, 0] < 0.9 * moved({})[-1, 0]


def test_the_surface_matters_only_near_it():
    piercing = {"surface_piercing": {"height": 0.05}}
    assert difference(moved(piercing, depth=0.7), moved({}, depth=0.7)) < 1e-12
    assert moved(piercing, depth=0.03)[25, 2] > 0.03 + 0.001


def test_a_bubble_lifts_by_its_volume():
    """A bubble at the depth of the water column that halves it lifts like half the mass."""
    nose = moved({"bubbles": {"mass": 0.004, "x": 0.05}})
    still = commands(amplitude=0.0)
    shallow = moved({"bubbles": {"mass": 0.004, "x": 0.0}}, still, depth=0.5)
    plain = moved({"buoyancy_offset": {"mass": 0.004 / (1 + 0.5 / 10.3)}}, still, depth=0.5)
    assert shallow[25, 2] == pytest.approx(plain[25, 2], abs=2e-5)
    assert nose[100, 9] < moved({})[100, 9]  # minus the sine of the pitch


def test_a_flooded_fish_is_heavier_and_trimmed():
    leak = {"water_ingress": {"rate": 2e-4, "x": 0.05}}
    states, plain = moved(leak), moved({})
    assert states[-1, 2] > plain[-1, 2] + 0.02
    assert states[-1, 9] > plain[-1, 9] + 1e-3  # nose down


def test_a_cable_is_slack_until_it_is_taut():
    cable = {"stiffness": 0.05, "x": 0.0, "y": 0.0, "z": 0.7, "slack": 5.0, "attach_x": -0.1}
    assert difference(moved({"tether": cable}), moved({})) == 0.0
    taut = cable | {"slack": 0.0, "attach_x": 0.0}
    assert moved({"tether": taut})[-1, 0] < moved({})[-1, 0] - 0.02
    beside = {"slack": 0.0, "y": 1.0}
    turned = moved({"tether": cable | beside})[100, 6]
    assert abs(turned - moved({"tether": taut | beside})[100, 6]) > 0.05  # sine of the yaw


def test_water_that_neither_lifts_nor_drags_still_pushes_by_its_pressure():
    """A neutrally buoyant sphere without drag follows the water: here rho V DU/Dt on mass m_b."""
    fish = {f"body.rotational_damping[{i}]": 0.0 for i in range(3)}
    still = {f"body.area[{i}]": 0.0 for i in range(3)} | {"tail.area": 0.0}
    about = {"amplitude": 0.03, "frequency": 0.4, "phase": 0.5, "tank_depth": math.inf}
    states = moved({"wave": about}, commands(amplitude=0.0), **fish, **still)
    calm = moved({}, commands(amplitude=0.0), **fish, **still)
    turn, t = 2 * math.pi * 0.4, TIMES[:251]
    fade = 0.03 * math.exp(-wave_number(0.4, math.inf) * 0.7)
    # m z'' = m_b d/dt(fade sin(turn t + phase)), from rest.
    heave = fade * (np.sin(turn * t + 0.5) - math.sin(0.5)) * FISH["mass.buoyancy"]
    seen = np.gradient(states[:, 2] - calm[:, 2], t)
    assert np.abs(seen - heave / FISH["mass.total"])[5:-5].max() < 0.25 * fade


@pytest.mark.parametrize("depth", [0.8, 3.0, math.inf])
def test_a_wave_obeys_dispersion(depth):
    k = wave_number(0.5, depth)
    tanh = math.tanh(k * depth) if math.isfinite(depth) else 1.0
    assert (2 * math.pi * 0.5) ** 2 == pytest.approx(GRAVITY * k * tanh, rel=1e-9)
