"""The sample vehicle of all tests; each test changes the values that matter."""

from dataclasses import replace

from missions.mapping.sensors import SwathSettings
from remoras.database import VehicleData

AUV = VehicleData(
    name="AUV00",
    vehicle_type="AUV",
    node=0,
    social_layer=True,
    start_m=(0.0, 0.0),
    depth_m=20.0,
    depth_limit_m=100.0,
    transit_speed_mps=2.0,
    survey_speed_mps=1.5,
    turn_rate_radps=0.5,
    acceleration_mps2=0.5,
    energy_j=1.0e6,
    hotel_w=40.0,
    drag_w_per_mps3=15.0,
    transmit_j_per_bit=0.01,
    playable_roles=("Cartographer",),
    sensors=(SwathSettings(swath_m=25.0, speed_limit_mps=1.25),),
)
"""Its sensor maps more slowly than it could survey."""
WITHOUT_SENSOR = replace(AUV, sensors=())
