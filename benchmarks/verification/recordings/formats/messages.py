"""Attitudes of satellites: STK attitude files (.a) and CCSDS Attitude Ephemeris Messages, whose keywords name the columns."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial

from .table import Start, Table

_STK = {
    "AttitudeTimeQuaternions": "time q_x q_y q_z q_w",
    "AttitudeTimeQuatScalarFirst": "time q_w q_x q_y q_z",
    "AttitudeTimeQuatAngVels": "time q_x q_y q_z q_w w_x_deg_s w_y_deg_s w_z_deg_s",
    "AttitudeTimeDCM": "time R_11 R_21 R_31 R_12 R_22 R_32 R_13 R_23 R_33",
}
"""Column names of the tables of an STK attitude file (.a), whose rows follow the keyword. Its matrices map to body axes."""
_AEM = {"FIRST": "time q_w q_x q_y q_z", "LAST": "time q_x q_y q_z q_w"}
"""Column names of quaternions in a CCSDS Attitude Ephemeris Message (504.0-B), by QUATERNION_TYPE."""


def read(start: Start) -> Table | None:
    """Return the table of a file; None without such a keyword."""
    lines = start.lines
    keys = {key.strip(): value.strip() for key, _, value in (line.partition("=") for line in lines)}
    if "CCSDS_AEM_VERS" in keys:
        return _read_aem(start, keys, [line.strip() for line in lines])
    for number, line in enumerate(lines):
        if (word := line.strip()) in _STK:
            names = _STK[word].split()
            axes = next((each.split()[1:] for each in lines if each.split()[:1] == ["CoordinateAxes"]), [""])
            moving = names[1:5] if re.search(r"(?i)lvlh|vvlh|fixed|vnc|nadir", " ".join(axes)) else []
            unused = dict.fromkeys(moving, f"their axes, {' '.join(axes)}, move")
            return Table(names, partial(start.separated, names, separator=None, skip=number + 1, end="END"), unused)
    return None


def _read_aem(start: Start, keys: Mapping[str, str], lines: list[str]) -> Table:
    """Return the table of a message with quaternions from an inertial frame to body axes."""
    kind = keys.get("ATTITUDE_TYPE"), keys.get("QUATERNION_TYPE", "LAST"), keys.get("ATTITUDE_DIR", "A2B")
    if kind[0] != "QUATERNION" or kind[1] not in _AEM or kind[2] != "A2B" or "DATA_START" not in lines:
        raise start.fail(f"a CCSDS message of {', '.join(map(str, kind))}; QUATERNION, FIRST or LAST, A2B are read")
    names, skip = _AEM[kind[1]].split(), lines.index("DATA_START") + 1
    return Table(names, partial(start.separated, names, separator=None, skip=skip, end="DATA_STOP"))
