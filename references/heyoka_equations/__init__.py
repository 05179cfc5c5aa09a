"""Equations of motion as heyoka takes them: formulations of the motion, and torques of the potentials."""
