"""Training with Ray RLlib, on its new API stack."""
