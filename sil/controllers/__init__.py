"""Position controllers: whatever has `step()`."""
