"""Words about the tool: its length (G43 and its kin) and its radius (G40 to G42.1)."""

from __future__ import annotations

from splinefeed.formats.gcode import codes, layout
from splinefeed.formats.gcode.codes import g_name
from splinefeed.formats.gcode.cutter import Cutter
from splinefeed.formats.gcode.dialects import Dialect
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.line_words import LineWords
from splinefeed.formats.gcode.moves import Findings
from splinefeed.formats.gcode.state import State
from splinefeed.formats.gcode.tool_tip import TOOL_TIP, ToolTip
from splinefeed.formats.gcode.words import Block


class ToolWords(LineWords):
    """Puts lengths of tools in force, and begins and ends cutter compensation."""

    def __init__(self, state: State, dialect: Dialect, findings: Findings, repair: bool) -> None:
        super().__init__(state)
        self.dialect, self.findings, self.repair = dialect, findings, repair
        self.line = 0
        self.cutter = Cutter(state)
        self.tool_tip = ToolTip(state, findings)

    def _tool_length(self, code: int) -> None:
        """G43 and its kin: the programmed point is the tool tip: the axes move by the tool offset."""
        state = self.state
        axes = self._axes() if code in (431, 432) else {}
        number = self._take("H", state.loaded if code == 430 else None)
        if code in TOOL_TIP:
            self.tool_tip.begin(TOOL_TIP[code], self.line, number, vectors=code == 435)
            return
        if state.tools is None:
            if state.tip:
                self.tool_tip.length(code, self.line)
            elif code != 490:
                self.findings.say(
                    f"line {self.line}: {g_name(code)}: the path is that of the tool tip, as programmed (option tools)"
                )
            return
        offset = state.offsets.tool
        state.length_code = 490 if code == 490 else 430
        if code == 432 and (number is None) == (not axes):
            raise LineError("G43.2 needs H, or axes, and not both")
        if code in (430, 490):
            offset[:] = 0.0
        if number is not None:
            offset += state.tools.tool(number or state.loaded).offset
        for axis, value in axes.items():
            offset[axis] = value + (offset[axis] if code == 432 else 0.0)
        if state.tip:
            self.tool_tip.length(code, self.line)
        elif offset.any():
            self.findings.say(
                f"line {self.line}: {g_name(code)}: from here on places are those of the axes, not the tip"
            )
        state.set_offsets()

    def _compensates(self, code: int) -> bool:
        """Whether the code begins cutter compensation, and the radius is known."""
        known = code in (411, 421) or (code in (410, 420) and self.state.tools is not None)
        return known and self.dialect.jumps and not self.repair

    def _cutter(self, code: int) -> None:
        """G40 to G42.1: D is a tool's number, or with G41.1 and G42.1 its diameter."""
        if code == 400:
            self.cutter.end()
            return
        if not self._compensates(code):
            self._take("D")
            return
        if self.cutter.on or self.state.tip:
            what = "cutter compensation is on; write G40" if self.cutter.on else "X, Y, Z are the tool's tip; end that"
            raise LineError(f"{g_name(code)}: {what} before it")
        if self.state.modes[layout.PLANE] == 19:
            raise LineError(f"{g_name(code)}: there is no cutter compensation in G19; choose G17 or G18")
        if code % 10:
            if self._take("L", 0.0):
                raise LineError(f"{g_name(code)} L: tools of a lathe are not supported")
            diameter = self.state.scaled(0, self._need("D", code))
        else:
            tools, number = self.state.tools, self._take("D", self.state.loaded)
            diameter = 0.0 if tools is None else tools.tool(number or 0.0).diameter
        if abs(diameter) > layout.LARGEST:
            raise LineError(f"{g_name(code)}: a tool of diameter {diameter:.6g} mm does not compensate")
        if diameter == 0.0:
            self.findings.count(f"{g_name(code)} with a tool of diameter 0 moves nothing to the side", self.line)
            return
        self.findings.count(
            "cutter compensation is on; not every gouge is found: look at the path before you cut", self.line
        )
        self.cutter.begin(0.5 * diameter * (1.0 if code < 420 else -1.0), self.line)

    def _beside_contour(self, block: Block, known: set[int]) -> None:
        """LineError for what cannot stand between G41 and G40."""
        allowed = {0, 10, 20, 30, 40, 400, 800}
        groups = ("motion", "one line", "plane", "coordinate system", "tool length", "units", "feed mode")
        same = {10 * int(self.state.modes[layout.PLANE]), 940, 200 if self.state.inch else 210}
        for code in sorted(known - allowed - same):
            if 400 not in known and codes.GROUP_OF.get(code) in groups:
                raise LineError(f"{g_name(code)} is not allowed between G41 or G42 and G40")
        if any(70 <= code <= 73 for code in block.m):
            raise LineError("M70 to M73 are not allowed between G41 or G42 and G40")
        if 6 in block.m or self.state.modes[layout.FEED_MODE] == layout.INVERSE:
            raise LineError("a change of tool and G93 are not allowed between G41 or G42 and G40")
