"""Fly the generated C of a Crazyflie on a circle, seen by cameras with noise, four times.

$ python flight.py
FlightResult(4 flights: rms error 0.37 cm in the median, 0.39 cm at most, 0 crashed)
seed 0: rms error 0.38 cm, at most 0.6 cm
seed 1: rms error 0.39 cm, at most 0.5 cm
seed 2: rms error 0.37 cm, at most 0.5 cm
seed 3: rms error 0.36 cm, at most 0.5 cm
"""

from mambo_nmpc import Controller, Vehicle, fly

controller = Controller.from_vehicle("crazyflie")  # the settings that `mambo-nmpc design crazyflie` writes
crazyflie = Vehicle.from_preset("crazyflie")

circle = {"trajectory": "circle", "size_m": 1.0, "rate_rad_s": 1.5, "duration_s": 20.0}
flown = fly(controller, crazyflie, **circle, sensors="mocap", seeds=range(4), measured_from_s=6.0)

print(flown)
for seed in range(4):
    rms_m, most_m = flown.metrics.rms_error_m[seed], flown.metrics.max_error_m[seed]
    print(f"seed {seed}: rms error {100 * rms_m:.2f} cm, at most {100 * most_m:.1f} cm")
