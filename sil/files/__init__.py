"""Result folders, the compile cache, and the shared libraries in it."""
