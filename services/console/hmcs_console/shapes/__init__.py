"""What pages draw with: colors, edges, surfaces, and ways in pieces."""
