"""The page's server: who is let in, and what its viewers do."""
