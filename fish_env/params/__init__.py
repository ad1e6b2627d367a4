"""Parameters of a fish: schema, files, priors, and packing into the record the kernels read."""

from fish_env.params.io import (
    as_fish,
    config_root,
    fish_files,
    fish_outputs,
    list_fish,
    load_fish,
    save_fish,
)
from fish_env.params.prior import TRIM_SD_KG
from fish_env.params.provenance import Origin, Posterior, Provenance, Status
from fish_env.params.schema import FishParams, ParameterInfo
from fish_env.params.tables import CoefficientTable

__all__ = [
    "TRIM_SD_KG",
    "CoefficientTable",
    "FishParams",
    "Origin",
    "ParameterInfo",
    "Posterior",
    "Provenance",
    "Status",
    "as_fish",
    "config_root",
    "fish_files",
    "fish_outputs",
    "list_fish",
    "load_fish",
    "save_fish",
]
