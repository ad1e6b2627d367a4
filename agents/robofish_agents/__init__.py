"""Controllers, training and evaluation on top of the environment; `fish_env` never imports it."""
