"""What users call: `one` integrates a scene, `many` thousands of starts and bodies of one kind of scene."""
