"""Engines and exact solutions behind the same protocol, one file each, imported only when asked for."""
