"""The drawn fish has the sizes, the joint and the weight block of the simulated one."""

import numpy as np
import pytest

from fish_env import InitialState, Simulator, load_fish
from fish_env.model import tail as physics
from fish_env.model.jit import py_function
from fish_env.model.records import Tail
from fish_env.rendering.body import Fish
from fish_env.rendering.mesh import Mesh, box
from fish_env.rendering.shape import FishShape

FISHES = ("zheng-2021-a", "msu-tail-fish")


def projected(mesh: Mesh, axis: int) -> float:
    """Area of a closed convex mesh seen along an axis (m^2): half of what its faces add up to."""
    first = mesh.corners[:, 2] - mesh.corners[:, 0]
    second = mesh.corners[:, 3] - mesh.corners[:, 1]
    return float(0.25 * np.abs(np.cross(first, second)[:, axis]).sum())


def volume(mesh: Mesh) -> float:
    """Signed volume that faces enclose, positive when they look outwards (m^3)."""
    first = mesh.corners[:, 2] - mesh.corners[:, 0]
    second = mesh.corners[:, 3] - mesh.corners[:, 1]
    across = 0.5 * np.cross(first, second)
    return float(np.einsum("ij,ij->", mesh.middles, across)) / 3.0


@pytest.mark.parametrize("name", FISHES)
def test_the_hull_has_the_areas_of_the_fish(name):
    """From the front, the side and above; sections rounder or boxier than ellipses: 10 %."""
    fish = load_fish(name)
    built = Fish.built(FishShape.of(fish))
    hull = built.hull + built.window
    for axis in range(3):
        assert projected(hull, axis) == pytest.approx(fish.get(f"body.area[{axis}]"), rel=0.10)


@pytest.mark.parametrize("name", FISHES)
def test_faces_look_outwards(name):
    built = Fish.built(FishShape.of(load_fish(name)))
    hull = built.hull + built.window
    assert volume(hull) > 0.0
    assert volume(hull.turned_over()) < 0.0
    assert volume(box((0.1, 0.2, 0.3), (0, 0, 0))) == pytest.approx(0.006)


@pytest.mark.parametrize("displacement", [-0.01, 0.0, 0.012])
@pytest.mark.parametrize("angle", [-0.6, 0.0, 0.4])
def test_the_block_is_where_the_physics_has_it(displacement, angle):
    """C_m = (M_ew + m_w C_w) / m_total gives C_w back."""
    simulator = Simulator("zheng-2021-a")
    row = {"t": 0.0, "block_displacement": displacement, "block_angle": angle}
    run = simulator.run([row], duration_s=0.1, initial=InitialState())
    outputs = simulator.outputs(run)
    get = simulator.fish.get
    barycentre = np.array([outputs[f"barycentre_{axis}"][0] for axis in "xyz"])
    rest = np.array([get(f"mass.static_moment_rest[{i}]") for i in range(3)])
    centre = (get("mass.total") * barycentre - rest) / get("mass.weight_block")
    drawn = FishShape.of(simulator.fish).block_centre(displacement, angle)
    np.testing.assert_allclose(drawn, centre, atol=1e-12)


@pytest.mark.parametrize("angle", [-0.5, 0.0, 0.7])
def test_the_tail_points_where_the_physics_has_it(angle):
    """Its middle line goes through the centre of pressure."""
    fish = load_fish("zheng-2021-a")
    record = type("Record", (), {"tail_r_c": fish.get("tail.center_of_pressure")})
    arm, _ = py_function(physics.tail_arm)(Tail(angle, 0.0, 0.0), record)
    built = Fish.built(FishShape.of(fish))
    tail = built.swung_tail(angle).middles - np.array(built.shape.tail_root)
    direction = tail.mean(axis=0)[:2] / np.linalg.norm(tail.mean(axis=0)[:2])
    np.testing.assert_allclose(direction, np.array(arm[:2]) / np.hypot(*arm[:2]), atol=1e-9)
    assert np.abs(tail[:, 0]).max() < built.shape.tail_length


def test_the_block_stays_inside_the_hull():
    shape = FishShape.of(load_fish("zheng-2021-a"))
    built = Fish.built(shape)
    for displacement in (-0.012, 0.012):
        corners = built.block(displacement, 0.7).corners.reshape(-1, 3)
        assert np.abs(corners[:, 1]).max() < 0.5 * shape.width
        assert np.abs(corners[:, 2]).max() < 0.5 * shape.height
