"""One engine over its versions: what each does with the same scenes and steps, and which conclusions changed in between."""
