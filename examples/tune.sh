# Search response time and noise of the observer on random flights of a Crazyflie, from the settings of `design`.
#
# $ bash tune.sh
# trial ... of 4: ... cm in the mean, the base 1.5 cm; 0 of 12 flights crashed
# ...
# chosen      ...
set -eu
mambo-nmpc design crazyflie-flown -o start.toml &> design.txt
cat > tune.toml <<'END'
base = "start.toml"

[flight]
vehicle = "crazyflie-flown"
sensors = "mocap"
duration_s = 20.0

[search]
cost.response_time_s = { uniform = [0.1, 0.25] }
observer.disturbance_noise = { log_uniform = [0.3, 10.0] }
END
mambo-nmpc tune tune.toml --trials 4 -o tuned 2> tune.txt
