"""Runs exported policies: ONNX models with onnxruntime, C headers with the system's compiler."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fish_env.envs.layout import OBSERVATION, OBSERVATION_LIMIT
from robofish_agents.deployment.c_header import prefix_of
from robofish_agents.evaluation.suites import load_suite
from robofish_agents.policies import PolicyFile, PretrainedPolicy
from robofish_agents.registry import Agent, load_agents

SIZE, ACTIONS = len(OBSERVATION), 5
FLAGS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror")
DRIVER = """
#include "{file}"
#include <time.h>
int memory_bytes(void) {{ return (int)sizeof({name}_memory); }}
void start({name}_memory *memory, int count) {{
  int i;
  for (i = 0; i < count; ++i) {name}_reset(memory + i);
}}
int act({name}_memory *memory, int count, const float *observations, float *actions) {{
  int i, good = 0;
  for (i = 0; i < count; ++i) {{
    good += {name}_act(memory + i, observations + {size} * i, actions + {actions} * i);
  }}
  return good;
}}
void targets(const float *action, float *out) {{ {name}_targets(action, out); }}
"""


class OnnxPolicy:
    """An ONNX model on one thread."""

    def __init__(self, file: Path) -> None:
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(
            str(file), options, providers=["CPUExecutionProvider"]
        )
        self._width = [i.shape[1] for i in self.session.get_inputs() if i.name == "past"]

    def reset(self, count: int) -> None:
        """Swims of ``count`` fish begin."""
        self._first = np.ones((count, 1), bool)
        self._past = np.zeros((count, *self._width), np.float32)

    def act(self, observations: np.ndarray) -> np.ndarray:
        """Actions (N, 5) for observations (N, 33)."""
        feeds = {"observation": np.asarray(observations, np.float32)}
        if self._width:
            feeds |= {"past": self._past, "first": self._first}
        action, *after = self.session.run(None, feeds)
        self._first = np.zeros_like(self._first)
        self._past = after[0] if after else self._past
        return action


def compiler() -> str | None:
    """The system's C compiler, if there is one."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


class CompiledPolicy:
    """A C header, compiled into a library beside it; `flags` are for the compiler."""

    def __init__(self, header: Path, *flags: str) -> None:
        source = header.with_suffix(".driver.c")
        name = prefix_of(header)
        source.write_text(
            DRIVER.format(file=header.name, name=name, size=SIZE, actions=ACTIONS), "ascii"
        )
        library = header.with_suffix(f".{len(flags)}.so")
        command = [compiler() or "cc", *FLAGS, *flags, "-shared", "-fPIC", str(source)]
        subprocess.run([*command, "-o", str(library), "-lm"], check=True)
        self.source, self._library = source, ctypes.CDLL(str(library))

    def reset(self, count: int) -> None:
        """Swims of ``count`` fish begin."""
        self._memory = ctypes.create_string_buffer(count * self._library.memory_bytes())
        self._library.start(self._memory, count)

    def act(self, observations: np.ndarray) -> np.ndarray:
        """Actions (N, 5) for observations (N, 33); ``good`` counts those that were accepted."""
        seen = np.ascontiguousarray(observations, np.float32)
        actions = np.full((len(seen), ACTIONS), np.nan, np.float32)
        self.good = self._library.act(
            self._memory, len(seen), ctypes.c_void_p(seen.ctypes.data),
            ctypes.c_void_p(actions.ctypes.data),
        )  # fmt: skip
        return actions

    def targets(self, action: np.ndarray) -> np.ndarray:
        """What the header makes of an action (5,): targets of the actuators (5,)."""
        asked, out = np.array(action, np.float32), np.zeros(ACTIONS, np.float32)
        self._library.targets(ctypes.c_void_p(asked.ctypes.data), ctypes.c_void_p(out.ctypes.data))
        return out

    @property
    def memory_bytes(self) -> int:
        """What the header keeps for one fish."""
        return int(self._library.memory_bytes())

    def flash_bytes(self) -> int:
        """Code and constants of the header, compiled for small size."""
        built = self.source.with_suffix(".o")
        command = [compiler() or "cc", "-std=c99", "-Os", "-c", str(self.source), "-o", str(built)]
        subprocess.run(command, check=True)
        shown = subprocess.run(["size", str(built)], check=True, capture_output=True, text=True)
        return int(shown.stdout.splitlines()[1].split()[0])


def observations(task: str, steps: int, fish: int, seed: int = 0) -> Iterator[np.ndarray]:
    """Observations (fish, 33), step by step: even steps are swum in `hard`, odd ones drawn.

    The shipped policy swims. Drawn observations have normal distributions with a standard deviation
    that goes from 0.1 to 10, so that many are clipped.
    """
    rng = np.random.default_rng(seed)
    env, agent = load_suite("hard").make(task, fish, 1), load_agents("pretrained", task)[0]
    swum, _ = env.reset(seed=seed)
    agent.reset(fish)
    for step in range(steps):
        if step % 2:
            spread = 10.0 ** rng.uniform(-1.0, 1.0, (fish, 1))
            drawn = spread * rng.standard_normal((fish, SIZE))
            yield np.clip(drawn, -OBSERVATION_LIMIT, OBSERVATION_LIMIT).astype(np.float32)
        else:
            yield swum.copy()
            swum = env.step(agent.act(swum))[0]


def differences(
    policy: PolicyFile, exported: dict[str, Agent], task: str, steps: int, fish: int
) -> dict[str, tuple[float, float]]:
    """Largest and root-mean-square difference in an action between exports and the NumPy policy."""
    reference = PretrainedPolicy(policy)
    for one in (reference, *exported.values()):
        one.reset(fish)
    largest, squares = dict.fromkeys(exported, 0.0), dict.fromkeys(exported, 0.0)
    for seen in observations(task, steps, fish):
        wanted = reference.act(seen).astype(float)
        for name, one in exported.items():
            off = np.abs(one.act(seen) - wanted)
            # A NaN is no agreement.
            largest[name] = max(largest[name], float(np.max(np.nan_to_num(off, nan=np.inf))))
            squares[name] += float(np.mean(off**2)) / steps
    return {name: (largest[name], float(np.sqrt(squares[name]))) for name in exported}


def decision_us(agent: Agent, seen: np.ndarray, rounds: int = 2000) -> float:
    """Median processor time (us) of a decision for one fish, called from Python."""
    agent.reset(1)
    times = []
    for i in range(rounds):
        row = seen[i % len(seen)][None]
        before = time.thread_time_ns()
        agent.act(row)
        times.append((time.thread_time_ns() - before) / 1e3)
    return float(np.median(times))


def bare_decision_us(agent: CompiledPolicy, seen: np.ndarray, rounds: int = 11) -> float:
    """Median processor time (us) of a decision in C, without Python: many fish in one call."""
    agent.reset(len(seen))
    times = []
    for _ in range(rounds):
        before = time.thread_time_ns()
        agent.act(seen)
        times.append((time.thread_time_ns() - before) / 1e3 / len(seen))
    return float(np.median(times))
