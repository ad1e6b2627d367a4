"""What is said of one fish, as plain fields: what checks, priors and the mass balance read."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path

from fish_env.params.fields import aside, section
from fish_env.params.groups import Body, Inertia, Mass, Prior, Tail, Water, WeightBlock
from fish_env.params.provenance import UNSTATED, Posterior, Provenance


@dataclasses.dataclass(frozen=True)
class FishData:
    """The fields of a fish, unchecked; `FishParams` documents and checks them."""

    name: str
    water: Water = section(Water)
    mass: Mass = section(Mass)
    inertia: Inertia = section(Inertia)
    weight_block: WeightBlock = section(WeightBlock)
    tail: Tail = section(Tail)
    body: Body = section(Body)
    prior: Prior = aside(Prior)
    effects: Mapping[str, Mapping[str, float]] = dataclasses.field(default_factory=dict)
    provenance: Provenance = dataclasses.field(default_factory=lambda: Provenance(UNSTATED))
    posterior: Posterior | None = None
    source_file: Path | None = dataclasses.field(default=None, compare=False)
    trust_effects: bool = dataclasses.field(default=False, compare=False)
