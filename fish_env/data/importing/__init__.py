"""Logs of other tools made into datasets: ROS bags, MATLAB, Parquet, Excel, text, pandas.

`open_logs` reads tables as they are, `guess_mapping` guesses what their columns mean and says so,
`parse_plan` checks a mapping, `assemble` makes a dataset of both, `write_imported` writes it.
"""

from fish_env.data.importing.assemble import Imported, assemble
from fish_env.data.importing.from_pandas import from_frames
from fish_env.data.importing.guess import Guess, guess_mapping
from fish_env.data.importing.opening import open_logs
from fish_env.data.importing.plan import Plan, parse_plan, plan_text, read_content
from fish_env.data.importing.source import Source
from fish_env.data.importing.writing import MAPPING, write_imported, write_mapping

__all__ = [
    "MAPPING",
    "Guess",
    "Imported",
    "Plan",
    "Source",
    "assemble",
    "from_frames",
    "guess_mapping",
    "open_logs",
    "parse_plan",
    "plan_text",
    "read_content",
    "write_imported",
    "write_mapping",
]
