"""Writes docs/environment.md from the environments' docstrings and settings.

Run it as ``python -m scripts.make_environment_page``.
"""

from __future__ import annotations

import inspect
import re
from pathlib import Path

from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.vector import RoboticFish3DVectorEnv

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "environment.md"
SETTINGS = ROOT / "configs" / "env" / "robotic-fish-3d.yaml"

HEAD = """\
# The environment RoboticFish3D-v0

`make docs` writes this page from the docstrings of the environment.

```python
import gymnasium as gym

env = gym.make("fish_env:RoboticFish3D-v0", task="track")
observation, info = env.reset(seed=0)
for _ in range(100):
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
```
"""

MANY = """\
```python
import gymnasium as gym
import numpy as np

envs = gym.make_vec("fish_env:RoboticFish3D-v0", num_envs=64, randomization="prior")
observations, infos = envs.reset(seed=0)
observations, rewards, terminated, truncated, infos = envs.step(np.zeros((64, 5), np.float32))
```
"""

SB3 = """\
## Stable-Baselines3

`FishVecEnv` is the same batch as a `VecEnv` of Stable-Baselines3. It comes with
`pip install ".[train]"`.

```python
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from fish_env.envs.sb3 import FishVecEnv

model = PPO("MlpPolicy", VecMonitor(FishVecEnv(16, task="hold")), n_steps=32, device="cpu")
model.learn(1000)
```
"""


def page() -> str:
    """The page as Markdown."""
    single, options, raises = _parts(RoboticFish3DEnv)
    many, more, _ = _parts(RoboticFish3DVectorEnv)
    settings = SETTINGS.read_text(encoding="utf-8")
    return "\n".join(
        [
            HEAD,
            single,
            "## Options\n",
            "These are keyword arguments of `gym.make`. " + raises + "\n",
            _table(options),
            "## Many fish at once\n",
            many,
            MANY,
            _table(more),
            SB3,
            "## Settings\n",
            f"The defaults are in `configs/env/{SETTINGS.name}`. `config=` changes any of them:\n",
            f"```yaml\n{settings}```\n",
        ]
    )


def _parts(owner: type) -> tuple[str, list[tuple[str, str]], str]:
    """Text, options and errors of a class docstring, as Markdown."""
    text = _markdown(inspect.getdoc(owner) or "")
    text, _, arguments = text.partition("\nArgs:\n")
    text = "\n\n".join(map(_one_line, text.split("\n\n")))
    arguments, _, raises = arguments.partition("\nRaises:\n")
    options = re.findall(r"^    ([*\w]+): (.*(?:\n     .*)*)", arguments, re.MULTILINE)
    sentence = " ".join(raises.split())
    return text, [(n, " ".join(t.split())) for n, t in options], f"Raises {sentence}" * bool(raises)


def _markdown(text: str) -> str:
    """Roles and double backticks of a docstring as Markdown's code."""
    text = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", text)
    return text.replace("``", "`")


def _one_line(paragraph: str) -> str:
    """A paragraph on one line: a line of a formula that begins with - is no list."""
    return paragraph if paragraph.startswith(("|", "*", "#")) else " ".join(paragraph.split())


def _table(options: list[tuple[str, str]]) -> str:
    rows = [f"| `{name}` | {text.replace('|', chr(92) + '|')} |" for name, text in options]
    return "\n".join(["| option | meaning |", "| --- | --- |", *rows, ""])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"written: {PAGE}")
