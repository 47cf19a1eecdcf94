"""Generates the MJCF model of apparatus and arm from the parameters.

Frame: that of the apparatus, with its origin in O. On the unturned apparatus (right shoulder) X points forward, Y to the patient's left,
Z up. On the apparatus turned by 180 deg about X, Z points down. Gravity and the arm's links are then mirrored in z, while the scapula's
linkage is the same hardware

Each axis ``n`` has a body with coaxial joints in series: ``rotor{n}`` (shaft and encoder), ``gap{n}`` (the gear's play, a joint between
two limits), for motors 3 to 5 also ``tissue{n}`` (link, cuff and soft tissue), and for motor 5 also ``slip5``. The tendon ``arm{n}`` is
the sum of these joints, which is the arm's angle. The scapula's legs are cranks with rods; ``connect`` constraints attach the rods to the
board.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from kata.motion.linkage import LINKAGE
from kata.simulator.independent.parameters import IndependentParameters
from kata.simulator.parameters import STEP_S, STOPS_DEG, TURNED

GRAVITY_M_S2: Final = 9.81
_SMALL: Final = 1e-3
"""Armature in kg m2 of joints that have no body of their own. Without it the mass matrix would be singular."""
_FLANK_S: Final = 0.003
"""Time constant of the constraint between touching flanks: three steps."""
_STICKS: Final = f'solreffriction="{2 * STEP_S} 1" solimpfriction="0.99 0.99 0.001"'
"""Parameters of friction without creep. With MuJoCo's defaults a loaded joint creeps by 0.5 deg/s."""
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class LinkageGeometry:
    """Points of one leg in the apparatus' frame at phi = psi = 0, in metres. ``theta_deg`` is the motor's angle in this pose."""

    pivot: Vector
    crank_end: Vector
    board_end: Vector
    axis: Vector
    theta_deg: float


def linkage_geometry() -> tuple[LinkageGeometry, LinkageGeometry]:
    """Return the geometry of both legs. The linkage's axes x, y and z are the apparatus' axes Y, -X and Z."""
    one_deg, two_deg = LINKAGE.inverse_deg([0.0, 0.0]).tolist()
    t1, t2 = math.radians(one_deg), math.radians(two_deg)
    w1, w2 = math.radians(LINKAGE.w1_deg), math.radians(LINKAGE.w2_deg)
    leg1 = (np.array(LINKAGE.oo1_mm), LINKAGE.o1p1_mm * np.array([math.sin(t1), math.cos(t1), 0.0]))
    leg2 = (np.array(LINKAGE.oo2_mm), LINKAGE.o2p2_mm * np.array([0.0, math.sin(t2), -math.cos(t2)]))
    q1 = LINKAGE.oq1_mm * np.array([math.sin(w1), 0.0, math.cos(w1)])
    q2 = LINKAGE.oq2_mm * np.array([math.sin(w2), 0.0, math.cos(w2)])
    return (
        LinkageGeometry(_room(leg1[0]), _room(leg1[0] + leg1[1]), _room(q1), (0.0, 0.0, -1.0), one_deg),
        LinkageGeometry(_room(leg2[0]), _room(leg2[0] + leg2[1]), _room(q2), (0.0, 1.0, 0.0), two_deg),
    )


def _room(linkage_mm: "np.typing.NDArray[np.float64]") -> Vector:
    x, y, z = (linkage_mm / 1000).tolist()
    return -y, x, z


def mjcf(values: IndependentParameters, *, turned: bool) -> str:
    """Return the MJCF text of the model for one side."""
    up = -1.0 if turned else 1.0
    legs = linkage_geometry()
    cranks = "".join(_leg(values, n, leg) for n, leg in enumerate(legs))
    x, y, z = values.shoulder_m
    anchor = _text((x, y, up * (z + values.balancer_height_m)))
    closures = "".join(
        f'<connect name="closure{n}" body1="rod{n}" body2="board" anchor="{_text(_minus(leg.board_end, leg.crank_end))}" '
        'solref="0.002 1" solimp="0.99 0.9999 0.0001"/>'
        for n, leg in enumerate(legs, start=1)
    )
    motors = "".join(f'<motor name="drive{n}" joint="rotor{n}"/>' for n in range(1, 6))
    patient = "".join(f'<motor name="patient{n}" tendon="arm{n}"/>' for n in range(1, 6))
    return f"""<mujoco model="apparatus and arm">
<option timestep="{STEP_S}" integrator="implicitfast" gravity="0 0 {-up * GRAVITY_M_S2}"><flag contact="disable"/></option>
<worldbody>
<site name="balancer_top" pos="{anchor}"/>
{cranks}
<body name="board">
<joint name="phi" axis="0 0 1" stiffness="{values.girdle_nm_rad[0]}" damping="{values.girdle_nm_s[0]}"/>
<joint name="psi" axis="-1 0 0" stiffness="{values.girdle_nm_rad[1]}" damping="{values.girdle_nm_s[1]}"/>
{_inertial((x / 2, y / 2, up * z / 2), values.board_kg, (0.01, 0.01, 0.01))}
{_arm(values, up, turned=turned)}
</body>
</worldbody>
<tendon>
<spatial name="balancer"><site site="balancer_top"/><site site="balancer_hook"/></spatial>
{"".join(_sum_of_joints(values, n) for n in range(5))}
</tendon>
<equality>{closures}</equality>
<actuator>{motors}{patient}<motor name="girdle1" joint="phi"/><motor name="girdle2" joint="psi"/>
<motor name="balancer" tendon="balancer"/></actuator>
</mujoco>"""


def _leg(values: IndependentParameters, n: int, leg: LinkageGeometry) -> str:
    """Return crank and rod of motor ``n`` + 1 in their position at phi = psi = 0."""
    crank, rod = _minus(leg.crank_end, leg.pivot), _minus(leg.board_end, leg.crank_end)
    along = np.array(rod) / np.linalg.norm(rod)
    first = np.cross(along, [1.0, 0.0, 0.0] if abs(along[0]) < 0.7 else [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(along, first)
    length = float(np.linalg.norm(rod))
    slender = values.rod_kg * length**2 / 12
    ball = "".join(f'<joint axis="{_text(tuple(axis))}" damping="0.0005"/>' for axis in (first, second))
    return f"""<body name="crank{n + 1}" pos="{_text(leg.pivot)}">
{_axis_joints(values, n, leg.axis, STOPS_DEG[n], leg.theta_deg)}
{_inertial(tuple(part / 2 for part in crank), values.crank_kg, (1e-5, 1e-5, 1e-5))}
<site name="p{n + 1}" pos="{_text(crank)}"/>
<body name="rod{n + 1}" pos="{_text(crank)}">{ball}
{_inertial(tuple(part / 2 for part in rod), values.rod_kg, (slender, slender, slender))}
<site name="q{n + 1}" pos="{_text(rod)}"/></body></body>"""


def _arm(values: IndependentParameters, up: float, *, turned: bool) -> str:
    """Return the links of motors 3 and 4, the cuff of motor 5, and the hanging arm of the patient."""
    down = -up
    upper, fore = values.upper_arm_m, values.forearm_m
    bent = math.radians(values.elbow_flexion_deg)
    direction = (math.sin(bent), 0.0, down * math.cos(bent))
    centre = values.forearm_centre * fore
    x, y, z = values.shoulder_m
    joints = [
        _axis_joints(values, n, axis, _stops(n, turned=turned))
        for n, axis in ((2, (-1.0, 0.0, 0.0)), (3, (0.0, -1.0, 0.0)), (4, (0.0, 0.0, -1.0)))
    ]
    link = (0.0, 0.0, down * values.link_centre_m)
    spread = (0.002, 0.002, 0.002)
    return f"""<body name="link3" pos="{_text((x, y, up * z))}">{joints[0]}{_inertial(link, values.link_kg[0], spread)}
<body name="link4">{joints[1]}{_inertial(link, values.link_kg[1], spread)}
<body name="humerus">{joints[2]}
{
        _inertial(
            (0.0, 0.0, down * values.upper_arm_centre * upper),
            values.upper_arm_kg,
            _slender(values.upper_arm_kg, values.upper_arm_gyration * upper, values.upper_arm_radius_m),
        )
    }
<body name="forearm" pos="{_text((0.0, 0.0, down * upper))}">
{
        _inertial(
            (direction[0] * centre, 0.0, direction[2] * centre),
            values.forearm_kg,
            _slender(values.forearm_kg, values.forearm_gyration * fore, values.forearm_radius_m),
            direction,
        )
    }
<site name="balancer_hook" pos="{_text(tuple(values.balancer_share * fore * part for part in direction))}"/>
</body></body></body></body>"""


def _axis_joints(
    values: IndependentParameters, n: int, axis: Vector, stops_deg: tuple[float, float], ref_deg: float = 0.0
) -> str:
    """Return the coaxial joints of axis ``n`` (from 0) in series."""
    place = f'axis="{_text(axis)}"'
    play = values.backlash_deg[n] / 2
    # MuJoCo's soft limit yields by torque x (1 - d) / d / inertia x time constant^2. Between two soft joints the inertia is twice _SMALL.
    impedance = 1.0 / (1.0 + 2 * _SMALL / (values.gear_nm_rad * _FLANK_S**2))
    joints = (
        f'<joint name="rotor{n + 1}" {place} ref="{ref_deg}" armature="{values.rotor_kg_m2[n]}" '
        f'damping="{values.rotor_viscous_nm_s[n]}" frictionloss="{values.rotor_coulomb_nm[n]}" '
        f'limited="true" range="{stops_deg[0]} {stops_deg[1]}" solreflimit="0.02 1" {_STICKS}/>'
        f'<joint name="gap{n + 1}" {place} armature="{_SMALL}" limited="true" range="{-play} {play}" '
        f'solreflimit="{_FLANK_S} 1" solimplimit="{impedance} {impedance} 0.001"/>'
    )
    if n >= 2:
        joints += (
            f'<joint name="tissue{n + 1}" {place} armature="{_SMALL}" stiffness="{values.tissue_nm_rad[n - 2]}" '
            f'damping="{values.tissue_nm_s[n - 2]}"/>'
        )
    if n == 4:
        joints += (
            f'<joint name="slip5" {place} armature="{_SMALL}" damping="0.5" frictionloss="{values.cuff_slip_nm}" '
            f'solreffriction="{2 * STEP_S} 1" solimpfriction="0.9999 0.9999 0.001"/>'
        )
    return joints


def _sum_of_joints(values: IndependentParameters, n: int) -> str:
    """Return the tendon that measures the arm's angle on axis ``n`` (from 0) and carries the friction of its bearings."""
    names = ["rotor", "gap"] + (["tissue"] if n >= 2 else []) + (["slip"] if n == 4 else [])
    joints = "".join(f'<joint joint="{name}{n + 1}" coef="1"/>' for name in names)
    return (
        f'<fixed name="arm{n + 1}" damping="{values.arm_viscous_nm_s[n]}" frictionloss="{values.arm_coulomb_nm[n]}" {_STICKS}>'
        f"{joints}</fixed>"
    )


def _stops(n: int, *, turned: bool) -> tuple[float, float]:
    low, high = sorted((TURNED[n] if turned else 1) * end for end in STOPS_DEG[n])
    return low, high


def _slender(mass: float, gyration_m: float, radius_m: float) -> Vector:
    """Return the inertia of a slender segment about its centre. The third value is the inertia about its own axis."""
    across = mass * gyration_m**2
    return across, across, mass * radius_m**2 / 2


def _inertial(centre: tuple[float, ...], mass: float, inertia: Vector, along: Vector | None = None) -> str:
    turned = f' zaxis="{_text(along)}"' if along else ""
    return f'<inertial pos="{_text(centre)}"{turned} mass="{mass}" diaginertia="{_text(inertia)}"/>'


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _text(values: tuple[float, ...]) -> str:
    return " ".join(f"{float(value):.9g}" for value in values)
