"""Recorded motions: tables of times, attitudes and rates, and the verdict on them."""
