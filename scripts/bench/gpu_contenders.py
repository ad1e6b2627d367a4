"""What is measured on a GPU: this environment, the same on the CPU, and swimmers of MJX."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scripts.bench import ours
from scripts.bench.harness import Contender, cores

ENV_ID = ours.ENV_ID
ACTIONS = 16
"""Drawn before the clock starts, this many, and used in turn."""


def device(envs: int, precision: str, task: str = "hold") -> Contender:
    """The environment on the device, with restarts; random actions wait there as tensors."""
    import torch

    from fish_env.gpu.vector import RoboticFish3DDeviceEnv

    env = RoboticFish3DDeviceEnv(envs, precision=precision, task=task)
    observed, _ = env.reset(seed=0)
    generator = torch.Generator(observed.device).manual_seed(0)
    shape = (ACTIONS, envs, 5)
    actions = 2.0 * torch.rand(shape, generator=generator, device=observed.device) - 1.0

    def run(steps: int) -> None:
        for i in range(steps):
            env.step(actions[i % ACTIONS])
        wait(observed)

    config = env.batch.options.config
    name = f"{ENV_ID} on the GPU, {precision}, {envs}"
    name += "" if task == "hold" else f", {task}"
    return Contender(name, envs, 0, config.control_period, config.substeps, "RK4", run)


def rollout(envs: int, precision: str) -> Contender:
    """The bare physics on the device: a step is one control period of rollouts."""
    from numba import cuda

    from fish_env.gpu.rollout import DeviceRollout
    from fish_env.simulator import Simulator

    simulator = Simulator("zheng-2021-a", 0.01)
    model, commands = simulator.model, ours.drawn_commands((ACTIONS, envs))
    fish = DeviceRollout(
        model.kernels, ours.start_state(envs), commands[0], model.records({}).repeat(envs, 1),
        np.full((5, envs), np.inf), model.tables, precision,
    )  # fmt: skip

    def run(steps: int) -> None:
        for first in range(0, steps, ACTIONS):
            count = min(ACTIONS, steps - first)
            fish.advance(commands, ours.schedule_grid(0, count))
        cuda.synchronize()

    name = f"bare physics on the GPU, {precision}, {envs}"
    return Contender(name, envs, 0, 0.1, 10, "RK4", run, environment=False)


def mjx_swimmer(envs: int) -> Contender:
    """Gymnasium's three-link Swimmer in MJX: the bare simulator, without rewards and restarts."""
    import jax
    import mujoco
    from mujoco import mjx

    xml = SWIMMER.format(links=LINKS)
    model = mujoco.MjModel.from_xml_string(xml)
    on_device = mjx.put_model(model)
    start = mjx.put_data(model, mujoco.MjData(model))
    actions = jax.numpy.asarray(ours.drawn_actions((envs, model.nu))[:ACTIONS])

    def many(data: object, actions: object) -> object:
        def one(data: object, action: object) -> object:
            def substep(data: object, _: object) -> tuple[object, None]:
                return mjx.step(on_device, data), None

            return jax.lax.scan(substep, data.replace(ctrl=action), None, SWIMMER_SUBSTEPS)[0]

        return jax.vmap(one)(data, actions)

    advance = jax.jit(many, donate_argnums=0)
    zeros = np.zeros(envs)
    state = [jax.vmap(lambda _: start)(zeros)]

    def run(steps: int) -> None:
        for i in range(steps):
            state[0] = advance(state[0], actions[i % ACTIONS])
        jax.block_until_ready(state[0])

    name = f"MJX three-link swimmer, {envs}"
    period = SWIMMER_SUBSTEPS * model.opt.timestep
    return Contender(name, envs, 0, period, SWIMMER_SUBSTEPS, "RK4", run, environment=False)


def wait(tensor: object) -> None:
    """Wait for the device of a tensor."""
    import torch

    if getattr(tensor, "is_cuda", False):
        torch.cuda.synchronize()


SWIMMER_SUBSTEPS = 4
LINKS = """
<body name="mid" pos="-1 0 0">
  <geom density="1000" fromto="0 0 0 -1 0 0" size="0.1" type="capsule"/>
  <joint axis="0 0 1" limited="true" name="motor1" pos="0 0 0" range="-100 100" type="hinge"/>
  <body name="back" pos="-1 0 0">
    <geom density="1000" fromto="0 0 0 -1 0 0" size="0.1" type="capsule"/>
    <joint axis="0 0 1" limited="true" name="motor2" pos="0 0 0" range="-100 100" type="hinge"/>
  </body>
</body>
"""
SWIMMER = """
<mujoco model="swimmer">
  <option density="4000" integrator="RK4" timestep="0.01" viscosity="0.1">
    <flag contact="disable"/>
  </option>
  <default><joint armature="0.1"/></default>
  <worldbody>
    <body name="torso" pos="0 0 0">
      <geom density="1000" fromto="1.5 0 0 0.5 0 0" size="0.1" type="capsule"/>
      <joint axis="1 0 0" name="slider1" pos="0 0 0" type="slide"/>
      <joint axis="0 1 0" name="slider2" pos="0 0 0" type="slide"/>
      <joint axis="0 0 1" name="rot" pos="0 0 0" type="hinge"/>
      {links}
    </body>
  </worldbody>
  <actuator>
    <motor ctrllimited="true" ctrlrange="-1 1" gear="150" joint="motor1"/>
    <motor ctrllimited="true" ctrlrange="-1 1" gear="150" joint="motor2"/>
  </actuator>
</mujoco>
"""
"""The swimmer of Coulom (2002) with the numbers of Gymnasium's Swimmer-v5, contacts left out."""

Builders = list[tuple[str, Callable[[], Contender]]]


def builders(counts: tuple[int, ...]) -> Builders:
    """All contenders.

    Args:
        counts: numbers of fish; the last is what the others are compared at.
    """
    most = counts[-1]
    chosen: Builders = [
        (f"device {count}", lambda count=count: device(count, "float32")) for count in counts
    ]
    chosen += [
        ("device float64", lambda: device(most, "float64")),
        ("device path", lambda: device(most, "float32", "path")),
        ("rollout", lambda: rollout(most, "float32")),
        ("CPU", lambda: ours.vector(min(most, 4096), cores())),
        ("MJX", lambda: mjx_swimmer(most)),
    ]
    return chosen
