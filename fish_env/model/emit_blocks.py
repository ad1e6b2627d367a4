"""Writes the derivative of a whole block of lanes, in which effects that are off take no time.

In the function of one lane every effect is computed, on or off: lanes in vector registers cannot
part ways. Here each hook of an effect has a loop over the lanes of its own, which is passed over
where no lane of the block has the effect on. What hooks hand on to each other lies in rows of the
block between the loops. Each lane is computed by the same operations in the same order, so the
bits are those of the function of one lane.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from fish_env.model.composition import BASE_TERMS, Composition
from fish_env.model.effect import Effect
from fish_env.model.emit import POWER
from fish_env.model.emit_corners import CornerEmitter
from fish_env.model.emit_reading import PHASE
from fish_env.model.records import Barycentre, Inputs, Tail, Vector, Wrench

KEPT: dict[str, type | None] = {
    "inputs": Inputs,
    "water": Vector,
    "rate": Vector,
    "tail": Tail,
    "centre": Barycentre,
    "factor": None,
    "force": Vector,
    "arm": Vector,
    "total": Wrench,
    "later_inputs": Inputs,
    "later_phase": None,
    "later_tail": Tail,
}
"""What hooks hand on, by its name in the function of one lane, with its type (None: a float)."""
READ = {
    "inputs": ("inputs",),
    "water": ("water",),
    "water_rate": ("water", "rate"),
    "tail": ("inputs", "tail"),
    "barycentre": ("inputs", "centre"),
    "body_drag": ("water", "rate", "factor"),
    "tail_force": ("water", "rate", "tail", "force", "arm", "total"),
    "wrench": ("inputs", "water", "rate", "tail", "centre", "total"),
}
"""Stages with loops of their own, and what their hooks read of it."""
CHANGED = {
    "inputs": "inputs",
    "water": "water",
    "water_rate": "rate",
    "tail": "tail",
    "barycentre": "centre",
    "body_drag": "factor",
    "tail_force": "force",
}
"""What hooks of a stage replace; those of ``wrench`` add to the total."""
GIVEN = {
    "inputs": "time, fish",
    "water": "place, time",
    "water_rate": "water, place, time",
    "tail": "tail_inputs, tail_phase, time, fish",
    "barycentre": "place, inputs, time, fish",
    "body_drag": "motion, fish",
}
"""Arguments of hooks behind the value."""
MOVED = ("body_drag", "tail_force", "wrench")
"""Stages whose hooks read the motion."""
ARGUMENTS = "k, width, elapsed, shift, work"
BLOCK = "width, elapsed, fraction, h, work, tables"
SHIFT = "shift = lane_shift(k, width, fraction, h, work)"
SWITCH = "lanes, width, work"
COUNT = "lanes = lanes_in(width, work)"
EACH = "for k in range(lanes):"


class BlockEmitter(CornerEmitter):
    """Writes the functions of a lane, and the derivative of a block of them."""

    def __init__(self, composition: Composition) -> None:
        super().__init__(composition)
        switched = any(not effect.varies for effect in self.effects)
        self.looped = composition.blocks and switched
        self.flags = len(self.effects) if self.looped else 0
        self.first: dict[str, int] = {}
        kept = self.flags + 4
        for name, kind in KEPT.items():
            self.first[name] = kept
            kept += len(_fields(kind))
        self.kept = kept if self.looped else int(composition.blocks)

    def text(self) -> str:
        """All functions of one composition."""
        own = self.in_loops() if self.looped else self.in_one_loop()
        own += [self.counting(), self.shifting()]
        return "\n".join([super().text(), f"N_KEPT = {self.kept}\n", *own])

    def in_one_loop(self) -> list[str]:
        """The derivative where all lanes compute all effects."""
        call = "lane_derivative(k, width, elapsed, shift, work, tables)"
        past = any(map(_has_past, self.effects))
        told = f"{self.counted} = lanes" if self.kept else "pass"
        return [
            self.function("switch_effects", SWITCH, [told]),
            self.function("memory_matters", "width, work", ["return N_MEMORY > 0"]),
            self.function("past_matters", "width, work", [f"return {past}"]),
            self.function("derive_lanes", BLOCK, [COUNT, EACH, f"    {SHIFT}", f"    {call}"]),
        ]

    def in_loops(self) -> list[str]:
        """The derivative in loops, with its functions of one lane."""
        parts = [self.switching(), self.asked("memory_matters", self.remembering)]
        parts += [self.asked("past_matters", self.past), self.fish(), self.motion()]
        parts += [self.loading(name) for name in KEPT]
        parts += [self.told(), self.drive(), self.forces(), *self.ends()]
        parts += [self.hook(e, stage) for stage in READ for e in self.effects if stage in e.hooks]
        return [*parts, self.loops()]

    # What is on.

    @property
    def counted(self) -> str:
        """How many lanes are computed. No compiler knows it: else it would write the loops out."""
        return f"work[(KEPT + {self.flags}) * width]"

    def counting(self) -> str:
        """The same as a whole number."""
        count = f"int({self.counted})" if self.kept else "width"
        return self.function("lanes_in", "width, work", [f"return {count}"])

    def shifting(self) -> str:
        """How far into its step a lane is, at a fraction of the step or of its present part (s)."""
        own = "work[BEGUN * width + k] + fraction * work[LENGTH * width + k]"
        shift = own if self.composition.own_steps else "fraction * h"
        return self.function("lane_shift", "k, width, fraction, h, work", [f"return {shift}"])

    @property
    def remembering(self) -> int:
        """Row that says whether an effect with a memory is on."""
        return self.flags + 1

    @property
    def past(self) -> int:
        """Row that says whether an effect with a past is on: states, a memory, a late command."""
        return self.flags + 2

    @property
    def bent(self) -> int:
        """Row that says whether an effect on the mass matrix is on."""
        return self.flags + 3

    def flag(self, effect: Effect) -> str:
        """The number that says whether an effect is on in any lane."""
        return f"work[(KEPT + {self.effects.index(effect)}) * width]"

    def asked(self, name: str, row: int) -> str:
        """A function that reads such a number."""
        return self.function(name, "width, work", [f"return work[(KEPT + {row}) * width] > 0.0"])

    def switching(self) -> str:
        """Which effects are on in any lane: to be called when all lanes have their parameters.

        Lanes behind those that are computed have no slopes.
        """
        lines = [f"{self.counted} = lanes"]
        lines += [f"{name} = 0.0" for name in ("remembering", "past", "bent")]
        for effect in self.effects:
            lines += self.found_on(effect)
            lines.append(f"{self.flag(effect)} = on")
            lines += ["remembering = max(remembering, on)"] if effect.memory else []
            lines += ["past = max(past, on)"] if _has_past(effect) else []
            lines += ["bent = max(bent, on)"] if "inertia" in effect.hooks else []
        found = {"remembering": self.remembering, "past": self.past, "bent": self.bent}
        lines += [f"work[(KEPT + {row}) * width] = {name}" for name, row in found.items()]
        return self.function("switch_effects", SWITCH, lines)

    def found_on(self, effect: Effect) -> list[str]:
        """Whether an effect is on in any lane: whether it is not neutral there."""
        if effect.varies or not effect.parameters:
            return ["on = 1.0"]
        rows = zip(self.parameter_rows(effect), effect.parameters, strict=True)
        off = [f"(work[(PAR + {row}) * width + k] == {_number(p.neutral)})" for row, p in rows]
        return ["on = 0.0", "for k in range(width):", f"    on = on if {' & '.join(off)} else 1.0"]

    # Rows between the loops.

    def loading(self, name: str) -> str:
        """A function that reads what was handed on."""
        kind = KEPT[name]
        rows = range(self.first[name], self.first[name] + len(_fields(kind)))
        values = ", ".join(f"work[(KEPT + {row}) * width + k]" for row in rows)
        lines = [f"return {kind.__name__}({values})" if kind else f"return {values}"]
        return self.function(f"block_{name}", "k, width, work", lines)

    def store(self, name: str) -> list[str]:
        """Hand it on."""
        fields = _fields(KEPT[name])
        return [
            f"work[(KEPT + {self.first[name] + i}) * width + k] = {name}{'.' if f else ''}{f}"
            for i, f in enumerate(fields)
        ]

    def lane(self, effects: Iterable[Effect] = (), read: Sequence[str] = ()) -> list[str]:
        """Read a lane: its fish, some effects' parameters, and what was handed on.

        By functions for each: of a line that stands in dozens of functions, the compiler would
        work out the types in each.
        """
        return [
            f"fish = block_fish({ARGUMENTS})",
            *map(self.record, effects),
            *(f"{name} = block_{name}(k, width, work)" for name in read),
        ]

    # Functions of one lane.

    def fish(self) -> str:
        """The fish of a lane, in the water where it is."""
        dense = [self.record(e) for e in self.effects if "density" in e.hooks]
        lines = [*self.fish_lines(), *dense, *self.place_lines(), "return fish"]
        return self.function("block_fish", ARGUMENTS, lines)

    def motion(self) -> str:
        """The motion of a lane in the water that was handed on."""
        lines = [*self.lane((), ("water", "rate")), *self.place_lines(water=False)]
        lines += self.pose_lines()
        lines += [*self.moved_lines(), "return motion"]
        return self.function("block_motion", ARGUMENTS, lines)

    def moved_lines(self) -> list[str]:
        """The fish against the ground and against the water that was handed on."""
        return [line for line in self.motion_lines() if line.startswith(("flow", "motion"))]

    def told(self) -> str:
        """What the actuators do, before effects; and what is handed on from where."""
        lines = [*self.input_lines(), *self.store("inputs")]
        lines += ["water = Vector(0.0, 0.0, 0.0)", "rate = water", "factor = 1.0"]
        lines += [line for name in ("water", "rate", "factor") for line in self.store(name)]
        return self.function("block_told", ARGUMENTS, lines)

    def heard(self) -> list[str]:
        """The command that reaches the tail, in a lane that has read its inputs."""
        return self.command_lines(self.recalled())

    @property
    def late(self) -> list[Effect]:
        """Effects by which the tail's command is late."""
        return [e for e in self.effects if e.command_delay]

    def drive(self) -> str:
        """The commanded tail and the barycentre, before effects."""
        lines = [*self.lane(self.late, ("inputs",)), PHASE, *self.heard()]
        lines += ["centre = barycentre(inputs, fish)", *self.store("tail"), *self.store("centre")]
        return self.function("block_drive", ARGUMENTS, lines)

    def forces(self) -> str:
        """All forces of the baseline, with the few hooks that stand between them."""
        between = [e for e in self.effects if {"tail_inflow", "tail_lift"} & set(e.hooks)]
        lines = self.lane(between, ("inputs", "tail", "centre", "factor"))
        lines += self.pose_lines()
        lines += [f"motion = block_motion({ARGUMENTS})", *self.own_tail_lines()]
        lines += [*self.plane_lines(), *self.weight_lines(), "work[ANGLE * width + k] = tail.angle"]
        lines += self.sum_of(self.wrench_terms()[: len(BASE_TERMS)])
        lines += [line for name in ("force", "arm", "total") for line in self.store(name)]
        return self.function("block_forces", f"{ARGUMENTS}, tables", lines)

    def hook(self, effect: Effect, stage: str) -> str:
        """One hook of an effect."""
        late = [e for e in self.late if stage == "tail" and e is not effect]
        read = [*self.lane([effect, *late], READ[stage]), *self.place_lines(water=False), PHASE]
        if stage in MOVED or (effect.loaded and stage == "tail"):
            read.append(f"motion = block_motion({ARGUMENTS})")
        if stage in CHANGED and stage != "tail_force":
            value = CHANGED[stage]
            heard = self.heard()[:-1] if stage == "tail" else []
            call = self.call(effect, stage, value, f"{value}, {GIVEN[stage]}")
            lines = [*heard, call, *self.store(value)]
        else:
            wrench = [self.wrench_line(effect)]
            lines = self.tail_force_lines(effect) if stage == "tail_force" else wrench
            sums = ", ".join(f"total.{f} + t_{effect.name}.{f}" for f in Wrench._fields)
            lines = [*lines, f"total = Wrench({sums})", *self.store("total")]
            lines += self.store("force") if stage == "tail_force" else []
        lines += self.slopes(effect) if stage in effect.states else []
        return self.function(f"block_{effect.name}_{stage}", ARGUMENTS, [*read, *lines])

    def ends(self) -> list[str]:
        """Accelerations and rates, without and with what effects do to the mass matrix."""
        bending = [e for e in self.effects if "inertia" in e.hooks]
        read = ("inputs", "tail", "centre", "force", "arm", "total")
        functions = []
        for name, effects in (("rigid", []), ("full", bending)):
            lines = [*self.lane(effects, read), *self.pose_lines(), POWER]
            lines += [*self.accelerations(rigid=not effects), *self.own_rates()]
            functions.append(self.function(f"block_{name}", ARGUMENTS, lines))
        return functions if bending else functions[:1]

    # The loops.

    def loops(self) -> str:
        """The derivative of all lanes."""
        lines = [COUNT, *loop_of("block_told"), *self.hooks("inputs")]
        lines += loop_of("block_drive")
        for stage in ("water", "water_rate", "tail", "barycentre", "body_drag"):
            lines += self.hooks(stage)
        lines += [*loop_of("block_forces", "tables"), *self.hooks("tail_force", "wrench")]
        end = loop_of("block_rigid")
        if self.has("inertia"):
            full = [f"    {line}" for line in loop_of("block_full")]
            bent = f"if work[(KEPT + {self.bent}) * width] > 0.0:"
            end = [bent, *full, "else:", *(f"    {line}" for line in end)]
        return self.function("derive_lanes", BLOCK, [*lines, *end])

    def hooks(self, *stages: str) -> list[str]:
        """Loops of all hooks of some stages, in the order of the effects."""
        lines = []
        for effect in self.effects:
            for stage in stages:
                if stage in effect.hooks:
                    lines += self.where_on([effect], loop_of(f"block_{effect.name}_{stage}"))
        return lines

    def where_on(self, effects: Iterable[Effect], lines: Sequence[str]) -> list[str]:
        """Some lines for a block in which any of some effects is on in any lane."""
        on = " or ".join(f"({self.flag(effect)} > 0.0)" for effect in effects)
        return [f"if {on}:", *(f"    {line}" for line in lines)] if on and lines else []


def _fields(kind: type | None) -> tuple[str, ...]:
    """Fields of what is handed on; a float has one without a name."""
    fields: tuple[str, ...] = getattr(kind, "_fields", ("",))
    return fields


def loop_of(function: str, *more: str) -> list[str]:
    """A loop over the lanes that calls a function for each."""
    return [EACH, f"    {SHIFT}", f"    {function}({', '.join([ARGUMENTS, *more])})"]


def _has_past(effect: Effect) -> bool:
    """Whether what happened before a run matters to an effect."""
    return bool(effect.states or effect.memory or effect.command_delay)


def _number(value: float) -> str:
    """A number as source."""
    if np.isinf(value):
        return "np.inf" if value > 0 else "-np.inf"
    return repr(float(value))
