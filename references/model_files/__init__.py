"""Model files (URDF, SDF, MJCF, USD): the body of a file by two readers, and the loaders of engines."""
