"""Writes the source of one lane's evaluation: baseline terms with the hooks of the effects between.

This is the table of contents of the physics: each line it writes calls one function that holds one
idea, in the order in which the model is computed.
"""

from __future__ import annotations

from collections.abc import Sequence

from fish_env.model.composition import BASE_TERMS
from fish_env.model.effect import Effect
from fish_env.model.emit_reading import LaneReader
from fish_env.model.history import COMMAND
from fish_env.model.records import Wrench
from fish_env.params.packing import CURVES

OUTPUTS = {
    "tail_angle": "tail.angle",
    "tail_rate": "tail.rate",
    "tail_power": "power",
    "barycentre_x": "centre.x",
    "barycentre_y": "centre.y",
    "barycentre_z": "centre.z",
    "surge_through_water": "motion.u",
    "sway_through_water": "motion.v",
    "heave_through_water": "motion.w",
}
"""Quantities reported beside the wrenches (rad, rad/s, W, m, m/s) and what they are called here."""
POWER = "power = hinge_power(tail, arm, force)"
ACROSS = {1: "xz_", 2: "xy_"}
"""Component of the force across each body plane, which is zero."""


class Emitter(LaneReader):
    """Writes the functions that evaluate one lane."""

    def text(self) -> str:
        """All functions of one composition."""
        sizes = (
            f"N_STATES = {len(self.states)}\nN_MEMORY = {len(self.composition.memory_names)}\n"
            f"N_PARAMETERS = {len(self.parameters)}\n"
            f"N_TERMS = {len(self.composition.term_names)}\n"
            f"LATE_TAIL = {bool(self.composition.delays)}\n"
            f"TAIL_ROWS = np.array({self.composition.tail_rows}, np.int64)\n"
            f"TAIL_CORNERS = np.array({self.composition.tail_corners}, np.bool_)\n"
            f"TAIL_RATES = np.array({self.composition.tail_rates}, np.bool_)\n"
            f"TAIL_MEMORIES = np.array({self.composition.tail_memories}, np.int64)\n"
            f"OWN_STEPS = {self.composition.own_steps}\n"
            f"SWITCHES = {self.composition.blocks}\n"
        )
        parts = (self.derivative, self.terms, self.initialise, self.command, self.memory)
        return "\n".join([sizes, *(part() for part in parts)])

    def derivative(self) -> str:
        """d(state)/dt of one lane."""
        lines = [*self.evaluation(), "work[ANGLE * width + k] = tail.angle"]
        lines += [*self.total(), *self.accelerations(), *self.rates()]
        return self.function("lane_derivative", "k, width, elapsed, shift, work, tables", lines)

    def terms(self) -> str:
        """Wrench of every term, and the outputs beside them."""
        lines = [*self.evaluation()]
        for row, (name, kind) in enumerate(self.wrench_terms()):
            for component in range(6):
                attribute = Wrench._fields[component]
                value = f"{name}.{attribute}"
                if kind != "wrench":
                    present = (component < 3) == (kind == "force")
                    value = f"{name}.{'xyz'[component % 3]}" if present else "0.0"
                lines.append(f"terms[{row}, {component}, k] = {value}")
        lines += [f"outputs[{row}, k] = {value}" for row, value in enumerate(OUTPUTS.values())]
        arguments = "k, width, elapsed, shift, work, tables, terms, outputs"
        return self.function("lane_terms", arguments, lines)

    def initialise(self) -> str:
        """States and memory of effects at the start of a run, each behind the hooks before it."""
        lines = ["elapsed = 0.0", "shift = 0.0", *self.unpack()]
        lines += self.apply("inputs", "inputs", "time, fish", "commanded_tail(inputs, phase)")
        lines += self.motion_lines() if self.loaded else ()
        lines += self.command_lines("running_command(inputs, phase, late)")
        lines += self.apply("tail", "tail", "tail_inputs, tail_phase, time, fish", "tail")
        for effect in self.effects:
            if {*effect.states, *effect.memory} - {"inputs", "tail"}:
                lines += self.start(effect, "tail")
        return self.function("lane_initialise", "k, width, work", lines)

    def command(self) -> str:
        """What the tail's servo is told in a step that begins now, for commands that come late."""
        lines = ["shift = 0.0", *self.unpack(), *self.apply("inputs", "inputs", "time, fish")]
        told = [f"inputs.tail_{name}" for name in COMMAND] + ["phase", self.delay()]
        lines += [f"work[(TOLD + {i}) * width + k] = {value}" for i, value in enumerate(told)]
        return self.function("lane_command", "k, width, elapsed, work", lines)

    def memory(self) -> str:
        """What effects remember of a step that ends in the present state."""
        lines = [
            "shift = h",
            *self.unpack(),
            *self.apply("inputs", "inputs", "time, fish"),
            *(self.motion_lines() if self.loaded else ()),
            *self.command_lines(self.recalled()),
            *self.apply("tail", "tail", "tail_inputs, tail_phase, time, fish"),
        ]
        for effect in self.effects:
            for i, name in enumerate(effect.memory_names):
                row = self.states.index(f"{effect.name}.{name}")
                lines.append(f"work[(X + {row}) * width + k] = m_{effect.name}_{i}")
        return self.function("lane_remember", "k, width, elapsed, h, work", lines)

    def coefficient(self, kind: str, s: str, curve: str, *numbers: str) -> str:
        """Call of a coefficient, analytic or from a table."""
        values = ", ".join(f"fish.{number}" for number in numbers)
        return f"{self.coefficients}_{kind}({s}, {values}, tables, {CURVES.index(curve)})"

    def evaluation(self) -> list[str]:
        """Everything up to the wrench terms."""
        lines = [
            *self.unpack(),
            *self.apply("inputs", "inputs", "time, fish"),
            *self.motion_lines(),
            *self.command_lines(self.recalled()),
            *self.apply("tail", "tail", "tail_inputs, tail_phase, time, fish"),
            "centre = barycentre(inputs, fish)",
            *self.apply("barycentre", "centre", "place, inputs, time, fish"),
            *self.tail_lines(),
            *self.body_lines(),
            *self.weight_lines(),
        ]
        wrenches = (e for e in self.effects if "wrench" in e.hooks)
        return [*lines, *(self.wrench_line(effect) for effect in wrenches)]

    def weight_lines(self) -> list[str]:
        """Weight, buoyancy, rotational damping and inertia."""
        return [
            "gravity = gravity_wrench(attitude, centre, fish)",
            "buoyancy = buoyancy_force(attitude, centre, fish)",
            "damping = damping_moment(motion, fish)",
            "inertial = inertial_wrench(motion, centre)",
        ]

    def wrench_line(self, effect: Effect) -> str:
        """The wrench of an effect."""
        given = "motion, tail, inputs, centre, fish"
        return self.call(effect, "wrench", f"t_{effect.name}", given)

    def motion_lines(self) -> list[str]:
        """The fish against the ground and against the water."""
        return [
            "water = Vector(0.0, 0.0, 0.0)",
            *self.apply("water", "water", "place, time"),
            "flow = to_body(attitude, water)" if self.has("water") else "flow = water",
            "rate = Vector(0.0, 0.0, 0.0)",
            *self.apply("water_rate", "rate", "water, place, time"),
            "flow_rate = to_body(attitude, rate)" if self.has("water_rate") else "flow_rate = rate",
            "motion = relative_motion(time, place, velocity, omega, attitude, flow, flow_rate)",
        ]

    def tail_lines(self) -> list[str]:
        """Tail: kinematics, forces, servo power."""
        lines = self.own_tail_lines()
        for effect in self.effects:
            lines += self.tail_force_lines(effect) if "tail_force" in effect.hooks else ()
        return [*lines, POWER]

    def tail_force_lines(self, effect: Effect) -> list[str]:
        """What an effect makes of the force on the tail, and the wrench of the change."""
        change = ", ".join(f"force.{axis} - before.{axis}" for axis in "xyz")
        return [
            "before = force",
            self.call(effect, "tail_force", "force", "force, motion, tail, fish"),
            f"t_{effect.name} = tail_wrench(arm, Vector({change}), fish)",
        ]

    def own_tail_lines(self) -> list[str]:
        """Tail: kinematics, lift and drag."""
        drag = self.coefficient("drag", "s_tail", "tail.drag", "tail_c0", "tail_c2")
        lift = self.coefficient("lift", "s_tail", "tail.lift", "tail_c1")
        return [
            "inflow = motion",
            *self.apply("tail_inflow", "inflow", "fish"),
            "arm, normal = tail_arm(tail, fish)",
            "v_tail = tail_velocity(inflow, tail, arm, fish)",
            "speed_tail, inverse_tail = speed_and_inverse(v_tail.x, v_tail.y, v_tail.z)",
            "s_tail = (normal.x * v_tail.x + normal.y * v_tail.y) * inverse_tail",
            "scale_tail = 0.5 * fish.density * fish.tail_area",
            f"lift_tail = {lift}",
            *self.apply("tail_lift", "lift_tail", "s_tail, fish"),
            f"f_drag = drag_force(v_tail, speed_tail, scale_tail, {drag})",
            "f_lift = lift_force(v_tail, normal, speed_tail, s_tail, scale_tail, lift_tail)",
            "force = Vector(f_drag.x + f_lift.x, f_drag.y + f_lift.y, f_drag.z + f_lift.z)",
            "tail_drag = tail_wrench(arm, f_drag, fish)",
            "tail_lift = tail_wrench(arm, f_lift, fish)",
        ]

    def body_lines(self) -> list[str]:
        """Body planes and impact moments."""
        factor = ["factor = 1.0", *self.apply("body_drag", "factor", "motion, fish")]
        return [*factor, *self.plane_lines()]

    def plane_lines(self) -> list[str]:
        """Body planes, whose drag is multiplied by a factor, and impact moments."""
        lines = []
        scale = "factor * " if self.has("body_drag") else ""
        for plane, normal, area in (("xz", "w", "z"), ("xy", "v", "y")):
            curve = f"body.plane_{plane}"
            drag = self.coefficient(
                "drag", f"flow_{plane}.s", f"{curve}.drag", f"{plane}_c0", f"{plane}_c2"
            )
            lift = self.coefficient("lift", f"flow_{plane}.s", f"{curve}.lift", f"{plane}_c1")
            moment = self.coefficient(
                "moment",
                f"flow_{plane}.s, flow_{plane}.cosine",
                f"{curve}.impact_moment",
                f"{plane}_k",
            )
            unit = "Vector(0.0, 0.0, 1.0)" if normal == "w" else "Vector(0.0, 1.0, 0.0)"
            lines += [
                f"v_{plane} = plane_{plane}_velocity(motion)",
                f"flow_{plane} = plane_flow(motion.u, motion.{normal}, fish.area_x, "
                f"fish.area_{area}, fish.density)",
                f"{plane}_drag = drag_force(v_{plane}, flow_{plane}.speed, flow_{plane}.scale, "
                f"{scale}{drag})",
                f"{plane}_lift = lift_force(v_{plane}, {unit}, flow_{plane}.speed, "
                f"flow_{plane}.s, flow_{plane}.scale, {lift})",
                f"c_{plane} = {moment}",
            ]
        return [*lines, "impact = impact_moment(flow_xz, flow_xy, c_xz, c_xy)"]

    def wrench_terms(self) -> list[tuple[str, str]]:
        """Variables that hold the terms, with their kind: force, moment or both."""
        kinds = {"buoyancy": "force", "damping": "moment", "impact": "moment"}
        kinds |= {
            f"{plane}_{force}": "force" for plane in ("xz", "xy") for force in ("drag", "lift")
        }
        terms = [(name, kinds.get(name, "wrench")) for name in BASE_TERMS]
        return terms + [
            (f"t_{name}", "wrench") for name in self.composition.term_names[len(BASE_TERMS) :]
        ]

    def total(self) -> list[str]:
        """Sum of all terms."""
        return self.sum_of(self.wrench_terms())

    def sum_of(self, terms: Sequence[tuple[str, str]]) -> list[str]:
        """Sum of terms with their kinds, without components that are zero by construction."""
        sums = []
        for component, attribute in enumerate(Wrench._fields):
            is_force = component < 3
            parts = []
            for name, kind in terms:
                if kind == "wrench":
                    parts.append(f"{name}.{attribute}")
                elif (kind == "force") == is_force and name[:3] != ACROSS.get(component):
                    parts.append(f"{name}.{'xyz'[component % 3]}")
            sums.append(" + ".join(parts))
        return [f"total = Wrench({', '.join(sums)})"]

    def accelerations(self, rigid: bool = False) -> list[str]:
        """Newton-Euler: the mass matrix solved for the total wrench.

        Args:
            rigid: leave out what effects do to the mass matrix.
        """
        changed = [] if rigid else self.apply("inertia", "inertia", "tail, fish")
        return [
            "inertia = rigid_inertia(centre)",
            *changed,
            f"acceleration = {'solve_full' if changed else 'solve_rigid'}(inertia, total)",
        ]

    def rates(self) -> list[str]:
        """Store the derivative of every state."""
        lines = self.own_rates()
        for effect in self.effects:
            lines += self.slopes(effect)
        return lines

    def slopes(self, effect: Effect) -> list[str]:
        """Store the derivatives of an effect's states."""
        rows = zip(effect.state_names, self.rows_of(effect), strict=False)
        return [
            f"work[(DX + {row}) * width + k] = d_{effect.name}_{i}"
            for i, (_, row) in enumerate(rows)
        ]

    def own_rates(self) -> list[str]:
        """Store the derivative of the state of the fish."""
        quaternion = ", ".join(f"work[(X + {i}) * width + k]" for i in range(3, 7))
        values = [
            "drift.x",
            "drift.y",
            "drift.z",
            *(f"spin[{i}]" for i in range(4)),
            *(f"acceleration.{a}" for a in ("fx", "fy", "fz", "mx", "my", "mz")),
            "TWO_PI * inputs.tail_frequency",
            "attitude.xx * level",
            "attitude.yx * level",
            "velocity.x",
            "power",
        ]
        return [
            "drift = to_inertial(attitude, velocity)",
            f"spin = quaternion_rate({quaternion}, omega.x, omega.y, omega.z)",
            "_, level = speed_and_inverse(attitude.xx, attitude.yx, 0.0)",
            *(f"work[(DX + {i}) * width + k] = {value}" for i, value in enumerate(values)),
        ]
