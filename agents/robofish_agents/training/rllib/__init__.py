"""Ray RLlib as the library that learns, on its new API stack."""
