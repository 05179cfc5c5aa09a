"""Recommend the method and step, or the engine setting, that reaches an error on a scene at the least cost."""
