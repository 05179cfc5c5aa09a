"""Mistakes of simulators and their files, each once."""
