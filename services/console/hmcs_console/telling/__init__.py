"""What stands beside the scene, and what is heard: words, plots, tones."""
