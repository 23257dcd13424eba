"""Places: where small unknown laws explain a mismatch best, whatever the catalogue holds."""
