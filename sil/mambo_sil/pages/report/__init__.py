"""One page of whatever has been run."""
