"""Long checks that are run by hand: exact solutions, round-off over 10^8 steps, false alarms of the gate."""
