"""Tool centre point control: what begins and ends it, whose length counts, and vectors of the tool axis.

While it is on, X, Y and Z are the tool's tip on the workpiece, whatever the rotary axes do, and F is the tip's feed.
It is G43.4 H with rotary words, or G43.5 H with I J K as the tool axis, which G49 ends [1]_; G234 H [2]_; TRAORI and
TRAFOOF, with A3= B3= C3= [3]_; M428 is the machine's own kinematics, M429 that of joints [4]_.

References
----------
.. [1] Fanuc Series 30i-B, "Tool center point control".
.. [2] Haas, G234.
.. [3] SINUMERIK 840D sl, "Job planning".
.. [4] LinuxCNC, sim configurations of switchable kinematics (xyzbc-trt.txt).
"""

from __future__ import annotations

from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.moves import AXES, LARGEST, Findings
from splinefeed.programs.gcode.state import ProgramState

#: Codes that begin it, as tenths, and the M codes that switch kinematics.
TOOL_TIP = {434: "G43.4", 435: "G43.5", 2340: "G234"}
SWITCH_ON, SWITCH_OFF = 428, 429
#: Bit of a move's axes that stands for the tool axis, behind those of the nine letters.
TOOL_AXIS = 1 << AXES


class ToolTip:
    """What the lines of one program say of it; `given` is the vector of the line."""

    def __init__(self, state: ProgramState, findings: Findings) -> None:
        self.state, self.findings = state, findings
        self.given: tuple[float, float, float] | None = None
        self._by = ""
        self._vectors = False
        self._length = 0.0

    def begin(self, by: str, line: int, number: float | None = None, vectors: bool = False) -> None:
        """From here on places are those of the tip of tool `number`, or of the one in the spindle."""
        state = self.state
        if state.tools is not None:
            state.offsets.tool[:] = state.tools.tool(number or state.loaded or state.selected).offset
        self._switch(by, line, vectors)

    def switch(self, code: int, line: int) -> None:
        """M428 and M429: the kinematics of the machine, or those of its joints; G43 says the tool's length."""
        if code == SWITCH_ON or self.state.tip:
            self._switch(f"M{code}" if code == SWITCH_ON else "", line)

    def length(self, code: int, line: int) -> None:
        """G43 or G49 has changed the tool's length: one ends what G43.4 began, the other counts for M428."""
        if not (self._by.startswith("M") and self.state.tip):
            if code == 490:
                self.end(line)
        elif self.state.tools is not None and self._length != self.state.offsets.tool[2]:
            self._switch(self._by, line)

    def end(self, line: int) -> None:
        """Places are those of the axes again; the tool has no length."""
        if self.state.tip:
            self.state.offsets.tool[:] = 0.0
            self._switch("", line)

    def _switch(self, by: str, line: int, vectors: bool = False) -> None:
        """Begin what the word `by` says, or end it."""
        self._by, self._vectors, self._length = by, vectors, float(self.state.offsets.tool[2])
        if by and self.state.tools is None:
            self.findings.say(
                f"line {line}: {by}: X, Y, Z are the tool tip; its length is that of the machine file (option tools)"
            )
        self.state.control_tip(bool(by), line)

    def taken(self, words: dict[str, float], modal: int | None) -> tuple[float, float, float] | None:
        """The tool axis that a line says, its words taken away; None if it says none."""
        vector, self.given = self.given, None
        lines = modal in (0, 10)
        if vector is None and self._vectors and self.state.tip and lines and words.keys() & set("IJK"):
            x, y, z = (words.pop(letter, 0.0) for letter in "IJK")
            vector = x, y, z
        if vector is None:
            return None
        refuse(not self.state.tip, "a tool axis (A3= B3= C3=) has no TRAORI before it")
        refuse(not lines, "a tool axis is given with an arc or a spline; give it with lines, G0 or G1")
        size = max(map(abs, vector))
        if not 0.0 < size <= LARGEST:
            shown = " ".join(f"{each:g}" for each in vector)
            raise LineError(f"the tool axis {shown} has no direction; write a vector from the tip to the spindle")
        x, y, z = (each / size for each in vector)
        return x, y, z
