"""Sound of results: files to listen to, targets, hearing, microphones added afterwards."""
