"""Compare versions of a project or of an engine: every setting on every scene in each version, then times in turn."""
