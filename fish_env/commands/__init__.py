"""What the commands of `robofish` do, one module each; :mod:`fish_env.cli` only parses words."""
