# main.py of a robot that runs on its own: its sensors and motors on the pins of a Raspberry Pi Pico, no host.
# Copy it, put in your pins and measures, and: host_tools flash --target mpremote:/dev/ttyACM0 --main my_robot.py
# It starts at the button, not at power-on. It has been tried on a fake `machine`, not on silicon; wiring: docs/porting.md.

from machine import ADC, PWM, Pin

from firmware_py.main_board import main
from firmware_py.ports.pins import Encoder, Infrared, Robot, Ultrasonic, Wheel

# The reference robot, sim_device/robot.toml. Bearings in 1/65536 of a turn to the left.
PARAMETERS = {
    "wheel_diameter": (72000,),     # um
    "track": (235000,),             # um, between the wheels
    "pulses_per_turn": (508,),      # both edges of channel A
    "body_radius": (170,),          # mm
    "ir_radius": (120,),            # mm, from the centre to where the infrared sensors look out
    "ir_bearing": (0, 10923, -3277, -7282, -11833, -16384, -21845, -32768),
    "speed_max": (300,),            # mm/s
    "turn_max": (2000,),            # mrad/s
    "wall_gap": (30,),              # mm
    "ir_threshold": (160,),         # mm
}
UM_PER_PULSE = 445                  # wheel_diameter * pi / pulses_per_turn
FULL_MM_S = 600                     # the wheel's speed at full duty, without load


def switch(number):
    return Pin(number, Pin.IN, Pin.PULL_UP)


def wheel(a, b, forward, backward):
    return Wheel(Encoder(switch(a), switch(b)), PWM(Pin(forward), freq=20000, duty_u16=0), PWM(Pin(backward), freq=20000, duty_u16=0),
                 UM_PER_PULSE, FULL_MM_S)


main(robot=Robot(
    left=wheel(2, 3, forward=6, backward=7),
    right=wheel(4, 5, forward=8, backward=9),
    infrared=Infrared((ADC(Pin(26)),), select=(Pin(10, Pin.OUT), Pin(11, Pin.OUT), Pin(12, Pin.OUT))),
    ultrasonic=Ultrasonic(trigger=Pin(13, Pin.OUT), echo=Pin(14, Pin.IN)),
    bumpers=((switch(16), 0b00000011), (switch(17), 0b10000001)),   # front left: ahead and 45 degrees to the left; front right
    start=switch(18),
    parameters=PARAMETERS))
