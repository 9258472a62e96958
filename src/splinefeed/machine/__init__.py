"""A machine is what is known of it: axes with limits, motors, drives, mechanics, encoders, controllers, its control.

In comes a TOML file; out comes a Machine (`machine`) of `parts`, with units by `quantities`, and its `control`: the
numbers by which `programs` times a program. `limits_toml` reads and writes files with limits alone, `under` puts them
onto a machine, `usual` is the one taken where none is named; `imports/` makes machine files of configurations of other
controls.
"""

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
