"""Gymnasium environments: ``RoboticFish3D-v0``, single, as a native batch, and for SB3."""
