"""Results for notebooks say what the commands say, show themselves and write files."""

import json

import pandas as pd
import pytest

import fish_env
from fish_env.analysis import CompareResult, DiagnoseResult
from fish_env.analysis.calls import as_dataset, progress_bar
from fish_env.data import load_dataset
from fish_env.errors import DatasetError
from fish_env.params import load_fish
from tests.command_line import run
from tests.diagnosis.report_cases import answer

FRAME = pd.DataFrame({"t": [0.0, 0.1, 0.2], "x": [0.0, 0.01, 0.02]})
CONSTANT = {
    "tail_offset": 0.0, "tail_amplitude": 0.3, "tail_frequency": 1.0, "block_displacement": 0.0,
    "block_angle": 0.0,
}  # fmt: skip
DESCRIBED = {"frame": "ned", "channels": {"x": "m"}, "constant_commands": CONSTANT}


@pytest.fixture(scope="module")
def compared() -> CompareResult:
    return fish_env.compare(load_dataset("msu-steady"), progress=False)


def test_compare_says_what_the_command_says(compared, tmp_path, capsys):
    status, out, _ = run(capsys, "compare", "msu-steady", "--json", "-")
    assert status == 0
    assert json.loads(out) == json.loads(compared.save(tmp_path / "numbers.json").read_text())


def test_a_comparison_shows_itself(compared, tmp_path):
    lines = repr(compared).splitlines()
    assert 2 <= len(lines) <= 16
    assert max(map(len, lines)) <= 80
    assert "msu-steady against msu-tail-fish" in compared._repr_html_()
    table = compared.to_dataframe()
    assert list(table["observation"]) == ["surge_speed", "sway_speed", "yaw_rate"]
    pictures = compared.plot(tmp_path)
    assert all(path.is_file() for path in pictures.paths)
    assert "data:image/png;base64," in pictures._repr_html_()


def test_a_name_is_no_markup(compared):
    class Named(CompareResult):
        def title(self) -> str:
            return "<script>alert(1)</script>"

    assert "<script>" not in Named(compared.comparison)._repr_html_()


def test_a_diagnosis_shows_itself_and_writes(tmp_path):
    folder = tmp_path / "kept"
    (folder / "figures").mkdir(parents=True)
    (folder / "figures" / "a.svg").write_text("<svg/>")
    (folder / "report.html").write_text("report")
    found = DiagnoseResult(answer(), folder)
    assert found.verdict in found.title()
    table = found.to_dataframe()
    first = table[table["explanation"] == 0].iloc[0]
    assert first["low"] <= first["estimate"] <= first["high"]
    assert found.fish is None
    assert "svg+xml" in found.plot()._repr_html_()
    assert found.save(tmp_path / "out").read_text() == "report"
    assert (tmp_path / "out" / "figures" / "a.svg").is_file()
    assert len(DiagnoseResult(answer("no_misfit", causes=[], alternatives=[]), folder).sentences())


def test_frames_become_a_dataset_and_must_say_what_they_are():
    dataset = as_dataset(FRAME, "zheng-2021-a", DESCRIBED)
    assert dataset.fish == "zheng-2021-a"
    assert as_dataset(dataset, None, None) is dataset
    with pytest.raises(DatasetError, match="name no fish"):
        as_dataset(FRAME, None, DESCRIBED)
    with pytest.raises(DatasetError, match="described="):
        as_dataset(FRAME, "zheng-2021-a", None)
    for data in ([FRAME], 3, None):
        with pytest.raises(DatasetError, match=r"data of type .* frames by run"):
            as_dataset(data, "zheng-2021-a", DESCRIBED)
    with pytest.raises(DatasetError, match="run1: of type list, which is not a pandas frame"):
        as_dataset({"run1": [FRAME]}, "zheng-2021-a", DESCRIBED)
    assert as_dataset(FRAME, load_fish("zheng-2021-b"), DESCRIBED)


def test_a_progress_bar_is_told_every_step(capsys):
    for wanted in (True, False):
        with progress_bar(wanted, "working", 2) as tell:
            tell("one")
            tell("two")
    assert capsys.readouterr().out == ""


@pytest.mark.slow
def test_a_notebook_without_widgets_shows_the_progress_bar():
    nbclient, nbformat = (pytest.importorskip(name) for name in ("nbclient", "nbformat"))
    pytest.importorskip("ipykernel")
    code = (
        "import sys\nsys.modules['ipywidgets'] = None\n"
        "from fish_env.analysis.calls import progress_bar\n"
        "with progress_bar(True, 'working', 2) as tell:\n    tell('one')\n    tell('two')\n"
    )
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code)])
    nbclient.NotebookClient(notebook, timeout=120).execute()
    shown = str(notebook.cells[0].outputs)
    assert "working" in shown
    assert "Warning" not in shown


def test_the_calls_are_loaded_when_asked_for():
    assert fish_env.compare is not None
    assert {"compare", "diagnose", "fit"} <= set(fish_env.__all__)
    with pytest.raises(AttributeError, match="nothing"):
        fish_env.nothing  # noqa: B018


def test_a_fit_is_asked_for_as_the_command_does():
    with pytest.raises(DatasetError, match="objective"):
        fish_env.fit("msu-steady", objective="none", progress=False)
