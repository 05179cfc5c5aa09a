"""Environments of engines that are not installed beside us: how they are made, kept whole, and asked to integrate."""
