"""The functions for users: `one` integrates a scene, `many` integrates thousands of initial states and bodies."""
