"""Plan laps: from points to polynomial pieces that a drone and its controller can follow."""
