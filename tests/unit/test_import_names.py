"""The package works where another distribution has installed a package called ``agents``."""

import os
import subprocess
import sys

import pytest


@pytest.mark.slow
def test_commands_work_beside_another_package_called_agents(tmp_path):
    other = tmp_path / "agents"
    other.mkdir()
    (other / "__init__.py").write_text("OTHER = True\n", encoding="utf-8")
    script = (
        "import agents, sys; from fish_env.cli import main; "
        "assert agents.OTHER; sys.argv = ['robofish', 'train', '--help']; main()"
    )
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "PYTHONPATH": path}, cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Train" in done.stdout
