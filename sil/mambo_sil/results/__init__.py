"""Results: folders, compile cache, summaries, and the style of pictures and numbers."""
