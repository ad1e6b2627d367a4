"""The pictures of `robofish plot` show what the simulator computes, with units on every axis."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from rich.console import Console

from fish_env import Simulator, load_fish
from fish_env.commands.plot import FORMATS, KINDS, plot_fish
from fish_env.errors import ConfigError
from fish_env.plotting import forces, motions, polar, trim
from fish_env.plotting.style import save
from fish_env.steady import steady_motion

FISH = "zheng-2021-b"
MODULES = {"motions": motions, "polar": polar, "forces": forces, "trim": trim}
DEG = 180.0 / np.pi
UNIT = re.compile(r" \((m|cm|m/s|cm/s, down|cm/s|s|deg|deg/s|N|mN m)\)$")


def drawn(kind: str, folder: Path) -> Figure:
    """The figure of a kind, which is also saved."""
    kept: list[Figure] = []

    def keep(figure: Figure, *arguments) -> Path:
        kept.append(figure)
        return save(figure, *arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MODULES[kind], "save", keep)
        KINDS[kind](load_fish(FISH), folder, ("png",))
    return kept[0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("pictures")


@pytest.fixture(scope="module")
def figures(folder) -> dict[str, Figure]:
    return {kind: drawn(kind, folder) for kind in KINDS}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_writes_its_picture(kind, figures, folder):
    assert figures[kind].axes
    assert (folder / f"{kind}.png").read_bytes().startswith(b"\x89PNG")


def unlabelled(figure: Figure) -> list[str]:
    """Labels without a unit, of axes that show numbers of their own and of shared ones."""
    labels = []
    for ax in figure.axes:
        spec = ax.get_subplotspec()
        assert spec is not None
        if spec.is_last_row() or not ax.get_shared_x_axes().get_siblings(ax)[1:]:
            labels.append(ax.get_xlabel())
        if spec.is_first_col() or not ax.get_shared_y_axes().get_siblings(ax)[1:]:
            labels.append(ax.get_ylabel())
    return [label for label in labels if label and not UNIT.search(label)]


@pytest.mark.parametrize("kind", KINDS)
def test_every_label_has_a_unit(kind, figures):
    first = [ax for ax in figures[kind].axes if ax.get_subplotspec().is_first_col()]
    last = [ax for ax in figures[kind].axes if ax.get_subplotspec().is_last_row()]
    assert all(ax.get_ylabel() for ax in first)
    assert all(ax.get_xlabel() for ax in last)
    assert unlabelled(figures[kind]) == []


def test_the_check_of_labels_notices_a_missing_unit():
    figure = Figure()
    figure.subplots().set(xlabel="time (s)", ylabel="speed")
    assert unlabelled(figure) == ["speed"]


def lines(ax) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Data of the labelled lines of a panel."""
    return {line.get_label(): (line.get_xdata(), line.get_ydata()) for line in ax.get_lines()}


def test_the_motions_are_those_of_the_simulator(figures):
    """The third column is gliding: path, depth, speed, attitude, yaw rate from above."""
    amplitude = np.radians(20.0)
    command = {"tail_amplitude": amplitude, "tail_frequency": 2.0, "block_displacement": -0.008}
    swim = Simulator(FISH).run([{"t": 0.0, **command}], 40.0, rate_hz=40.0)
    path, depth, speed, attitude, turning = figures["motions"].axes[2::4]
    np.testing.assert_array_equal(path.get_lines()[0].get_xdata(), swim["y"])
    np.testing.assert_array_equal(path.get_lines()[0].get_ydata(), swim["x"])
    np.testing.assert_array_equal(depth.get_lines()[0].get_ydata(), swim["z"])
    for ax, values in ((speed, swim["u"]), (turning, DEG * swim["r"])):
        raw, mean = ax.get_lines()
        np.testing.assert_array_equal(raw.get_ydata(), values)
        np.testing.assert_allclose(mean.get_ydata()[-1], values[-20:].mean(), rtol=1e-9, atol=1e-9)
        assert mean.get_xdata()[-1] == pytest.approx(swim.time_s[-20:].mean())
    np.testing.assert_array_equal(attitude.get_lines()[2].get_ydata(), DEG * swim["pitch"])


def test_the_four_motions_are_four_motions(figures):
    speeds = [ax.get_lines()[1].get_ydata()[-1] for ax in figures["motions"].axes[8:12]]
    turns = [abs(ax.get_lines()[1].get_ydata()[-1]) for ax in figures["motions"].axes[16:20]]
    depths = [ax.get_lines()[0].get_ydata()[-1] for ax in figures["motions"].axes[4:8]]
    assert min(speeds) > 0.05
    assert max(turns[0], turns[2]) < 0.1 < 5.0 < min(turns[1], turns[3])
    assert min(depths[2:]) > 0.3 > max(depths[:2])


def test_the_polar_diagram_holds_steady_motion(figures):
    fast, over_amplitude, turning, _ = figures["polar"].axes
    offset = np.radians(-30.0)
    motion = steady_motion(load_fish(FISH), [[offset, np.radians(25.0), 2.5, 0, 0]])
    angles, speeds = lines(fast)["2.5 Hz"]
    at = int(np.argmin(np.abs(angles - offset)))
    assert speeds[at] == pytest.approx(100.0 * motion["horizontal_speed"][0], rel=2e-3)
    rates = lines(turning)["2.5 Hz"][1]
    assert rates[at] == pytest.approx(DEG * motion["yaw_rate"][0], rel=2e-3)
    assert list(lines(over_amplitude)) == ["10 deg", "20 deg", "30 deg", "40 deg"]
    same = lines(fast)["2 Hz"][1], lines(over_amplitude)["20 deg"][1]
    assert np.all(same[0] > same[1])


def test_the_forces_are_those_of_the_model(figures):
    simulator = Simulator(FISH)
    command = (0.0, np.radians(20.0), 2.0, 0.0, 0.0)
    row = {"t": 0.0, "tail_amplitude": command[1], "tail_frequency": 2.0}
    swim = simulator.run([row], sample_times_s=[0.0, 30.0, 30.125, 30.5])
    terms = simulator.wrench_by_term(swim.states[2], command, 30.125)  # a quarter of a beat
    surge, yaw = figures["forces"].axes[0], figures["forces"].axes[5]
    drawn_surge, drawn_yaw = lines(surge), lines(yaw)
    phase = drawn_surge["tail lift"][0]
    quarter = int(np.argmin(np.abs(phase - 90.0)))
    assert phase[[0, -1]] == pytest.approx([0.0, 360.0])
    at = {name: values[quarter] for name, (_, values) in drawn_surge.items()}
    assert at["tail lift"] == pytest.approx(terms["tail_lift"][0], rel=1e-6)
    assert at["body drag"] == pytest.approx(terms["xz_drag"][0] + terms["xy_drag"][0], rel=1e-6)
    assert at["sum"] == pytest.approx(sum(values[0] for values in terms.values()), rel=1e-3)
    total = sum(values[5] for values in terms.values())
    assert drawn_yaw["sum"][1][quarter] == pytest.approx(1000.0 * total, rel=1e-3)


def test_no_term_is_left_out_of_the_forces_not_even_an_effect():
    simulator = Simulator(FISH, effects={"linear_drag": {"surge": 0.5}})
    state = [0, 0, 0, 1, 0, 0, 0, 0.2, 0.01, 0, 0, 0.1, 0.2]
    wrenches = simulator.wrench_by_term(state, (0.0, 0.3, 2.0, 0.0, 0.0))
    terms = {name: values[None] for name, values in wrenches.items()}
    grouped = forces.grouped(terms)
    np.testing.assert_allclose(sum(grouped.values()), sum(terms.values()), rtol=1e-12)
    assert "linear drag" in grouped


def test_the_trim_curves_hold_rest_and_steady_motion(figures):
    pitch, _, _, roll, depth, _ = figures["trim"].axes
    across, angles = lines(pitch)["2 Hz"]
    at = 1
    amplitude = np.radians(20.0)
    motion = steady_motion(load_fish(FISH), [[0.0, amplitude, 2.0, 0.01 * across[at], 0.0]])
    assert angles[at] == pytest.approx(DEG * motion["pitch"][0], rel=2e-3)
    sinking = lines(depth)["2 Hz"][1][at]
    assert sinking == pytest.approx(100.0 * motion["vertical_speed"][0], rel=5e-3)
    still = lines(roll)["tail still"]
    hanging = steady_motion(load_fish("zheng-2021-a"), [[0, 0, 0, 0, np.radians(still[0][-1])]])
    assert still[1][-1] == pytest.approx(DEG * hanging["roll"][0], abs=0.1)


@pytest.mark.parametrize("ending", FORMATS)
def test_a_picture_is_written_in_every_format(ending, tmp_path):
    written = plot_fish(Console(quiet=True), "forces", FISH, tmp_path, [ending])
    assert written == [tmp_path / f"forces.{ending}"]
    head = written[0].read_bytes()[:500]
    assert {"png": b"\x89PNG", "svg": b"<svg", "pdf": b"%PDF"}[ending] in head


def test_all_draws_every_kind(tmp_path, monkeypatch):
    asked = []
    for kind in KINDS:
        monkeypatch.setitem(
            KINDS, kind, lambda fish, folder, formats: asked.append(formats) or folder
        )
    plot_fish(Console(quiet=True), "all", FISH, tmp_path, ["png", "svg"])
    assert asked == [("png", "svg")] * 4


@pytest.mark.parametrize(("kind", "ending"), [("wings", "png"), ("trim", "bmp")])
def test_an_unknown_kind_or_format_is_refused(kind, ending, tmp_path):
    with pytest.raises(ConfigError, match=f"'{kind if kind == 'wings' else ending}'.*choose"):
        plot_fish(Console(quiet=True), kind, FISH, tmp_path, [ending])
