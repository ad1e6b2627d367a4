"""Writes how the numbers of a lane are read, and the calls of effects' hooks."""

from __future__ import annotations

from collections.abc import Sequence

from fish_env.model.composition import Composition
from fish_env.model.effect import Effect
from fish_env.model.history import HEARD
from fish_env.params.packing import RECORD_FIELDS

PHASE = "phase = work[(X + 13) * width + k]"


class LaneReader:
    """Writes the lines that the functions of a lane have in common."""

    def __init__(self, composition: Composition) -> None:
        self.composition = composition
        self.effects = composition.effects
        self.states = composition.state_names
        self.parameters = composition.parameter_names
        self.coefficients = "table" if composition.tables else "analytic"
        self.loaded = any(effect.loaded for effect in composition.effects)

    def function(self, name: str, arguments: str, lines: Sequence[str]) -> str:
        """One kernel from its lines."""
        body = "\n".join(f"    {line}" for line in lines)
        return f"\n@kernel\ndef {name}({arguments}):\n{body}\n"

    def start(self, effect: Effect, tail: str) -> list[str]:
        """Store where the run starts an effect's states and memory."""
        call = f"{effect.name}_initial(inputs, {tail}, fish, e_{effect.name})"
        return [
            f"begin_{effect.name} = {call}",
            *(
                f"work[(X + {row}) * width + k] = begin_{effect.name}[{i}]"
                for i, row in enumerate(self.rows_of(effect))
            ),
        ]

    def recalled(self, rows: str = "PAST", inputs: str = "inputs, phase") -> str:
        """Inputs and phase that reach the tail in a rollout."""
        past = ", ".join(f"work[({rows} + {i}) * width + k]" for i in range(len(HEARD)))
        return f"late_command(late, {inputs}, {past})"

    def delay(self) -> str:
        """How late the tail's command is (s)."""
        return " + ".join(f"e_{name}" for name in self.composition.delays) or "0.0"

    def command_lines(self, recalled: str) -> list[str]:
        """The commanded tail: of now, or of what was recalled for a lane whose command is late."""
        lines = ["tail_inputs, tail_phase = inputs, phase"]
        if self.composition.delays:
            lines = [f"late = {self.delay()}", f"tail_inputs, tail_phase = {recalled}"]
        return [*lines, "tail = commanded_tail(tail_inputs, tail_phase)"]

    def rows_of(self, effect: Effect) -> list[int]:
        """Rows of an effect's states, then of its memory."""
        names = (*effect.state_names, *effect.memory_names)
        return [self.states.index(f"{effect.name}.{name}") for name in names]

    def unpack(self) -> list[str]:
        """Read parameters, state and inputs of a lane."""
        return [*self.fish_lines(), *self.records(), *self.state_lines(), *self.input_lines()]

    def fish_lines(self) -> list[str]:
        """Read the coefficients of the fish of a lane."""
        count = len(RECORD_FIELDS)
        fields = ", ".join(f"work[(PAR + {i}) * width + k]" for i in range(count))
        return [f"fish = Fish({fields})"]

    def state_lines(self) -> list[str]:
        """Read the state of a lane, and put its fish into the water where that is."""
        return [*self.place_lines(), *self.pose_lines(), PHASE]

    def place_lines(self, water: bool = True) -> list[str]:
        """Read when and where a lane is.

        Args:
            water: put its fish into the water there.
        """
        state = ", ".join(f"work[(X + {i}) * width + k]" for i in range(3))
        return [
            "time = work[TIME * width + k] + elapsed + shift",
            f"since = shift{' - work[BEGUN * width + k]' if self.composition.corners else ''}",
            f"place = Vector({state})",
            *(self.other_water() if water else ()),
        ]

    def pose_lines(self) -> list[str]:
        """Read attitude and velocities of a lane."""
        state = [f"work[(X + {i}) * width + k]" for i in range(13)]
        return [
            f"attitude = rotation({', '.join(state[3:7])})",
            f"velocity = Vector({', '.join(state[7:10])})",
            f"omega = Vector({', '.join(state[10:13])})",
        ]

    def input_lines(self) -> list[str]:
        """Read what the actuators of a lane do."""
        lines = []
        for i in range(5):
            lines.append(f"u{i}_rate = work[(U_RATE + {i}) * width + k]")
            lines.append(f"u{i} = work[(U + {i}) * width + k] + shift * u{i}_rate")
        rates = ", ".join(f"u{i}_rate" for i in range(5))
        lines.append(f"inputs = Inputs(u0, u1, u2, u3, u4, {rates})")
        return lines

    def records(self) -> list[str]:
        """Read the parameters of effects of a lane."""
        return [self.record(effect) for effect in self.effects]

    def record(self, effect: Effect) -> str:
        """Read the parameters of an effect of a lane."""
        values = ", ".join(f"work[(PAR + {i}) * width + k]" for i in self.parameter_rows(effect))
        return f"e_{effect.name} = {effect.name}_record({values})"

    def parameter_rows(self, effect: Effect) -> list[int]:
        """Rows of an effect's parameters."""
        return [self.parameters.index(f"{effect.name}.{p.name}") for p in effect.parameters]

    def other_water(self) -> list[str]:
        """The fish of the lane in water whose density effects change."""
        if not self.has("density"):
            return []
        fields = ", ".join("density" if f == "density" else f"fish.{f}" for f in RECORD_FIELDS)
        changed = self.apply("density", "density", "place")
        return ["density = fish.density", *changed, f"fish = Fish({fields})"]

    def apply(self, stage: str, value: str, arguments: str, tail: str = "") -> list[str]:
        """Calls of all hooks of a stage, each replacing ``value``.

        With ``tail``, the name of the tail so far, each effect's states are set before its hook.
        """
        lines = []
        for effect in self.effects:
            if stage in effect.hooks:
                if tail and stage in {*effect.states, *effect.memory}:
                    lines += self.start(effect, tail)
                lines.append(self.call(effect, stage, value, f"{value}, {arguments}"))
        return lines

    def call(self, effect: Effect, stage: str, target: str, arguments: str) -> str:
        """Call of one hook, which also gives the slopes of its states and its new memory."""
        water = ["motion"] if effect.loaded and stage == "tail" else []
        targets, given = [target], [arguments, *water, f"e_{effect.name}"]
        rows = [f"work[(X + {row}) * width + k], " for row in self.rows_of(effect)]
        count = len(effect.state_names)
        if stage in effect.states:
            given.append(f"({''.join(rows[:count])})")
            targets.append(self.names("d", effect, effect.state_names))
        if stage in effect.memory:
            given.append(f"({''.join(rows[count:])}), since")
            targets.append(self.names("m", effect, effect.memory_names))
        return f"{', '.join(targets)} = {effect.name}_{stage}({', '.join(given)})"

    def names(self, letter: str, effect: Effect, values: Sequence[str]) -> str:
        """A tuple of variables of an effect."""
        return f"({''.join(f'{letter}_{effect.name}_{i}, ' for i in range(len(values)))})"

    def has(self, stage: str) -> bool:
        """Whether any effect has a hook for this stage."""
        return any(stage in effect.hooks for effect in self.effects)
