"""Writes what looks ahead for corners in a block of lanes; effects that are off take no time.

As :mod:`fish_env.model.emit_blocks` writes the derivative: loops for each hook, of the bits of the
function of one lane (:mod:`fish_env.model.emit_corners`).
"""

from __future__ import annotations

from fish_env.model.effect import Effect
from fish_env.model.emit_blocks import ARGUMENTS, COUNT, EACH, BlockEmitter, loop_of
from fish_env.model.emit_reading import PHASE

LOOK = "width, elapsed, h, work"
NOW = "fraction = 0.0"
LENGTH = "length = work[LENGTH * width + k]"


class BlockCornerEmitter(BlockEmitter):
    """Writes all functions of a composition."""

    def in_one_loop(self) -> list[str]:
        """With corners where all lanes compute all effects."""
        call = "    lane_corner(k, width, elapsed, work)"
        return [*super().in_one_loop(), self.function("corner_lanes", LOOK, [COUNT, EACH, call])]

    def in_loops(self) -> list[str]:
        """With corners in loops, and their functions of one lane."""
        tails = [e for e in self.effects if "tail" in e.hooks]
        inputs = [e for e in self.effects if "inputs" in e.hooks]
        parts = [self.told_later(), *map(self.input_later, inputs), self.drive_later()]
        return [*super().in_loops(), *parts, *map(self.block_corner, tails), self.looking()]

    def told_later(self) -> str:
        """What the actuators will do at the end of a part, before effects."""
        lines = [*self.input_lines(), LENGTH, self.ahead_line(), *self.store("later_inputs")]
        return self.function("block_told_later", ARGUMENTS, lines)

    def input_later(self, effect: Effect) -> str:
        """The hook of an effect on that."""
        lines = [*self.lane([effect], ("later_inputs",)), *self.place_lines(water=False), LENGTH]
        given = "later_inputs, time + length, fish"
        lines += [self.call(effect, "inputs", "later_inputs", given), *self.store("later_inputs")]
        return self.function(f"block_{effect.name}_later", ARGUMENTS, lines)

    def drive_later(self) -> str:
        """The commanded tail at the end of a part, before effects."""
        lines = [*self.lane(self.late, ("inputs", "later_inputs")), PHASE, LENGTH]
        lines += [*self.heard()[:-1], *self.tail_later()]
        for name in ("later_inputs", "later_phase", "later_tail"):
            lines += self.store(name)
        lines.append("work[CORNER * width + k] = np.inf")
        return self.function("block_drive_later", ARGUMENTS, lines)

    def block_corner(self, effect: Effect) -> str:
        """What one effect makes of the tail, now and later, and when it makes its rate jump."""
        late = [e for e in self.late if e is not effect]
        read = ("inputs", "tail", "later_inputs", "later_phase", "later_tail")
        lines = [*self.lane([effect, *late], read), *self.place_lines(water=False), PHASE, LENGTH]
        lines += [f"motion = block_motion({ARGUMENTS})"] if effect.loaded else []
        lines += [*self.heard()[:-1], "corner = work[CORNER * width + k]"]
        lines += [*self.at_corner(effect), "work[CORNER * width + k] = corner"]
        lines += [*self.store("tail"), *self.store("later_tail")]
        return self.function(f"block_{effect.name}_corner", ARGUMENTS, lines)

    def looking(self) -> str:
        """When in its present part the rate of each lane's tail jumps first."""
        lines = [COUNT, NOW, *loop_of("block_told"), *self.hooks("inputs")]
        lines += loop_of("block_drive")
        loaded = [effect for effect in self.effects if effect.loaded]
        lines += self.where_on(loaded, self.hooks("water", "water_rate"))
        lines += loop_of("block_told_later")
        for stage, ending in (("inputs", "later"), ("tail", "corner")):
            lines += loop_of("block_drive_later") if stage == "tail" else []
            for effect in self.effects:
                if stage in effect.hooks:
                    lines += self.where_on([effect], loop_of(f"block_{effect.name}_{ending}"))
        return self.function("corner_lanes", LOOK, lines)
