"""Selection of drives: task files, ranking, and nearest misses."""
