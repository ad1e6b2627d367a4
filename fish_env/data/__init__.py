"""Measured data: runs of a real fish over time, and tables of its steady motion.

`load_dataset` reads a folder with a `dataset.yaml`, `write_dataset` writes one, `from_frames` makes
one of pandas frames, and `split_runs` divides the runs for fitting, selecting and the final check.
"""

from fish_env.data.importing.from_pandas import from_frames
from fish_env.data.reading import dataset_files, list_datasets, load_dataset
from fish_env.data.schema import CommandSteps, Dataset, Run, SteadyDataset
from fish_env.data.splits import Split, split_runs
from fish_env.data.units import unwrap_angle
from fish_env.data.vocabulary import CHANNELS, COMMANDS, OBSERVATIONS
from fish_env.data.writing import write_dataset

__all__ = [
    "CHANNELS",
    "COMMANDS",
    "OBSERVATIONS",
    "CommandSteps",
    "Dataset",
    "Run",
    "Split",
    "SteadyDataset",
    "dataset_files",
    "from_frames",
    "list_datasets",
    "load_dataset",
    "split_runs",
    "unwrap_angle",
    "write_dataset",
]
