"""What hidden effects show at their true sizes, for those who look for holes of the screen."""

from dataclasses import replace

import pytest

from fish_env.identification.series import SeriesProblem
from fish_env.inference.estimate.fit import fit
from scripts.hidden_effects_shown import table
from tests.identification.synthetic import PATHS, Setup, simulate

BIAS = 0.02


@pytest.fixture(scope="module")
def problem():
    """Runs whose gyro shows a roll rate that is too large."""
    dataset = simulate(Setup(runs=2))
    biased = [
        replace(run, channels={**run.channels, "p": run.channels["p"] + BIAS})
        for run in dataset.runs
    ]
    return SeriesProblem(replace(dataset, runs=tuple(biased)), paths=PATHS)


def rows(own):
    hidden = {"gyro_bias": {"p": BIAS}, "marker_offset": {"x": 0.0}, "outliers": {"share": 0.01}}
    lines = list(table(own, hidden))[2:]
    return {
        cells[0]: cells[1:]
        for cells in ([c.strip() for c in line.split("|")[1:-1]] for line in lines)
    }


def test_an_effect_that_acts_shows_at_its_size_and_is_silent_once_fitted(problem):
    shown = rows(fit(problem, rounds=1))
    assert float(shown["gyro_bias"][0]) < -20.0
    assert float(shown["gyro_bias"][1]) == pytest.approx(1.0, abs=0.2)
    assert float(shown["gyro_bias"][3]) < -20.0
    assert shown["marker_offset"][0] == "nothing"
    assert "outliers" not in shown  # the package has no effect of that name
    assert rows(fit(problem, ["gyro_bias"], rounds=1))["gyro_bias"][0] == "in the fit"
