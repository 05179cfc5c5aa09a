"""Motions that other programs recorded, compared with the exact motion, and what explains the difference."""
