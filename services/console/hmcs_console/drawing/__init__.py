"""The scene: what stands still, what moves, and what was learned."""
