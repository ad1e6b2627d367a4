"""`robofish swim`: an agent swims one episode."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fish_env.commands.options import Json, TrustEffects


def register(app: typer.Typer) -> None:
    """Adds the command to `robofish`."""
    app.command()(swim)


def swim(
    agent: Annotated[str, typer.Option(help="pid, mppi, pretrained, or a policy file.")] = "pid",
    task: Annotated[str, typer.Option(help="hold, track, path or station.")] = "track",
    suite: Annotated[
        str, typer.Option(help="Conditions: calm, current, path/helix, ..., or a file.")
    ] = "calm",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the episode.")] = 4,
    path: Annotated[
        Path | None,
        typer.Option(help="CSV file with north, east, depth (m): a path to follow instead."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for pictures.")] = Path("out/swim"),
    video: Annotated[Path | None, typer.Option(help="Video to write, .mp4.")] = None,
    replay: Annotated[Path | None, typer.Option(help="HTML replay page to write.")] = None,
    json: Json = None,
    trust_effects: TrustEffects = False,
) -> None:
    """Let an agent swim one episode, and save pictures of it.

    On a path, line-of-sight guidance tells the agent where to steer.

    **Example:** `robofish swim --agent pid --task track --replay swim.html`
    """
    from fish_env.commands.numbers import console_for, write_json
    from robofish_agents.swimming import Wish, numbers_of, swim_and_show

    wish = Wish(agent, task, suite, seed, path, out, video, replay, trust_effects, json)
    console = console_for(json, replay)
    episode = swim_and_show(console, wish)
    if json is not None:
        write_json(console, json, numbers_of(wish, episode))
