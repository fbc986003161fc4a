"""How far a controller on a drone is from instability: both linearised at hover, and the loop's margins."""
