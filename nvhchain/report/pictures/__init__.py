"""Pictures of stored hand-offs and of bodies of a case."""
