"""Machines: axes with their motors, drives, mechanics, encoders and controllers, read from TOML files."""

from __future__ import annotations

from splinefeed.machine.machine import Machine as Machine
from splinefeed.machine.machine import MachineError as MachineError
from splinefeed.machine.parts import Axis as Axis
from splinefeed.machine.parts import AxisLimits as AxisLimits
from splinefeed.machine.parts import Controller as Controller
from splinefeed.machine.parts import Drive as Drive
from splinefeed.machine.parts import Encoder as Encoder
from splinefeed.machine.parts import Friction as Friction
from splinefeed.machine.parts import Load as Load
from splinefeed.machine.parts import Motor as Motor
from splinefeed.machine.parts import Scale as Scale
from splinefeed.machine.parts import ServoAxis as ServoAxis
from splinefeed.machine.parts import Transmission as Transmission
