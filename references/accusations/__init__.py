"""What is wrong in engines: a script of the engine alone for each sentence, and what it printed for each version."""
