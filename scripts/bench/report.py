"""Turns measurements into a record (JSON), a table (Markdown) and a judgement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from scripts.bench.harness import Measured, Missing, Spread, ratio


@dataclass(frozen=True)
class Claim:
    """A ratio that this project promises.

    Attributes:
        text: what is compared.
        ours: name of our contender, with its number of threads.
        theirs: start of the peer's name, with its number of threads; the fastest match counts.
        target: least ratio.
    """

    text: str
    ours: tuple[str, int]
    theirs: tuple[str, int]
    target: float


CLAIMS = (
    Claim(
        "single environment against Swimmer-v5",
        ("RoboticFish3D-v0, gym.make", 1),
        ("Gymnasium Swimmer-v5", 1),
        4.0,
    ),
    Claim(
        "1024 environments on two cores against the best of EnvPool on two threads",
        ("RoboticFish3D-v0, gym.make_vec 1024", 2),
        ("EnvPool", 2),
        6.0,
    ),
)


@dataclass(frozen=True)
class Verdict:
    """How a claim came out; no spread where a side of it was not measured."""

    claim: Claim
    against: str
    spread: Spread | None

    @property
    def word(self) -> str:
        """met, missed or not measured."""
        if self.spread is None:
            return "not measured"
        return "met" if self.spread.median >= self.claim.target else "missed"


def named(measured: Sequence[Measured], name: str, threads: int) -> Measured | None:
    """The contender of exactly this name and number of threads."""
    found = (m for m in measured if (m.contender.name, m.contender.threads) == (name, threads))
    return next(found, None)


def best(measured: Sequence[Measured], start: str, threads: int) -> Measured | None:
    """The fastest contender whose name begins so, with this number of threads."""
    found = [
        m for m in measured
        if m.contender.name.startswith(start) and m.contender.threads == threads
    ]  # fmt: skip
    return max(found, key=lambda m: m.median, default=None)


def judge(measured: Sequence[Measured], claims: Sequence[Claim] = CLAIMS) -> list[Verdict]:
    """Compare our contender with the best of the peers in each claim."""
    verdicts = []
    for claim in claims:
        ours, theirs = named(measured, *claim.ours), best(measured, *claim.theirs)
        complete = ours is not None and theirs is not None
        spread = ratio(ours, theirs) if complete else None
        against = theirs.contender.name if theirs is not None else claim.theirs[0]
        verdicts.append(Verdict(claim, against, spread))
    return verdicts


def record(
    measured: Sequence[Measured], missing: Sequence[Missing], facts: dict[str, object]
) -> dict[str, object]:
    """Everything as plain numbers and text, for JSON."""
    rows = []
    for m in measured:
        c = m.contender
        rate = Spread.of(m.rates)
        rows.append(
            {
                "name": c.name,
                "environment": c.environment,
                "envs": c.envs,
                "threads": c.threads,
                "control_period_s": c.period_s,
                "substeps": c.substeps,
                "integrator": c.integrator,
                "env_steps_per_s": asdict(rate),
                "physics_substeps_per_s": rate.median * c.substeps,
                "simulated_s_per_s": rate.median * c.period_s,
                "rounds_env_steps_per_s": m.rates.tolist(),
            }
        )
    verdicts = [
        {
            "claim": v.claim.text,
            "against": v.against,
            "target": v.claim.target,
            "ratio": asdict(v.spread) if v.spread else None,
            "verdict": v.word,
        }
        for v in judge(measured)
    ]
    return {
        **facts,
        "measured": rows,
        "missing": [asdict(m) for m in missing],
        "verdicts": verdicts,
    }


def short(number: float) -> str:
    """Three digits and a unit: 532, 25.6k, 1.31M."""
    for limit, unit in ((1e6, "M"), (1e3, "k")):
        if number >= limit:
            return f"{number / limit:.3g}{unit}"
    return f"{number:.3g}"


def markdown(
    measured: Sequence[Measured], missing: Sequence[Missing], facts: dict[str, object]
) -> str:
    """The same as a page with a table."""
    lines = [
        f"# Speed, {facts['date']}",
        "",
        *(f"- {name}: {_plain(value)}" for name, value in facts.items() if name != "date"),
        "",
        "All in one process, in turn; the median of the rounds, in brackets the quartiles.",
        "",
        "| contender | threads | env steps/s | physics steps/s | simulated s per s | a step is |",
        "| --- | --: | --: | --: | --: | --- |",
        *(_row(m) for m in measured),
        *(f"| {m.name} | | missing: {' '.join(m.reason.split())} | | | |" for m in missing),
        "",
        "## Targets",
        "",
        *(_sentence(v) for v in judge(measured)),
    ]
    return "\n".join(lines) + "\n"


def _plain(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {_plain(part)}" for name, part in value.items())
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _row(m: Measured) -> str:
    c, rate = m.contender, Spread.of(m.rates)
    step = f"{c.period_s:g} s, {c.substeps} x {c.integrator}"
    return (
        f"| {c.name} | {c.threads} | {short(rate.median)} ({short(rate.low)} to "
        f"{short(rate.high)}) | {short(rate.median * c.substeps)} | "
        f"{short(rate.median * c.period_s)} | {step} |"
    )


def _sentence(v: Verdict) -> str:
    head = f"- {v.claim.text} ({v.against}): at least {v.claim.target:g} times. "
    if v.spread is None:
        return head + "**Not measured**."
    s = v.spread
    return head + f"**{v.word.capitalize()}**: {s.median:.2f} ({s.low:.2f} to {s.high:.2f})."
