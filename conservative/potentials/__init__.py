"""Potentials: energy, gradient and finite derivative as functions of attitude."""
