"""Other ways to treat a model that a recording contradicts, on the same files and scores."""
