"""What each hidden effect shows at its true size, beside what the screen sees of it.

    python scripts/hidden_effects_shown.py realistic 34085

The case is made and diagnosed, and then each hidden effect is simulated at its true values beside
the refitted baseline and beside the accepted explanation. An effect that shows there and not in the
screen is one that the screen misses; one that shows nowhere is hidden by the rest, or too small.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from scripts.one_thread import ONE_THREAD  # noqa: E402

os.environ.update(ONE_THREAD)

import numpy as np  # noqa: E402
from threadpoolctl import threadpool_limits  # noqa: E402

from fish_env.diagnosis.pipeline import diagnose_runs  # noqa: E402
from fish_env.inference.changes import residual_changes  # noqa: E402
from fish_env.inference.estimate.fit import Fit  # noqa: E402
from fish_env.inference.hypotheses import EffectName, name_of  # noqa: E402
from fish_env.inference.probes import Cause, causes_of  # noqa: E402
from fish_env.inference.projection import Projector, Signal  # noqa: E402
from fish_env.inference.screening import screen  # noqa: E402
from scripts.hidden_runs import hidden_runs  # noqa: E402
from tests.hidden.realistic.cases import make_case  # noqa: E402
from tests.hidden.realistic.plans import TIERS  # noqa: E402
from tests.hidden.realistic.truth import RealTruth  # noqa: E402

Values = Mapping[str, Mapping[str, float]]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tier", choices=TIERS)
    parser.add_argument("seed", type=int)
    options = parser.parse_args(arguments)
    truth, dataset = hidden_runs(make_case, options.tier, options.seed)
    found = diagnose_runs(dataset, seed=options.seed)
    attribution = found.attribution
    names = ", ".join(map(name_of, attribution.accepted.causes))
    print(f"{found.verdict.name}: {names or 'nothing'}")
    with threadpool_limits(1, "blas"):
        for title, explanation in (
            ("the refitted baseline", attribution.baseline),
            ("the accepted explanation", attribution.accepted),
        ):
            print(f"\nbeside {title}, -2 log evidence {explanation.score:.0f}\n")
            print("\n".join(table(explanation.fit, hidden_values(truth))))


def hidden_values(truth: RealTruth) -> dict[str, dict[str, float]]:
    """Parameters of hidden effects in the package's names."""
    found = {**truth.dirt, **truth.small, **truth.suspect, **truth.main}
    if late := found.get("sensor_delay"):
        found["sensor_delay"] = {
            "delay": late["imu"],
            "camera_later": late["camera"] - late["imu"],
            "depth_later": late["depth"] - late["imu"],
        }
    return found


def table(fit: Fit, hidden: Values) -> Iterator[str]:
    """Lines of a Markdown table: a row for each hidden effect that the package has.

    Args:
        fit: what they are shown beside.
        hidden: parameters by effect.
    """
    projector = Projector(fit)
    seen = screen(fit, causes_of(fit.problem), np.random.default_rng(0)).by_effect()
    yield "| effect | log p, true size | multiple | absorbed | log p, screen | its settings |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for name, values in hidden.items():
        if name not in fit.problem.known:
            continue
        if name in fit.effects:
            yield f"| {name} | in the fit | | | | |"
            continue
        best = seen.get(EffectName(name))
        settings = best.cause.probes[best.probe] if best else ""
        shown = _shown(at_values(fit, projector, name, values))
        yield f"| {name} | {shown} | {_log_p(best)} | {settings} |"


def at_values(
    fit: Fit, projector: Projector, name: str, values: Mapping[str, float]
) -> Signal | None:
    """The test of an effect at these values of its parameters; others are neutral."""
    neutral = fit.problem.known[name].neutral
    probe = {**neutral, **{key: value for key, value in values.items() if key in neutral}}
    columns = residual_changes(fit, [(name, probe)])
    return projector.signal(Cause(EffectName(name), ((probe,),)), 0, columns)


def _shown(signal: Signal | None) -> str:
    if signal is None:
        return "nothing | | "
    return f"{signal.log_p:.1f} | {signal.size[0]:.2f} | {signal.absorbed_share:.0%}"


def _log_p(signal: Signal | None) -> str:
    return "" if signal is None else f"{signal.log_p:.1f}"


if __name__ == "__main__":
    main()
