"""Maps that are saved, continued and localised in."""
