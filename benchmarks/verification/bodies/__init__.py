"""Bodies that engines load from model files."""
