#!/usr/bin/python3
"""What LinuxCNC runs in place of a screen: home, run a program, and record every joint's command at each servo tick.

Runs in LinuxCNC's own Python, which has the modules `linuxcnc` and `hal`. Arguments: the program, the name of what is
recorded, what HAL's sampler samples (letters), and the most seconds that the program may take. Writes NAME.f64, one row
of doubles a tick, and NAME.json. Instead of a program `-`: it homes, switches the machine off, writes NAME.ready, and
records the second sampler until there is a NAME.stop. A file `actions` beside NAME.json has what the operator does, and
when, s from its start: 1.5:feed=50,2:rapid=25,3:pause,3.5:resume,4:most=10,5:probe,6:abort; `step` waits until the
machine stands; `patient` goes on in spite of messages; `set=PIN VALUE` sets a pin of HAL.
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
        self.said, self.patient = [], False
        self.todo, self.acted, self.begin = [], [], 0.0
        self.count = lambda: 0  # samples so far

    def act(self) -> None:
        """Do what the operator does by now."""
        command, now = self.command, time.monotonic() - self.begin
        while self.todo and self.todo[0][0] <= now:
            if self.todo[0][1] == "step" and self.status.current_vel:  # of a machine that was paused and still moves
                return
            what = self.todo.pop(0)[1]
            self.acted.append((self.count(), what))
            word, _, value = what.partition("=")
            if word == "feed":
                command.feedrate(float(value) / 100.0)
            elif word == "rapid":
                command.rapidrate(float(value) / 100.0)
            elif word == "most":
                command.maxvel(float(value))
            elif word == "pause":
                command.auto(linuxcnc.AUTO_PAUSE)
            elif word == "resume":
                command.auto(linuxcnc.AUTO_RESUME)
            elif word == "step":
                command.auto(linuxcnc.AUTO_STEP)
            elif word == "abort":
                command.abort()
            elif word == "spindle":
                command.spindleoverride(float(value))
            elif word == "patient":
                self.patient = True
            elif word == "open":
                self.load(os.path.abspath(value))
                command.auto(linuxcnc.AUTO_RUN, 0)
            elif word == "run":
                command.mode(linuxcnc.MODE_AUTO)
                command.wait_complete()
                command.auto(linuxcnc.AUTO_RUN, 0)
            elif word == "estop":
                command.state(linuxcnc.STATE_ESTOP)
            elif word == "on":
                for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
                    command.state(state)
                    command.wait_complete()
            elif word == "reverse":
                command.auto(linuxcnc.AUTO_REVERSE)
            elif word == "forward":
                command.auto(linuxcnc.AUTO_FORWARD)
            elif word == "set":
                hal.set_p(*value.split())
            elif word == "probe":
                hal.set_p("motion.probe-input", value or "1")
            elif word == "mdi":
                command.mode(linuxcnc.MODE_MDI)
                command.wait_complete()
                command.mdi(value)
            elif word == "file":
                with open(value, "w", encoding="ascii"):
                    pass

    def hear(self) -> None:
        """Take down what LinuxCNC has to say."""
        while message := self.channel.poll():
            self.said.append(str(message[1]).strip())

    def wait(self, done, seconds: float, what: str) -> None:
        """Until done(status) or LinuxCNC complains; SystemExit after so many seconds."""
        end, before, heard = time.monotonic() + seconds, 0, time.monotonic()
        while time.monotonic() < end:
            if self.begin and self.count() != before:
                before, heard = self.count(), time.monotonic()
            if self.begin and time.monotonic() - heard > PATIENCE:
                raise SystemExit(f"no sample for {PATIENCE:g} s: real time has ended")
            try:
                self.status.poll()
            except linuxcnc.error:  # it is still starting
                time.sleep(0.05)
                continue
            self.hear()
            if self.begin:
                self.act()
            if done(self.status) or (self.said and not self.patient):
                return
            time.sleep(0.002 if self.todo else 0.01)
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
        self.begin = begin = time.monotonic()
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        self.wait(lambda status: status.interp_state != idle, PATIENCE, "start of the program")
        over = lambda s: s.interp_state == idle and s.inpos and s.queue == 0 and not self.todo  # noqa: E731
        self.wait(over, seconds, "end of the program")
        return time.monotonic() - begin


def main() -> None:
    """Play and record."""
    program, name, sampled, seconds = sys.argv[-4:]
    watched = program == "-"
    recorder, machine = Recorder(sampled, int(watched)), Machine()
    recorder.start()
    machine.count = lambda: len(recorder.rows) // len(sampled)
    orders = os.path.join(os.path.dirname(name), "actions")
    if os.path.exists(orders):
        with open(orders, encoding="utf-8") as stream:
            for each in filter(None, stream.read().strip().split(",")):
                at, _, what = each.partition(":")
                machine.todo.append((float(at), what))
    machine.prepare()
    if not watched:
        machine.load(program)
    hal.set_p(f"sampler.{int(watched)}.enable", "1")
    time.sleep(AROUND)
    machine.hear()
    wall = 0.0
    if watched:
        wall = machine.watch(name, float(seconds))
    elif not machine.said:  # what is complained of when it is loaded is not run
        wall = machine.play(float(seconds))
    time.sleep(AROUND)
    hal.set_p(f"sampler.{int(watched)}.enable", "0")
    recorder.ending = True
    recorder.join()
    with open(f"{name}.f64", "wb") as stream:
        recorder.rows.tofile(stream)
    with open(f"{name}.json", "w", encoding="utf-8") as stream:
        told = {"wall_s": wall, "lost": recorder.lost, "said": machine.said, "acted": machine.acted}
        json.dump({**told, "version": linuxcnc.version}, stream)


if __name__ == "__main__":
    main()
