"""Which effects a kernel contains, and which rows of its arrays follow from them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

from fish_env.model.corners import MEMORY
from fish_env.model.effect import Effect
from fish_env.model.state import BASE_STATES
from fish_env.params.packing import RECORD_FIELDS

TEMPLATE = Path(__file__).with_name("rollout_template.py")
PARTS_TEMPLATE = Path(__file__).with_name("parts_template.py")
BASE_TERMS = (
    "gravity",
    "buoyancy",
    "damping",
    "impact",
    "xz_drag",
    "xz_lift",
    "xy_drag",
    "xy_lift",
    "tail_drag",
    "tail_lift",
    "inertial",
)


@dataclass(frozen=True)
class Composition:
    """Which effects a kernel contains, and whether coefficient tables can be used.

    Attributes:
        effects: effects in the order their hooks run.
        tables: coefficient curves may come from tables (slower: a search for each).
        templates: source files with the entry points; each may use what precedes it.
        blocks: lanes are computed in blocks, in which effects that are off take no time, and each
            has its own pace and its own times at which commands switch.
    """

    effects: tuple[Effect, ...] = ()
    tables: bool = False
    templates: tuple[Path, ...] = (TEMPLATE, PARTS_TEMPLATE)
    blocks: bool = False

    def in_blocks(self, templates: tuple[Path, ...]) -> Composition:
        """The same with further templates, computed in blocks."""
        return replace(self, templates=(*self.templates, *templates), blocks=True)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Rows of the state: the fish, states of effects, then what effects remember."""
        states = (f"{e.name}.{s}" for e in self.effects for s in e.state_names)
        return (*BASE_STATES, *states, *self.memory_names)

    @property
    def memory_names(self) -> tuple[str, ...]:
        """The last rows of the state: kept from step to step, not integrated."""
        return tuple(f"{e.name}.{m}" for e in self.effects for m in e.memory_names)

    @property
    def tail_rows(self) -> list[int]:
        """Rows of states that follow the tail's phase."""
        names = [f"{e.name}.{state}" for e in self.effects for state in e.states.get("tail", ())]
        return [self.state_names.index(name) for name in names]

    @property
    def tail_corners(self) -> list[bool]:
        """Whether those rows are of effects that make the tail's rate jump."""
        return [e.nonsmooth for e in self.effects for _ in e.states.get("tail", ())]

    @property
    def tail_rates(self) -> list[bool]:
        """Whether those rows are rates of the tail (rad/s), as their names end, or angles (rad)."""
        return [self.state_names[row].endswith("rate") for row in self.tail_rows]

    @property
    def tail_memories(self) -> list[int]:
        """First rows of what tails remember, see :data:`fish_env.model.corners.MEMORY`."""
        remembering = [e for e in self.effects if e.memory.get("tail", ())[: len(MEMORY)] == MEMORY]
        return [self.state_names.index(f"{e.name}.{MEMORY[0]}") for e in remembering]

    @property
    def corners(self) -> tuple[Effect, ...]:
        """Effects for which steps are parted."""
        return tuple(e for e in self.effects if e.turns is not None or e.command_delay)

    @property
    def own_steps(self) -> bool:
        """Whether each lane has its own steps: parted where its tail's rate jumps, at its pace."""
        return self.blocks or bool(self.corners)

    @property
    def delays(self) -> tuple[str, ...]:
        """Parameters by which the tail's command is late (s)."""
        return tuple(f"{e.name}.{e.command_delay}" for e in self.effects if e.command_delay)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Rows of the parameter record: the fish, then ``effect.parameter``."""
        extra = (f"{e.name}.{p.name}" for e in self.effects for p in e.parameters)
        return (*RECORD_FIELDS, *extra)

    @property
    def term_names(self) -> tuple[str, ...]:
        """Names of the wrench terms."""
        extra = (e.name for e in self.effects if {"wrench", "tail_force"} & set(e.hooks))
        return (*BASE_TERMS, *extra)

    @property
    def label(self) -> str:
        """Short name of the generated file."""
        names = ",".join(effect.name for effect in self.effects) + (
            "|tables" if self.tables else ""
        )
        kind = "baseline" if not self.effects else f"effects{len(self.effects)}"
        names += "|blocks" if self.blocks else ""
        return f"{kind}_{hashlib.sha256(names.encode()).hexdigest()[:8]}"
