"""Bodies, meshes, hand-offs and gearboxes made up for tests and benchmarks."""
