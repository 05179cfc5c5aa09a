"""Which method and step, or which engine setting, reaches an error on a scene, and at what cost."""
