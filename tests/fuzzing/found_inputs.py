"""Inputs that once gave a traceback, a hang or a full memory; each is tried on every reader."""

from __future__ import annotations

ALIASES = "a0: &a0 {x: 1, y: 2}\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 12)
)
MAPPINGS = "a0: &a0 {x: 1, y: 2}\n" + "".join(
    f"a{i}: &a{i} {{b: *a{i - 1}, c: *a{i - 1}, d: *a{i - 1}}}\n" for i in range(1, 25)
)
MERGES = "a0: &a0 {x: 1, y: 2}\n" + "".join(
    f"a{i}: &a{i} {{<<: [*a{i - 1}, *a{i - 1}, *a{i - 1}], z{i}: 1}}\n" for i in range(1, 25)
)

LONG = "k" * 100_000

TEXTS: dict[str, str] = {
    "alias bomb of lists": ALIASES,
    "alias bomb of mappings": MAPPINGS,
    "alias bomb of merges": MERGES,
    "an alias in itself": "a: &a [*a]",
    "a merge of itself": "a: &a {<<: *a}",
    "a merge of a number": "<<: 5",
    "deep lists": "[" * 100_000,
    "deep mappings": "{a: " * 50_000,
    "deep blocks": "".join(" " * i + "a:\n" for i in range(400)),
    "deep JSON": '{"a": ' * 50_000,
    "an integer of 5,000 digits": "name: " + "9" * 5000,
    "a key of 5,000 digits": "9" * 5000 + ": 1",
    "an integer beyond a float": "mass: {total: " + "9" * 400 + "}",
    "JSON with 5,000 digits": '{"duration_s": ' + "9" * 5000 + "}",
    "NUL": 'name: "a\\0b"',
    "NUL itself": "name: a\0b",
    "NUL in a path": 'name: x\nbase: "a\\0b"',
    "a surrogate": 'name: "\\ud800"',
    "a surrogate in a path": 'name: x\nbase: "\\ud800"',
    "a code point beyond Unicode": 'name: "\\UFFFFFFFF"',
    "a home of nobody": "name: x\nbase: ~nouser/x.yaml",
    "a wrong tag": "name: !!int x",
    "an empty tag": 'name: !!int ""',
    "a wrong date": "name: 2020-99-99",
    "a tagged date": "name: !!timestamp x",
    "a tagged truth": "name: !!bool x",
    "a Python tag": "name: !!python/object/apply:os.getcwd []",
    "a set": "name: !!set {a, b}",
    "a list as a key": "? [a]\n: b",
    "a key twice": "a: 1\na: 2",
    "two documents": "a: 1\n---\nb: 2",
    "a number in base 60": "mass: {total: 12:30}",
    "nothing": "",
    "null": "~",
    "a list": "[1]",
    "JSON of NaN": "NaN",
    "a wide CSV": ",".join(f"c{i}" for i in range(20_000)) + "\n" + ",".join("0" * 20_000),
    "an open quotation mark": 't,x\n0,"1\n',
    "a key of 100,000 letters": f"? {LONG}\n: 1",
    "a format of 100,000 letters": f"format: {LONG}",
    "an origin of 100,000 letters": (
        f"name: x\nbase: zheng-2021-a\nprovenance:\n  ? {LONG}\n  : {{status: a, source: b}}"
    ),
    "JSON with a key of 100,000 letters": (
        f'{{"fish": "zheng-2021-a", "duration_s": 1, "schedule": [], "{LONG}": 1}}'
    ),
    "JSON with a command of 100,000 letters": (
        f'{{"fish": "zheng-2021-a", "duration_s": 1, "schedule": [{{"t": 0, "{LONG}": 1}}]}}'
    ),
    "JSON with an effect of 100,000 letters": (
        f'{{"fish": "zheng-2021-a", "duration_s": 1, "schedule": [{{"t": 0}}], '
        f'"effects": {{"{LONG}": {{"a": "x"}}}}}}'
    ),
    "JSON with a key twice": (
        '{"fish": "zheng-2021-a", "duration_s": 1, "duration_s": 2, "schedule": [{"t": 0}]}'
    ),
    "two megabytes": "a: 1\n# " + "x" * 2_000_000,
}

PATHS = (
    "~nouser/x.yaml", "a\0b.yaml", "\ud800.yaml", "x" * 300 + ".yaml", "", ".", "/dev/zero",
)  # fmt: skip

FISH: dict[str, str] = {
    "covariance is a number": "posterior: {names: [], mean: [], covariance: 5, validity: {}}",
    "covariance of a number": "posterior: {names: [mass.total], mean: [1], covariance: [5]}",
    "covariance of words": (
        "posterior: {names: [mass.total], mean: [1], covariance: [[a]], validity: {}}"
    ),
    "a name of 100,000 letters": (
        f"posterior: {{names: [{LONG}], mean: [1], covariance: [[1]], validity: {{}}}}"
    ),
    "names are mappings": (
        "posterior: {names: [{a: b}], mean: [1], covariance: [[1]], validity: {}}"
    ),
    "posterior is a number": "posterior: 5",
    "status is a list": "provenance: {default: {status: [a], source: 5}}",
    "status is a mapping": "provenance: {default: {status: {a: 1}, source: x}}",
    "provenance is a number": "provenance: {default: 5}",
    "an effect is a number": "effects: {5: {a: 1}}",
    "an effect outside": 'effects: {"../../x": 5}',
    "effects are a list": "effects: [a]",
    "a table is a device": "tail: {drag: {table: /dev/zero}}",
    "a table with NUL": 'tail: {drag: {table: "a\\0b.csv"}}',
    "a table of nobody": "tail: {drag: {table: ~nouser/x.csv}}",
    "a section is a number": "body: {plane_xy: 5}",
    "a mass in base 60": "mass: {total: 12:30}",
    "a mass beyond a float": "mass: {total: 1e999}",
    "a mass is true": "mass: {total: true}",
    "a base is a date": "base: 2020-01-01",
}
"""Changes of a fish file, each of which must be refused."""

EFFECTS: dict[str, str] = {
    "a value below all": "servo_lag: {time_constant: -1}",
    "a denormal time constant": "servo_lag: {time_constant: 1e-320}",
    "a time constant of a nanosecond": "wake_memory: {time_constant: 1e-9}",
    "an unknown effect": "no_such: {a: 1}",
    "a name that no file can have": f"? {'k' * 100_000}\n  : {{a: 1}}",
    "a parameter's name of 100,000 letters": f"servo_lag:\n    ? {'k' * 100_000}\n    : 1",
}
"""Effects of a fish file, each of which must be refused when the fish is to swim."""

COMMAND_CELLS = ",0,.5,0,0,0,1,0,0\n"
HEADER = "t,x,z,yaw,tail_offset,tail_amplitude,tail_frequency,block_displacement,block_angle\n"
RUNS: dict[str, str] = {
    "times of 1e300": HEADER + "0" + COMMAND_CELLS + "1e300" + COMMAND_CELLS,
    "times from -1e300": HEADER + "-1e300" + COMMAND_CELLS + "1e300" + COMMAND_CELLS,
    "a stamp beyond any date": HEADER + "1e17" + COMMAND_CELLS + "1.1e17" + COMMAND_CELLS,
    "a stamp of 5,000 digits": HEADER + "9" * 5000 + COMMAND_CELLS + "1" + COMMAND_CELLS,
    "a grouped number": HEADER + "0,1_0,.5,0,0,0,1,0,0\n1" + COMMAND_CELLS,
    "a superscript": HEADER + "0" + COMMAND_CELLS + "²" + COMMAND_CELLS,
    "NUL in a cell": HEADER + "0" + COMMAND_CELLS + "1\0" + COMMAND_CELLS,
    "positions of 1e300": HEADER + "0,1e300,.5,0,0,0,1,0,0\n1,-1e300,.5,0,0,0,1,0,0\n",
    "only a header": HEADER,
    "too many columns": ",".join(["t", *(f"c{i}" for i in range(20_000))]) + "\n",
}
"""Content of a run's file, each of which must be refused."""

DESCRIPTIONS: dict[str, dict[str, object]] = {
    "an id with an escape": {"id": "a\x1b[31m"},
    "a file with NUL": {"file": "a\0b"},
    "a file of nobody": {"file": "~nouser/x"},
    "a file that is a device": {"file": "/dev/zero"},
    "a phase in base 60": {"tail_phase": "1:30"},
}
"""Changes of a run's entry in dataset.yaml, each of which must be refused."""

UNITS = ("9**9**9**9", "10**10**10 m", "m" * 5000, "(" * 3000 + "m" + ")" * 3000, "()", "\ud800")

WRONG: tuple[object, ...] = (
    True, 5, -1, 1e308, float("nan"), float("inf"), 10**400, 10**5000, 1j, "x", "", "\0", "\ud800",
    b"x", [], [1], [[1], [2, 3]], {"a": 1}, {"a": "b"}, {5: 5}, {"servo_lag": 5},
    {"servo_lag": {"time_constant": "x"}}, {"servo_lag": {"time_constant": None}},
    {"servo_lag": {5: 1}}, {"mass.total": 5}, {"mass.total": {"relative": 1e308}},
    {"mass.total": [2, 1]}, {"mass.total": {"sd": 10**400}}, {"depth": "x"},
    {"rates": {"control": 1e-308}}, {"rates": 5}, {"tank": {"depth": -1}}, object(), set(),
)  # fmt: skip
"""Values of environment options that none of them takes, or only one."""

OPTIONS = (
    "task", "fish", "config", "control_hz", "physics_hz", "cruise_speed", "effects", "current",
    "wave", "observation_noise", "observation_delay_s", "action_delay_s", "randomization",
    "trust_effects",
)  # fmt: skip
