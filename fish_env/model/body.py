"""The body: lift and drag in two planes, impact moments, rotational damping (paper III.C.2)."""

from __future__ import annotations

from typing import NamedTuple

from fish_env.model.jit import kernel
from fish_env.model.plate import speed_and_inverse
from fish_env.model.records import Motion, Vector


class PlaneFlow(NamedTuple):
    """Flow in one body plane: speed (m/s), s = sin(alpha), cos(alpha), 1/2 rho S_i (kg/m)."""

    speed: float
    s: float
    cosine: float
    scale: float


@kernel
def plane_flow(axial, normal, area_axial, area_normal, density):
    """S_i = e^T diag(S) e with e = V_i/|V_i|; s_i = n_i . e_i; cos(alpha) = |V_x|/|V_i|."""
    speed, inverse = speed_and_inverse(axial, normal, 0.0)
    along = axial * inverse
    s = normal * inverse
    area = area_axial * (along * along) + area_normal * (s * s)
    return PlaneFlow(speed, s, abs(along), 0.5 * density * area)


@kernel
def relative_motion(time, place, velocity, omega, attitude, water, water_rate):
    """Motion against ground and water; V_rel = V_b - R^T water (m/s, body)."""
    return Motion(
        time,
        place.x,
        place.y,
        place.z,
        velocity.x - water.x,
        velocity.y - water.y,
        velocity.z - water.z,
        omega.x,
        omega.y,
        omega.z,
        velocity.x,
        velocity.y,
        velocity.z,
        water.x,
        water.y,
        water.z,
        water_rate.x,
        water_rate.y,
        water_rate.z,
        attitude,
    )


@kernel
def with_surge(motion, surge):
    """The same motion with another surge speed through the water (m/s)."""
    return Motion(
        motion.time,
        motion.x,
        motion.y,
        motion.z,
        surge,
        motion.v,
        motion.w,
        motion.p,
        motion.q,
        motion.r,
        motion.ground_u,
        motion.ground_v,
        motion.ground_w,
        motion.water_u,
        motion.water_v,
        motion.water_w,
        motion.water_rate_u,
        motion.water_rate_v,
        motion.water_rate_w,
        motion.attitude,
    )


@kernel
def flow_drift(motion):
    """d(V_rel)/dt - dV_b/dt = omega x V_water - R^T DU/Dt (m/s^2, body).

    V_rel = V_b - R^T U, and d(R^T U)/dt = R^T dU/dt - omega x R^T U. The acceleration of the water
    is that along its own path, as in the force on a small body in an unsteady, non-uniform flow
    (Maxey and Riley, Physics of Fluids 26, 1983; Auton, Hunt and Prud'homme, JFM 197, 1988).
    """
    return Vector(
        motion.q * motion.water_w - motion.r * motion.water_v - motion.water_rate_u,
        motion.r * motion.water_u - motion.p * motion.water_w - motion.water_rate_v,
        motion.p * motion.water_v - motion.q * motion.water_u - motion.water_rate_w,
    )


@kernel
def plane_xz_velocity(motion):
    """V_1 = (V_x, 0, V_z) (m/s, body)."""
    return Vector(motion.u, 0.0, motion.w)


@kernel
def plane_xy_velocity(motion):
    """V_2 = (V_x, V_y, 0) (m/s, body)."""
    return Vector(motion.u, motion.v, 0.0)


@kernel
def impact_moment(flow_xz, flow_xy, coefficient_y, coefficient_z):
    """M_I = [0, M_y, M_z] with 1/2 rho |V_i|^2 S_i C_MI(alpha_i) (N m, body, about O_b)."""
    return Vector(
        0.0,
        flow_xz.scale * (flow_xz.speed * flow_xz.speed) * coefficient_y,
        flow_xy.scale * (flow_xy.speed * flow_xy.speed) * coefficient_z,
    )


@kernel
def damping_moment(motion, fish):
    """M_omega = diag(C_omega) omega_b (N m, body, about O_b); the coefficients are negative."""
    return Vector(fish.damping_x * motion.p, fish.damping_y * motion.q, fish.damping_z * motion.r)
