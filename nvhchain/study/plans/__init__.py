"""Plans of a study: designs listed beforehand, a search, and steps for slopes."""
