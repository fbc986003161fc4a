"""Position controllers: classes with `step(state, target, thrust)`."""
