"""Writes the source that finds where the rate of a lane's tail jumps in the step ahead."""

from __future__ import annotations

from fish_env.model.effect import Effect
from fish_env.model.emit import Emitter
from fish_env.model.tail import TWO_PI

LATER = "later_tail, later_inputs, later_phase, time + length, fish"


class CornerEmitter(Emitter):
    """Writes the functions of a lane, and those that look ahead for corners of its tail."""

    def text(self) -> str:
        """All functions of one composition."""
        return "\n".join([super().text(), self.turns(), self.corner()])

    def turns(self) -> str:
        """Whether the rate of a lane's tail may jump within a step at all."""
        parted = (e for e in self.effects if e.turns is not None)
        answers = [f"{e.name}_turns(e_{e.name})" for e in parted]
        if self.composition.delays:
            answers.append(f"({self.delay()} > 0.0)")
        lines = self.records()
        lines.append(f"work[TURNS * width + k] = 1.0 if {' | '.join(answers)} else 0.0")
        return self.function("lane_turns", "k, width, work", lines if answers else ["pass"])

    def corner(self) -> str:
        """When the rate of a lane's tail jumps first; each effect is set for the time until then.

        The tail goes down the chain of its effects twice: as it is when a part of a step begins,
        and as it will be at the end of the part, if its rate does not jump before.
        """
        lines = [
            "length = work[LENGTH * width + k]",
            "shift = work[BEGUN * width + k]",
            *self.unpack(),
            *self.apply("inputs", "inputs", "time, fish"),
            *(self.motion_lines() if self.loaded else ()),
            *self.later_command(),
            "corner = np.inf",
        ]
        for effect in self.effects:
            lines += self.at_corner(effect) if "tail" in effect.hooks else ()
        lines.append("work[CORNER * width + k] = corner")
        if not self.composition.corners:
            lines = ["pass"]
        return self.function("lane_corner", "k, width, elapsed, work", lines)

    def at_corner(self, effect: Effect) -> list[str]:
        """What one effect makes of the tail, now and later, and when it makes its rate jump."""
        lines = self.look(effect) if effect.corner is not None else []
        lines += self.settle(effect) if effect.settling is not None else ()
        return [*lines, *self.both(effect)]

    def later_command(self) -> list[str]:
        """The command that reaches the tail when a part begins, and the one at its end."""
        return [
            *self.command_lines(self.recalled()),
            self.ahead_line(),
            *self.apply("inputs", "later_inputs", "time + length, fish"),
            *self.tail_later(),
        ]

    def ahead_line(self) -> str:
        """What the actuators will do at the end of a part."""
        ahead = ", ".join(f"u{i} + length * u{i}_rate" for i in range(5))
        return f"later_inputs = Inputs({ahead}, {', '.join(f'u{i}_rate' for i in range(5))})"

    def tail_later(self) -> list[str]:
        """The commanded tail at the end of a part."""
        turned = (
            f"{0.5 * TWO_PI!r} * length * (inputs.tail_frequency + later_inputs.tail_frequency)"
        )
        heard = "later_inputs, later_phase"
        return [
            f"later_phase = phase + {turned}",
            *([f"{heard} = {self.recalled('PAST_END', heard)}"] if self.composition.delays else ()),
            "later_tail = commanded_tail(later_inputs, later_phase)",
        ]

    def look(self, effect: Effect) -> list[str]:
        """Ask an effect when its jump comes, and keep how it moves until then."""
        rows = self.rows_of(effect)[len(effect.state_names) :]
        memory = ", ".join(f"work[(X + {row}) * width + k]" for row in rows)
        told = self.names("m", effect, effect.memory_names)
        name = effect.name
        given = f"tail, tail_phase, later_tail, later_phase, e_{name}, ({memory},), length"
        lines = [
            f"when, {told} = {name}_corner({given})",
            f"turning = {name}_turns(e_{name}) & (length > 0.0)",
            "corner = min(corner, when if turning else np.inf)",
        ]
        for i, row in enumerate(rows):
            kept = f"m_{name}_{i} if turning else work[(X + {row}) * width + k]"
            lines.append(f"work[(X + {row}) * width + k] = {kept}")
            lines.append(f"work[(X0 + {row}) * width + k] = work[(X + {row}) * width + k]")
        return lines

    def settle(self, effect: Effect) -> list[str]:
        """Ask an effect how long a part its states allow."""
        name, count = effect.name, len(effect.state_names)
        states = "".join(f"work[(X + {row}) * width + k], " for row in self.rows_of(effect)[:count])
        return [f"corner = min(corner, {name}_settling(tail, e_{name}, ({states})))"]

    def both(self, effect: Effect) -> list[str]:
        """The tail behind an effect, now and at the end of the part.

        A state that is the angle or the rate of the tail has gone on by then, as its slopes say.
        """
        given = "tail_inputs, tail_phase, time, fish"
        before = f"tail_{effect.name}"
        lines = ["since = 0.0", self.call(effect, "tail", before, f"tail, {given}")]
        gone = {
            "angle": f"{before}.angle + length * ({before}.rate "
            f"+ 0.5 * length * {before}.acceleration)",
            "rate": f"{before}.rate + length * {before}.acceleration",
        }
        call = self.call(effect, "tail", "later_tail", LATER)
        for name, row in zip(effect.state_names, self.rows_of(effect), strict=False):
            if name in gone:
                call = call.replace(f"work[(X + {row}) * width + k]", gone[name])
        return [*lines, "since = length", call, f"tail = {before}"]
