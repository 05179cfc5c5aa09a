"""Environments of engines: installation, locks, and the method that integrates in one."""
