"""My PID against this MPC: 100 random Crazyflies, in winds of up to 4 m/s 6 m above the ground.

$ python campaign_in_wind.py
mean distance  median    95 %   worst   crashed
PID            5.9 cm  7.9 cm  8.6 cm  0 of 100
MPC            2.7 cm  4.5 cm  5.2 cm  0 of 100
"""

from own_law import Pid

from mambo_nmpc import Controller, Vehicle, campaign

found = campaign(
    {"PID": Pid(), "MPC": Controller.from_vehicle("crazyflie")},
    Vehicle.from_preset("crazyflie"),
    flights=100,
    duration_s=10.0,
    sensors="mocap",
    draws={"wind_speed_m_s": {"uniform": [0.0, 4.0]}},
)
print(found)
