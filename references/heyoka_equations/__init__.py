"""Equations of motion as heyoka expressions."""
