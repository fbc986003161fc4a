"""The sensors of the Mambo and its stock estimators, for n flights."""
