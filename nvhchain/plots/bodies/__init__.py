"""Pictures of surfaces and bodies in three dimensions."""
