"""Progress and interrupts on a terminal."""
