"""What once broke a reader is refused in one line, in little time."""

import os
import warnings

import numpy as np
import pytest
import yaml

from fish_env.comparison import compare
from fish_env.data import load_dataset
from fish_env.envs.batch import real_actions
from fish_env.envs.options import env_options
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError, ParameterError, ScheduleError
from fish_env.params import load_fish
from fish_env.simulator import Simulator, schedule
from fish_env.steady import steady_motion
from tests.command_line import run
from tests.fixtures.measured_data import DESCRIPTION, RUN, good_folder
from tests.fuzzing.found_inputs import (
    DESCRIPTIONS,
    EFFECTS,
    FISH,
    OPTIONS,
    PATHS,
    RUNS,
    TEXTS,
    UNITS,
    WRONG,
)
from tests.fuzzing.readers import READERS, fault


@pytest.fixture(autouse=True)
def _quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
@pytest.mark.parametrize("reader", READERS)
def test_every_reader_refuses_every_found_text(reader, text, tmp_path):
    read, suffix = READERS[reader]
    file = tmp_path / f"x{suffix}"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    message = fault(read, file)
    settings = reader in ("environment", "files of a fish")  # these read any keys of some kinds
    assert message is None if message is None and settings else message


@pytest.mark.parametrize("reader", READERS)
def test_every_reader_refuses_what_is_no_file(reader, tmp_path):
    read, suffix = READERS[reader]
    pipe, folder = tmp_path / f"pipe{suffix}", tmp_path / f"folder{suffix}"
    os.mkfifo(pipe)
    folder.mkdir()
    loop = tmp_path / f"loop{suffix}"
    loop.symlink_to(loop)
    for path in (pipe, folder, loop, *map(type(tmp_path), PATHS)):
        assert fault(read, path), path


@pytest.mark.parametrize(
    "command",
    [
        "info --fish {}", "plot forces --fish {}", "simulate {}", "compare {}", "diagnose {}",
        "compare msu-steady --fish {}", "replay {} --out page.html", "train {}", "sweep {}",
        "import {} --out out", "import x.csv --mapping {} --out out", "swim --agent {}",
        "evaluate --agent pid --suite {}", "evaluate --agent {}", "export {} --c x.h",
    ],
)  # fmt: skip
@pytest.mark.parametrize("device", [False, True])
def test_a_command_says_that_it_was_given_no_file(command, device, tmp_path, capsys, monkeypatch):
    """It does not say that there is no such file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.csv").write_text(RUN)
    file = tmp_path / ("pipe.csv" if "import" in command else "pipe.yaml")
    file.symlink_to("/dev/zero") if device else os.mkfifo(file)
    status, _, error = run(capsys, *command.format(file.name).split())
    assert status == 2
    assert error.count("\n") == 1
    assert "pipe or a device, not a file" in error


@pytest.mark.parametrize("change", FISH.values(), ids=FISH)
def test_a_fish_that_cannot_be_is_refused(change, tmp_path):
    file = tmp_path / "mine.yaml"
    base = "" if "base" in change else "base: zheng-2021-a\n"
    file.write_text(f"{base}name: mine\n{change}\n")
    assert "mine.yaml" in str(fault(load_fish, file))


@pytest.mark.parametrize("effects", EFFECTS.values(), ids=EFFECTS)
def test_effects_that_cannot_be_are_refused_by_their_file(effects, tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text(f"base: zheng-2021-a\nname: mine\neffects:\n  {effects}\n")
    assert "mine.yaml" in str(fault(Simulator, file))


@pytest.mark.parametrize(
    "effects",
    [
        {"servo_lag": {"time_constant": 1e-320}}, {"k" * 100_000: {}}, {"\ud800": {}},
        {"wave": {"k" * 100_000: 1.0}},
    ],
    ids=range(4),
)  # fmt: skip
def test_effects_that_cannot_be_are_refused_by_the_environment(effects):
    assert str(fault(env_options, effects=effects)).isprintable()


def test_a_long_chain_of_bases_is_refused(tmp_path):
    for i in range(200):
        (tmp_path / f"f{i}.yaml").write_text(f"base: f{i + 1}.yaml\nname: x\n")
    assert "bases" in str(fault(load_fish, tmp_path / "f0.yaml"))


@pytest.mark.parametrize("text", RUNS.values(), ids=RUNS)
def test_a_run_that_cannot_be_is_refused(text, tmp_path):
    message = str(fault(load_dataset, good_folder(tmp_path, run=text)))
    assert "r01.csv" in message


@pytest.mark.parametrize("change", DESCRIPTIONS.values(), ids=DESCRIPTIONS)
def test_a_description_that_cannot_be_is_refused(change, tmp_path):
    runs = [DESCRIPTION["runs"][0] | change]
    assert fault(load_dataset, good_folder(tmp_path, runs=runs))


@pytest.mark.parametrize(
    "id", ["a/b", "../../x", "/x", "..", "[/red]", "$\\frac{", "%d {0}", "con"]
)
def test_an_id_names_files_of_its_own_folder_only(id, tmp_path, capsys):
    """Slashes lead nowhere, and markup and formulas are shown as they are."""
    runs = [DESCRIPTION["runs"][0] | {"id": id}]
    data, out = good_folder(tmp_path / "data", runs=runs, name=id), tmp_path / "a" / "out"
    before = set(tmp_path.rglob("*"))
    status, shown, error = run(capsys, "compare", str(data), "--runs", "--out", str(out))
    assert (status, error) == (0, "")
    assert id in shown
    written = [file for file in set(tmp_path.rglob("*")) - before if file.is_file()]
    assert written
    assert {file.parent for file in written} == {out}


@pytest.mark.parametrize("ids", [["x" * 300], ["a/b", "a:b"]])
def test_ids_that_cannot_name_files_are_refused(ids, tmp_path):
    runs = [DESCRIPTION["runs"][0] | {"id": id, "file": f"{i}.csv"} for i, id in enumerate(ids)]
    message = str(fault(load_dataset, good_folder(tmp_path, runs=runs)))
    assert "id" in message
    assert "no such file" not in message


@pytest.mark.parametrize("unit", UNITS, ids=range(len(UNITS)))
def test_a_unit_is_not_worked_out(unit, tmp_path):
    channels = DESCRIPTION["channels"] | {"x": unit}
    message = str(fault(load_dataset, good_folder(tmp_path, channels=channels)))
    # Half a surrogate pair is no YAML for libyaml, and the line is named, not the channel.
    assert ("line 6:" if unit == "\ud800" and yaml.__with_libyaml__ else "x") in message


@pytest.mark.parametrize("option", OPTIONS)
def test_an_option_of_a_wrong_type_is_refused_by_name(option):
    fits = 0
    for value in WRONG:
        message = fault(env_options, **{option: value})
        fits += message is None
    assert fits <= 6, "most of these must be refused"


OF_BATCHES = ("num_envs", "threads", "max_episode_steps", "autoreset_mode", "render_count")


@pytest.mark.parametrize("option", ["render_mode", "render_size", *OF_BATCHES])
def test_an_option_of_rendering_or_of_a_batch_is_refused_by_name(option):
    count = {} if option == "num_envs" else {"num_envs": 2}
    for value in WRONG:
        if type(value) is int and 0 < value < 10 and option != "render_mode":
            continue  # these options are such numbers
        message = fault(RoboticFish3DVectorEnv, **count, **{option: value})
        assert message, value
        assert message.isprintable()
        assert option in message


def test_a_grouped_number_is_one_and_base_60_is_none(tmp_path):
    file = tmp_path / "f.yaml"
    file.write_text("name: x\nbase: zheng-2021-a\nwater: {density: 1_000}\n")
    assert load_fish(file).get("water.density") == 1000.0
    file.write_text("name: x\nbase: zheng-2021-a\nwater: {density: 16:40}\n")
    with pytest.raises(ParameterError, match="'16:40'"):
        load_fish(file)


@pytest.mark.parametrize("dt", [0.0, -1.0, 1e-12, 1e-300, float("nan"), float("inf"), "x", 1j])
def test_a_step_that_never_ends_is_refused(dt):
    with pytest.raises(ScheduleError, match="dt = "):
        Simulator("zheng-2021-a", dt=dt)
    with pytest.raises(ScheduleError, match="dt = "):
        compare(load_dataset("msu-steady"), dt=dt)


@pytest.mark.parametrize(
    ("duration", "rate"),
    [(1e12, 10.0), (1e5, 1e9), (1e300, 1e-300), (float("nan"), 1.0), (10**400, 1.0), ("1", 1.0)],
)
def test_a_duration_that_never_ends_is_refused(duration, rate):
    with pytest.raises(ScheduleError, match=r"duration|samples|steps"):
        Simulator("zheng-2021-a", dt=1e-4).run([{"t": 0.0}], duration, rate_hz=rate)


@pytest.mark.parametrize(
    "action",
    [
        np.zeros(5, complex), ["0"] * 5, np.array(["0"] * 5), np.zeros(5, object), None, 0.0,
        [[0.0], [0.0, 0.0]], np.zeros((5, 1)), {"a": 1}, np.zeros(5, "M8[s]"), [10**400] * 5,
    ],
    ids=range(11),
)  # fmt: skip
def test_an_action_that_is_no_five_numbers_is_refused(action):
    with pytest.raises(ConfigError, match=r"actions"):
        real_actions(action, (5,))


def test_a_randomisation_that_draws_an_impossible_fish_is_refused():
    with pytest.raises(ConfigError, match=r"mass\.total.*no fish is possible"):
        env_options(randomization={"mass.total": [0.05, 3.0]})


def test_a_beat_that_outlasts_the_wait_is_refused():
    with pytest.raises(ScheduleError, match=r"tail_frequency 1e-300 Hz.*at least"):
        steady_motion(load_fish("zheng-2021-a"), [[0.0, 0.3, 1e-300, 0.0, 0.0]])


@pytest.mark.parametrize("options", [5, "x", [1], {"k" * 100_000: 1}, {"goal": 5}], ids=range(5))
def test_reset_options_that_are_none_are_refused(options):
    env, batch = RoboticFish3DEnv(), RoboticFish3DVectorEnv(2)
    for one in (env, batch):
        assert "reset option" in str(fault(one.reset, seed=0, options=options))


@pytest.mark.parametrize(
    "rows",
    [
        None, 5, [5], "x", [{"t": "x"}], [{"t": 0, "tail_offset": "x"}], [{"t": 10**400}],
        [{"t": 0, 5: 1, "a": 1}], [{"t": 0, "tail_offset": [1]}], [{"t": 0, "k" * 100_000: 1}],
    ],
    ids=range(10),
)  # fmt: skip
def test_a_schedule_that_is_none_is_refused(rows):
    assert "schedule" in str(fault(schedule, rows))
