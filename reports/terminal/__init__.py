"""What a person in front of a terminal sees and presses: progress and interrupts."""
