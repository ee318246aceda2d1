"""Manufacturing deviations of gears: tolerance classes, deviations of every tooth, draws from a class."""
