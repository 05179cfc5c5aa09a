"""One client and one protocol (PROTOCOL.md) for all work in other processes: engines, versions, model files, time limits."""
