"""Running variants on episodes, storing the results, and their statistics."""
