"""An arm of six joints of our own, about the size of a small one: shoulder, elbow and a wrist whose axes meet."""

from __future__ import annotations

#: Joint, its place in the one before, m, its axis, its limits, rad, and the mass, kg, and centre, m, of what it moves.
_JOINTS = (
    ("waist", "0 0 0.3", "0 0 1", 3.1, 12.0, "0 0 0.05", 90),
    ("shoulder", "0.05 0 0.1", "0 1 0", 2.6, 9.0, "0 0 0.2", 140),
    ("elbow", "0 0 0.4", "0 1 0", 2.8, 5.0, "0.1 0 0.02", 70),
    ("roll", "0.18 0 0.03", "1 0 0", 3.1, 2.0, "0.08 0 0", 20),
    ("pitch", "0.2 0 0", "0 1 0", 2.2, 1.0, "0.02 0 0", 15),
    ("flange", "0.07 0 0", "1 0 0", 3.1, 0.4, "0.01 0 0", 10),
)
NAMES = tuple(each[0] for each in _JOINTS)
LIMITS = {"velocity": 3.0, "acceleration": 15.0, "jerk": 400.0}
#: Joints in which the tool points down, about 430 mm in front of the base.
START = (0.0, 0.35, 0.4, 0.0, 0.82, 0.0)


def urdf() -> str:
    """The text of its URDF; the links are base, those of the joints, and tool."""
    found = ['<robot name="six"><link name="base"/>']
    parent = "base"
    for name, xyz, axis, most, mass, center, effort in _JOINTS:
        inertia = f'ixx="{mass / 150}" iyy="{mass / 100}" izz="{mass / 120}"'
        found.append(
            f'<link name="{name}_link"><inertial><origin xyz="{center}"/><mass value="{mass}"/><inertia {inertia}/>'
            f'</inertial></link><joint name="{name}" type="revolute"><parent link="{parent}"/>'
            f'<child link="{name}_link"/><origin xyz="{xyz}"/><axis xyz="{axis}"/>'
            f'<limit lower="{-most}" upper="{most}" velocity="3" effort="{effort}"/></joint>'
        )
        parent = f"{name}_link"
    found.append(
        f'<link name="tool"/><joint name="mount" type="fixed"><parent link="{parent}"/><child link="tool"/>'
        '<origin xyz="0.1 0 0" rpy="0 1.5707963267948966 0"/></joint></robot>'
    )
    return "\n".join(found)
