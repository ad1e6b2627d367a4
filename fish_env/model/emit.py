"""Writes the source of one lane's evaluation: baseline terms with the hooks of the effects between.

This is the table of contents of the physics: each line it writes calls one function that holds one
idea, in the order in which the model is computed.
"""

from __future__ import annotations

from collections.abc import Sequence

from fish_env.model.composition import BASE_TERMS, Composition
from fish_env.model.effect import Effect
from fish_env.model.history import COMMAND, HEARD
from fish_env.model.records import Wrench
from fish_env.params.packing import CURVES, RECORD_FIELDS

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
PHASE = "phase = work[(X + 13) * width + k]"
POWER = "power = hinge_power(tail, arm, force)"
ACROSS = {1: "xz_", 2: "xy_"}
"""Component of the force across each body plane, which is zero."""


class Emitter:
    """Writes the functions that evaluate one lane."""

    def __init__(self, composition: Composition) -> None:
        self.composition = composition
        self.effects = composition.effects
        self.states = composition.state_names
        self.parameters = composition.parameter_names
        self.coefficients = "table" if composition.tables else "analytic"
        self.loaded = any(effect.loaded for effect in composition.effects)

    def text(self) -> str:
        """All functions of one composition."""
        sizes = (
            f"N_STATES = {len(self.states)}\nN_MEMORY = {len(self.composition.memory_names)}\n"
            f"N_PARAMETERS = {len(self.parameters)}\n"
            f"N_TERMS = {len(self.composition.term_names)}\n"
            f"LATE_TAIL = {bool(self.composition.delays)}\n"
            f"TAIL_ROWS = np.array({self.composition.tail_rows}, np.int64)\n"
            f"TAIL_RATES = np.array({self.composition.tail_rates}, np.bool_)\n"
            f"CORNERS = {bool(self.composition.corners)}\n"
        )
        parts = (self.derivative, self.terms, self.initialise, self.command, self.memory)
        return "\n".join([sizes, *(part() for part in parts)])

    def function(self, name: str, arguments: str, lines: Sequence[str]) -> str:
        """One kernel from its lines."""
        body = "\n".join(f"    {line}" for line in lines)
        return f"\n@kernel\ndef {name}({arguments}):\n{body}\n"

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
        parted = stage == "tail" and effect.part is not None and self.composition.corners
        hook = f"{effect.name}_{'part' if parted else stage}"
        return f"{', '.join(targets)} = {hook}({', '.join(given)})"

    def names(self, letter: str, effect: Effect, values: Sequence[str]) -> str:
        """A tuple of variables of an effect."""
        return f"({''.join(f'{letter}_{effect.name}_{i}, ' for i in range(len(values)))})"

    def has(self, stage: str) -> bool:
        """Whether any effect has a hook for this stage."""
        return any(stage in effect.hooks for effect in self.effects)

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
