"""One axis of a machine, tick by tick: measure, control, convert, and let drive and mechanics move for a period.

They are exact where linear, with friction, torque limit and backlash.

The plant is dz/dt = A z + B u + N n(y), y = C z + D u, with three scalar nonlinear inputs n: friction, the force that a
torque limit cuts off, and the spring force that backlash takes away. z+ = Phi z + Gamma u is exact for the linear part;
n enters by quadratic interpolation over a sub-step (exponential quadrature on start, middle and end; Hochbruck and
Ostermann, Acta Numerica 19 (2010), doi:10.1017/S0962492910000048, section 2). Where sliding stops, sticking ends, a
motor with backlash turns round, or a limit or flank is met, the sub-step is bisected, with matrices kept for each
halving, until the event is enclosed.
"""

from __future__ import annotations

import math
from functools import partial

from splinefeed.kernels.jit import Leaf, hot_kernel, kernel
from splinefeed.records import Array

#: States of the plant: motor position and speed, drive (speed wanted, or force), its integral, load position and speed.
STATES = 6
MOTOR, MOTOR_SPEED, DRIVE, DRIVE_INTEGRAL, LOAD, LOAD_SPEED = range(STATES)
#: Nonlinear inputs.
CHANNELS = 3
FRICTION, LIMIT, PLAY = range(CHANNELS)
#: Nodes of the quadratic interpolation: start, middle and end of a sub-step.
NODES = 3
#: Length of the scratch array.
SCRATCH = STATES + NODES * CHANNELS + 2 * CHANNELS
#: Halvings of a sub-step when an event is enclosed: at 1 ms and 2 sub-steps it is known to 8 ns.
LEVELS = 16
FINEST = 2**LEVELS

#: Places in a row of the step table. Row 0 is a whole period; then LEVELS + 1 rows each for sliding and for sticking.
PHI = 0  # (6, 6) by columns
GAMMA = PHI + STATES * STATES  # (6,)
WEIGHTS = GAMMA + STATES  # (node, channel, 6): what n adds to z at the end
MIDDLE_PHI = WEIGHTS + NODES * CHANNELS * STATES  # (channel, 6): y in the middle, from z at the start
MIDDLE_GAMMA = MIDDLE_PHI + CHANNELS * STATES  # (channel,)
MIDDLE_WEIGHTS = MIDDLE_GAMMA + CHANNELS  # (channel, node, channel)
END_WEIGHTS = MIDDLE_WEIGHTS + CHANNELS * NODES * CHANNELS  # (channel, node, channel)
OUTPUTS = END_WEIGHTS + CHANNELS * NODES * CHANNELS  # (channel, 6): C, the same in every row
FEEDTHROUGH = OUTPUTS + CHANNELS * STATES  # (channel,): D
TABLE_WIDTH = FEEDTHROUGH + CHANNELS
TABLE_ROWS = 1 + 2 * (LEVELS + 1)

#: Places in the parameters of an axis.
(
    PERIOD,
    CASCADE,  # 1: P-PI, 0: PID
    KP,  # PID: V/mm; P-PI: position gain, 1/s
    KI,  # V/mm/s; P-PI: 0
    KD,  # V*s/mm; P-PI: 0
    FILTER,  # derivative or speed filter: a in d = a d + (1 - a) (change / period)
    VELOCITY_FORWARD,  # V*s/mm; P-PI: 1 for the whole of the reference's speed
    ACCELERATION_FORWARD,  # V*s^2/mm
    VELOCITY_KP,  # P-PI only, V*s/mm
    VELOCITY_KI,  # P-PI only, V/mm
    OUTPUT_LIMIT,  # V
    OUTPUT_STEP,  # V a code of the converter, 0: none
    DRIVE_LIMIT,  # V that the drive heeds
    DELAY,  # 1: output takes effect a period later
    ON_LOAD,  # 1: the scale on the load closes the loop, 0: the encoder
    RESOLUTION,  # mm or rad, 0: none
    ERROR_LIMIT,  # mm or rad
    NONLINEAR,  # 0: whole periods by row 0
    SUB_STEPS,
    COMPLIANT,  # 1: two masses
    COULOMB,  # N
    STICTION,  # static - Coulomb friction, N
    INVERSE_STRIBECK,  # s/mm
    FORCE_LIMIT,  # N, infinite: none
    HALF_PLAY,  # mm
    STIFFNESS,  # N/mm
    DAMPING,  # N*s/mm
) = range(27)
PARAMETERS = 27

#: Places in what is remembered between ticks, behind the plant's six states.
(
    INTEGRAL,  # V
    LAST_INPUT,  # error, or measured position for P-PI
    FILTERED,  # derivative or speed
    LAST_REFERENCE,
    LAST_SPEED,  # of the reference
    PENDING,  # output that waits for its period, V
    SLIDING,  # direction of sliding: -1, 1, or 0 for sticking
    STARTED,
) = range(STATES, STATES + 8)
MEMORY = STATES + 8

#: Halvings at once while the torque limit cuts or backlash is being crossed, where the inputs feed back on themselves.
CAREFUL = 2
#: Halvings at most where friction falls steeply with speed: below STEEP_SPEED times the Stribeck speed a step may
#: change the speed by STEEP_CHANGE times it.
STEEP = 5
STEEP_SPEED = 4.0
STEEP_CHANGE = 0.1
#: Rounds of the iteration for the nonlinear inputs in the middle and at the end of a sub-step.
ROUNDS = 8
#: ... which ends when an input changes by less than this share of the friction and limit forces' size.
SETTLED = 1e-9
#: Halvings allowed in one period. Beyond it events are taken where the sub-step ends: a bound, not met in practice.
HALVINGS = 400
#: Steps of one period at most, for the compiler's and the reader's peace of mind.
MOST_STEPS = 4000

#: Ticks of one axis that plain Python does in the time that its loop takes to compile: 20 to 30 us each, and 3 s.
WORTH = 125_000


@hot_kernel
def clamp(value: float, bound: float) -> float:
    """`value`, but not beyond -bound and bound."""
    return min(max(value, -bound), bound)


@hot_kernel
def _input(channel: int, y: float, parameters: Array, sliding: float) -> float:
    """The nonlinear input n of one channel at its argument y, of friction F_c + (F_s - F_c) / (1 + (v / v_s)^2).

    Viscous friction is in A. The Lorentzian form of the Stribeck curve is one of those that B. Armstrong-Helouvry,
    P. Dupont and C. Canudas de Wit, Automatica 30 (1994) 1083-1138, doi:10.1016/0005-1098(94)90209-7, collect.
    """
    if channel == FRICTION:
        ratio = y * parameters[INVERSE_STRIBECK]
        return -sliding * (parameters[COULOMB] + parameters[STICTION] / (1.0 + ratio * ratio))
    if channel == LIMIT:
        return clamp(y, parameters[FORCE_LIMIT]) - y
    return parameters[STIFFNESS] * clamp(y, parameters[HALF_PLAY])


@hot_kernel
def _side(y: float, bound: float) -> int:
    """-1, 0 or 1: below -bound, between, or above bound."""
    return (1 if y > bound else 0) - (1 if y < -bound else 0)


@hot_kernel
def _output(z: Array, volts: float, line: Array, channel: int) -> float:
    """y = C z + D u of one channel; any row of the table will do for `line`."""
    y = line[FEEDTHROUGH + channel] * volts
    for i in range(STATES):
        y += line[OUTPUTS + channel * STATES + i] * z[i]
    return y


@hot_kernel
def holding_force(z: Array, volts: float, line: Array, parameters: Array) -> float:
    """Force on the mass that friction acts on, without friction, at rest, N: what sticking has to hold."""
    if parameters[COMPLIANT] == 0.0:
        return clamp(_output(z, volts, line, LIMIT), parameters[FORCE_LIMIT])
    stretch = z[MOTOR] - z[LOAD]
    spring = parameters[STIFFNESS] * (stretch - clamp(stretch, parameters[HALF_PLAY]))
    return spring + parameters[DAMPING] * (z[MOTOR_SPEED] - z[LOAD_SPEED])


@kernel
def _add_inputs(
    z: Array, volts: float, line: Array, parameters: Array, sliding: float, limited: int, playing: bool, scratch: Array
) -> None:
    """Add what friction, torque limit and backlash together do in a sub-step to scratch[:6], Phi z + Gamma u."""
    inputs = scratch[STATES : STATES + NODES * CHANNELS]  # (node, channel)
    linear = scratch[STATES + NODES * CHANNELS :]  # (middle or end, channel): y without the inputs
    size = parameters[COULOMB] + parameters[STICTION] + parameters[STIFFNESS] * parameters[HALF_PLAY]
    if limited != 0:
        size += parameters[FORCE_LIMIT]
    count = CHANNELS if limited != 0 or playing else 1  # friction, the first one, alone
    for channel in range(count):
        start = 0.0
        if channel == FRICTION or (limited != 0 if channel == LIMIT else playing):
            start = _input(channel, _output(z, volts, line, channel), parameters, sliding)
            middle = line[MIDDLE_GAMMA + channel] * volts
            for i in range(STATES):
                middle += line[MIDDLE_PHI + channel * STATES + i] * z[i]
            linear[channel] = middle
            linear[CHANNELS + channel] = _output(scratch, volts, line, channel)
        for node in range(NODES):
            inputs[node * CHANNELS + channel] = start
    for _ in range(ROUNDS):
        change = 0.0
        for channel in range(count):
            if channel != FRICTION and not (limited != 0 if channel == LIMIT else playing):
                continue
            middle = linear[channel]
            end = linear[CHANNELS + channel]
            for node in range(NODES):
                for k in range(node * CHANNELS, node * CHANNELS + count):
                    middle += line[MIDDLE_WEIGHTS + channel * NODES * CHANNELS + k] * inputs[k]
                    end += line[END_WEIGHTS + channel * NODES * CHANNELS + k] * inputs[k]
            middle = _input(channel, middle, parameters, sliding)
            end = _input(channel, end, parameters, sliding)
            change = max(change, abs(middle - inputs[CHANNELS + channel]), abs(end - inputs[2 * CHANNELS + channel]))
            inputs[CHANNELS + channel] = middle
            inputs[2 * CHANNELS + channel] = end
        if change <= SETTLED * size:
            break
    for node in range(NODES):
        for k in range(node * CHANNELS, node * CHANNELS + count):
            for i in range(STATES):
                scratch[i] += line[WEIGHTS + k * STATES + i] * inputs[k]


@hot_kernel
def _linear_step(z: Array, volts: float, line: Array, scratch: Array) -> None:
    """Phi z + Gamma u of one row of the step table into scratch[:6]."""
    for i in range(STATES):
        scratch[i] = line[GAMMA + i] * volts
    for k in range(STATES):
        for i in range(STATES):
            scratch[i] += line[k * STATES + i] * z[k]


@hot_kernel
def advance(z: Array, volts: float, table: Array, parameters: Array, scratch: Array) -> None:
    """The plant one period on under `volts`, in place; z is the memory of an axis, its first six numbers the states."""
    volts = clamp(volts, parameters[DRIVE_LIMIT])
    half_play = parameters[HALF_PLAY]
    if parameters[NONLINEAR] == 0.0:
        _linear_step(z, volts, table[0], scratch)
        for i in range(STATES):
            z[i] = scratch[i]
        if parameters[COMPLIANT] == 0.0:
            z[LOAD] = z[MOTOR]
        return
    compliant = parameters[COMPLIANT] != 0.0
    speed = LOAD_SPEED if compliant else MOTOR_SPEED
    breakaway = parameters[COULOMB] + parameters[STICTION]
    rubbing = breakaway > 0.0
    force_limit = parameters[FORCE_LIMIT]
    limiting = force_limit < math.inf
    playing = compliant and half_play > 0.0
    dragging = not compliant and half_play > 0.0
    limited = _side(_output(z, volts, table[0], LIMIT), force_limit) if limiting else 0
    remaining = int(parameters[SUB_STEPS]) * FINEST
    until = 0
    level = 0
    searching = False
    halvings = 0
    if rubbing and z[SLIDING] == 0.0:  # the output has just changed: what was held may not be held any more
        z[SLIDING] = _side(holding_force(z, volts, table[0], parameters), breakaway)
    for _ in range(MOST_STEPS):
        while (FINEST >> level) > remaining:
            level += 1
        load = z[LOAD]
        side = _side(z[MOTOR] - load, half_play) if playing else 0
        free = playing and side == 0
        if level < CAREFUL and (limited != 0 or free):
            level = CAREFUL
        size = FINEST >> level
        sliding = z[SLIDING]
        row = 1 + level + (LEVELS + 1 if rubbing and sliding == 0.0 else 0)
        line = table[row]
        shift = side * half_play  # on a flank the spring is linear in a load that stands half the backlash further on
        z[LOAD] += shift
        _linear_step(z, volts, line, scratch)
        if limited != 0 or free or sliding != 0.0:
            _add_inputs(z, volts, line, parameters, sliding, limited, free, scratch)
        z[LOAD] = load
        scratch[LOAD] -= shift
        if sliding != 0.0 and level < STEEP:
            # in the steep part of the Stribeck curve a step must not cross much of it
            passed = abs(scratch[speed] - z[speed]) * parameters[INVERSE_STRIBECK]
            slowest = min(abs(scratch[speed]), abs(z[speed])) * parameters[INVERSE_STRIBECK]
            if passed > STEEP_CHANGE and slowest < STEEP_SPEED and parameters[STICTION] > 0.0:
                level += 1
                continue
        stopping = False
        limited_then = _side(_output(scratch, volts, line, LIMIT), force_limit) if limiting else 0
        event = limited_then != limited
        if playing:
            event = event or _side(scratch[MOTOR] - scratch[LOAD], half_play) != side
        if dragging:  # where the motor turns round the load stands still: its farthest point must not be stepped over
            event = event or z[MOTOR_SPEED] * scratch[MOTOR_SPEED] < 0.0
        if rubbing:
            if sliding == 0.0:
                stopping = abs(holding_force(scratch, volts, table[0], parameters)) > breakaway
            else:
                stopping = sliding * scratch[speed] <= 0.0
            event = event or stopping
        if event and level < LEVELS and halvings < HALVINGS:
            if not searching:
                searching = True
                until = remaining - size
            level += 1
            halvings += 1
            continue
        for i in range(STATES):
            z[i] = scratch[i]
        if not compliant:  # backlash without compliance: the load is dragged along
            z[LOAD] = min(max(z[LOAD], z[MOTOR] - half_play), z[MOTOR] + half_play)
        if stopping:
            z[speed] = 0.0
            z[SLIDING] = _side(holding_force(z, volts, table[0], parameters), breakaway)
            limited_then = _side(_output(z, volts, line, LIMIT), force_limit) if limiting else 0
        limited = limited_then
        remaining -= size
        if remaining <= 0:
            break
        if event or remaining <= until:
            searching = False
            level = 0
            until = 0
        elif searching:
            level = min(level + 1, LEVELS)


@hot_kernel
def control(reference: float, measured: float, parameters: Array, memory: Array) -> float:
    """Output of the controller before limit and converter, V; the integral advances unless that would wind it up.

    PID:  u = K_p e + I + K_d d + forward,  I += K_i T e,  d = a d + (1 - a) (e - e_last) / T
    P-PI: w = K e + k r' - v,  u = K_vp w + I + K_aff r'',  I += K_vi T w,  v = a v + (1 - a) (x - x_last) / T
    forward = K_vff r' + K_aff r'' by backward differences; a = T_f / (T_f + T) (filter by backward Euler).
    Clamping: I stays as it was when the output is beyond its limit and I would carry it further (K. J. Astrom and
    T. Hagglund, Advanced PID Control, ISA 2006, section 3.5).
    """
    period = parameters[PERIOD]
    error = reference - measured
    if memory[STARTED] == 0.0:
        memory[STARTED] = 1.0
        memory[LAST_REFERENCE] = reference
        memory[LAST_INPUT] = measured if parameters[CASCADE] != 0.0 else error
    speed = (reference - memory[LAST_REFERENCE]) / period
    forward = parameters[ACCELERATION_FORWARD] * (speed - memory[LAST_SPEED]) / period
    memory[LAST_REFERENCE] = reference
    memory[LAST_SPEED] = speed
    cascade = parameters[CASCADE] != 0.0
    source = measured if cascade else error
    a = parameters[FILTER]
    memory[FILTERED] = a * memory[FILTERED] + (1.0 - a) * (source - memory[LAST_INPUT]) / period
    memory[LAST_INPUT] = source
    if cascade:
        wanted = parameters[KP] * error + parameters[VELOCITY_FORWARD] * speed - memory[FILTERED]
        proportional = parameters[VELOCITY_KP] * wanted
        step = parameters[VELOCITY_KI] * period * wanted
    else:
        proportional = parameters[KP] * error + parameters[KD] * memory[FILTERED] + parameters[VELOCITY_FORWARD] * speed
        step = parameters[KI] * period * error
    volts = proportional + memory[INTEGRAL] + step + forward
    if abs(volts) > parameters[OUTPUT_LIMIT] and volts * step > 0.0:
        return volts - step
    memory[INTEGRAL] += step
    return volts


@hot_kernel
def quantise(position: float, resolution: float) -> float:
    """The nearest count of an encoder or scale: resolution * floor(x / resolution + 1/2); 0: x itself."""
    if resolution == 0.0:
        return position
    return math.floor(position / resolution + 0.5) * resolution


@hot_kernel
def convert(volts: float, parameters: Array) -> float:
    """What the converter puts out: the nearest code, k * step with -limit <= k * step <= limit - step; V."""
    step = parameters[OUTPUT_STEP]
    return min(quantise(clamp(volts, parameters[OUTPUT_LIMIT]), step), parameters[OUTPUT_LIMIT] - step)


@partial(Leaf, worth=WORTH, lists=("table", "parameters"))
def run_axis(
    command: Array,
    table: Array,
    parameters: Array,
    memory: Array,
    scratch: Array,
    position: Array,
    measured: Array,
    output: Array,
    saturated: Array,
) -> int:
    """One axis over n ticks of `command` (n,), mm or rad; returns the ticks done: n, or up to that of a run-away.

    At tick k: measure, compute, put out; then the plant moves one period. Outputs (n,): position of the load, what
    encoder or scale say, V, and 1 where the output is at its limit. memory (MEMORY,) and scratch (SCRATCH,) carry on.
    """
    on_load = parameters[ON_LOAD] != 0.0
    for k in range(len(command)):
        position[k] = memory[LOAD]
        seen = quantise(memory[LOAD] if on_load else memory[MOTOR], parameters[RESOLUTION])
        measured[k] = seen
        wanted = control(command[k], seen, parameters, memory)
        volts = convert(wanted, parameters)
        output[k] = volts
        saturated[k] = 1.0 if abs(wanted) > parameters[OUTPUT_LIMIT] else 0.0
        if not abs(command[k] - seen) <= parameters[ERROR_LIMIT]:
            return k + 1
        if parameters[DELAY] != 0.0:
            late = memory[PENDING]
            memory[PENDING] = volts
            volts = late
        advance(memory, volts, table, parameters, scratch)
    return len(command)
