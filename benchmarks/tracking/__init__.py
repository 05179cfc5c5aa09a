"""Compare versions of an engine on the same scenes and steps, and find the conclusions that changed."""
