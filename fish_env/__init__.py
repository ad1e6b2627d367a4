"""Simulation, Gymnasium environment and identification of a tail-driven robotic fish."""
