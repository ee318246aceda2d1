"""Sound from a vibrating surface: pressure, power, directivity and run-ups from transfer vectors."""
