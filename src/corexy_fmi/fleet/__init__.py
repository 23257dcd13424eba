"""Many machines: a folder of recordings each, diagnosed once, kept, and put into one table."""
