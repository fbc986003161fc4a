"""Result folders and the compile cache."""
