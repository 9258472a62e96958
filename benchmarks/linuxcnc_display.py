#!/usr/bin/python3
"""What LinuxCNC runs in place of a screen: home, run a program, and record every joint's command at each servo tick.

Runs in LinuxCNC's own Python, which has the modules `linuxcnc` and `hal`. Arguments: the program, the name of what is
recorded, what HAL's sampler samples (letters), and the most seconds that the program may take. Writes NAME.f64, one row
of doubles a tick, and NAME.json. Instead of a program `-`: it homes, switches the machine off, writes NAME.ready, and
records the second sampler until there is a NAME.stop.
"""

import array
import json
import os
import sys
import threading
import time

import hal
import linuxcnc

#: How long LinuxCNC may take for anything but the program, s; what is recorded before and after the motion, s.
PATIENCE, AROUND = 15.0, 0.2


class Recorder(threading.Thread):
    """Reads what HAL samples, full doubles, until it is told to stop."""

    def __init__(self, sampled: str, sampler: int = 0) -> None:
        super().__init__(daemon=True)
        self.component = hal.component("recorder")
        self.component.ready()
        self.stream = hal.stream(self.component, hal.sampler_base + sampler, sampled)
        self.rows = array.array("d")
        self.lost = 0
        self.ending = False

    def run(self) -> None:
        """Read until told to stop and nothing is left."""
        number = None
        while True:
            while self.stream.readable:
                row = self.stream.read()
                if number is not None:
                    self.lost += self.stream.sampleno - number - 1
                number = self.stream.sampleno
                self.rows.extend(row)
            if self.ending:
                return
            time.sleep(0.005)


class Machine:
    """LinuxCNC's task, told what to do and waited for."""

    def __init__(self) -> None:
        self.command, self.status, self.channel = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
        self.said = []

    def wait(self, done, seconds: float, what: str) -> None:
        """Until done(status) or LinuxCNC complains; SystemExit after so many seconds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                self.status.poll()
            except linuxcnc.error:  # it is still starting
                time.sleep(0.05)
                continue
            message = self.channel.poll()
            if message:
                self.said.append(str(message[1]).strip())
            if done(self.status) or self.said:
                return
            time.sleep(0.01)
        raise SystemExit(f"no answer after {seconds:g} s: {what}")

    def prepare(self) -> None:
        """Out of the emergency stop, on, and homed where it stands."""
        command = self.command
        self.wait(lambda status: True, PATIENCE, "start")
        for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
            command.state(state)
            command.wait_complete()
        self.wait(lambda status: status.task_state == linuxcnc.STATE_ON, PATIENCE, "machine on")
        command.mode(linuxcnc.MODE_MANUAL)
        command.wait_complete()
        command.teleop_enable(0)
        command.wait_complete()
        command.home(-1)
        self.wait(lambda status: all(status.homed[: status.joints]), PATIENCE, "home")

    def load(self, program: str) -> None:
        """Load a program."""
        self.command.mode(linuxcnc.MODE_AUTO)
        self.command.wait_complete()
        self.command.program_open(program)
        self.command.wait_complete()

    def watch(self, name: str, seconds: float) -> float:
        """Switch off, and wait to be told that it is over; the seconds that took."""
        self.command.state(linuxcnc.STATE_OFF)
        self.command.wait_complete()
        time.sleep(AROUND)
        begin = time.monotonic()
        with open(f"{name}.ready", "w", encoding="ascii"):
            pass
        self.wait(lambda status: os.path.exists(f"{name}.stop"), seconds, "stop")
        return time.monotonic() - begin

    def play(self, seconds: float) -> float:
        """Run the program to its end; the seconds that took."""
        idle = linuxcnc.INTERP_IDLE
        begin = time.monotonic()
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        self.wait(lambda status: status.interp_state != idle, PATIENCE, "start of the program")
        self.wait(lambda s: s.interp_state == idle and s.inpos and s.queue == 0, seconds, "end of the program")
        return time.monotonic() - begin


def main() -> None:
    """Play and record."""
    program, name, sampled, seconds = sys.argv[-4:]
    watched = program == "-"
    recorder, machine = Recorder(sampled, int(watched)), Machine()
    recorder.start()
    machine.prepare()
    if not watched:
        machine.load(program)
    hal.set_p(f"sampler.{int(watched)}.enable", "1")
    time.sleep(AROUND)
    wall = machine.watch(name, float(seconds)) if watched else machine.play(float(seconds))
    time.sleep(AROUND)
    hal.set_p(f"sampler.{int(watched)}.enable", "0")
    recorder.ending = True
    recorder.join()
    with open(f"{name}.f64", "wb") as stream:
        recorder.rows.tofile(stream)
    with open(f"{name}.json", "w", encoding="utf-8") as stream:
        json.dump({"wall_s": wall, "lost": recorder.lost, "said": machine.said, "version": linuxcnc.version}, stream)


if __name__ == "__main__":
    main()
