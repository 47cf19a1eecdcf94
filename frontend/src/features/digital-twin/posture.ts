import geometry from "./geometry.json";
import { crankEnd, type LinkPoints, linkPoints, scapulaOf } from "./linkage";
import { about, after, plus, type Rotation, radians, type Side, turned, type Vec } from "./vectors";

/**
 * The positions of all parts, computed from the five motor angles.
 *
 * Motor 3 turns about X through the shoulder's centre and carries motor 4, which turns about Y while the arm hangs;
 * motor 5 turns the upper arm about its axis. All three are on the scapula's board, which adds its yaw and roll
 * (backend/kata/motion/shoulder.py). The left body is the right one reflected in the sagittal plane; the left
 * apparatus is the right one turned by 180 degrees about X (backend/kata/motion/sides.py).
 *
 * The patient's size and the elbow's flexion are not measured; the drawing uses constants.
 */
export interface Posture {
  side: Side;
  /** Scapular abduction, scapular upward rotation, shoulder abduction, flexion, external rotation; degrees. */
  pose_deg: Pose;
  /** The point O, about which the board turns. */
  origin: Vec;
  links: LinkPoints;
  /** The shoulder joint's centre, where the axes of motors 3, 4 and 5 meet. */
  shoulder: Vec;
  elbow: Vec;
  wrist: Vec;
  /** The rotation of the board and the scapula. */
  board: Rotation;
  /** The rotation of the parts that motor 3 carries. */
  lifted: Rotation;
  /** The rotation of the parts that motor 4 carries. */
  swung: Rotation;
  /** The rotation of the upper arm, which motor 5 turns. */
  arm: Rotation;
}

export type Pose = readonly [number, number, number, number, number];
/** Five motor angles, degrees, in axis order. */
export type Angles = readonly [number, number, number, number, number];

/** Lengths for a body height of 1.65 m. geometry.json is generated from the parameters of the MuJoCo model. */
export const UPPER_ARM_MM = geometry.upper_arm_mm;
export const FOREARM_MM = geometry.forearm_mm;
/** The drawn elbow flexion, which makes the upper arm's rotation visible. */
const ELBOW_FLEXION_DEG = geometry.elbow_flexion_deg;
const SHOULDER_OUT_MM = 175;
const SHOULDER_UP_MM = 1010;
/** Position of O relative to the shoulder's centre, mm. We chose it, because the paper does not state it. */
const ORIGIN_FROM_SHOULDER = {
  behind: geometry.shoulder_mm.forward,
  inward: -geometry.shoulder_mm.left,
  below: geometry.shoulder_mm.up,
} as const;

/** +1 to the patient's left, -1 to the right. */
export const outward = (side: Side) => (side === "left" ? 1 : -1);

/** Return the point O of the apparatus that is set up for this side. */
export function originOf(side: Side): Vec {
  const { behind, inward, below } = ORIGIN_FROM_SHOULDER;
  return [-behind, outward(side) * (SHOULDER_OUT_MM - inward), SHOULDER_UP_MM - below];
}

/** Return the vector from O to the shoulder's centre at phi = psi = 0. */
export function shoulderFromOrigin(side: Side): Vec {
  const { behind, inward, below } = ORIGIN_FROM_SHOULDER;
  return [behind, outward(side) * inward, below];
}

/**
 * Convert a direction from the linkage's frame to the room's. On the right, the linkage's x points to the
 * spine, y backward and z up. On the left, the linkage is turned by 180 degrees about X. Only with these
 * directions does phi move the shoulder forward and psi lift it.
 */
export function fromLinkage(v: Vec, side: Side): Vec {
  const turnedOver = side === "left" ? -1 : 1;
  return [-v[1], turnedOver * v[0], turnedOver * v[2]];
}

/** Return the posture at these motor angles, or null if no pose of the scapula fits motors 1 and 2. */
export function postureOf(angles: Angles, side: Side): Posture | null {
  const [theta1, theta2, abduction, flexion, rotation] = angles;
  const scapula = scapulaOf(theta1, theta2, side);
  if (scapula === null) return null;
  const out = outward(side);
  const origin = originOf(side);
  const board = after(
    about("z", -out * radians(scapula.phi_deg)),
    about("x", out * radians(scapula.psi_deg)),
  );
  const lifted = after(board, about("x", out * radians(abduction)));
  const swung = after(lifted, about("y", -radians(flexion)));
  const arm = after(swung, about("z", out * radians(rotation)));
  const shoulder = plus(origin, turned(board, shoulderFromOrigin(side)));
  const elbow = plus(shoulder, turned(arm, [0, 0, -UPPER_ARM_MM]));
  const placed = (v: Vec) => plus(origin, fromLinkage(v, side));
  const inside = linkPoints(scapula, theta1, theta2, side);
  return {
    side,
    pose_deg: [scapula.phi_deg, scapula.psi_deg, abduction, flexion, rotation],
    origin,
    links: {
      o1: placed(inside.o1),
      p1: placed(inside.p1),
      q1: placed(inside.q1),
      o2: placed(inside.o2),
      p2: placed(inside.p2),
      q2: placed(inside.q2),
    },
    shoulder,
    elbow,
    wrist: plus(elbow, turned(arm, forearm(FOREARM_MM))),
    board,
    lifted,
    swung,
    arm,
  };
}

/** Return a vector along the forearm from the elbow, in the upper arm's frame. */
export const forearm = (length: number): Vec => {
  const bent = radians(ELBOW_FLEXION_DEG);
  return [length * Math.sin(bent), 0, -length * Math.cos(bent)];
};

/** Radius at which each motor's range is drawn, mm. The curves do not overlap. */
const RADIUS_MM = [58, 75, 330, 390, 150] as const;

/** The curve of one motor: the positions of its marker if only this motor moved. */
interface Sweep {
  centre: (angle_deg: number) => Vec;
  at: (angle_deg: number) => Vec;
}

/**
 * Return each motor's curve from a posture. The markers are the crank ends of motors 1 and 2, the hanging arm,
 * the arm, and the forearm.
 */
export function sweeps(from: Posture): readonly Sweep[] {
  const { side, origin, shoulder, board, lifted, swung } = from;
  const out = outward(side);
  const crank = (motor: 1 | 2): Sweep => {
    const middle = motor === 1 ? from.links.o1 : from.links.o2;
    const stretch = RADIUS_MM[motor - 1] as number;
    return {
      centre: () => middle,
      at: (deg) => {
        const end = plus(origin, fromLinkage(crankEnd(motor, deg), side));
        return along(middle, end, stretch);
      },
    };
  };
  const down = (radius: number): Vec => [0, 0, -radius];
  const ring = plus(shoulder, turned(swung, down(RING_MM)));
  return [
    crank(1),
    crank(2),
    {
      centre: () => shoulder,
      // The arm hangs as it would without motor 4. Raised forward, it would lie along motor 3's axis and draw no
      // curve.
      at: (deg) => plus(shoulder, turned(after(board, about("x", out * radians(deg))), down(RADIUS_MM[2]))),
    },
    {
      centre: () => shoulder,
      at: (deg) => plus(shoulder, turned(after(lifted, about("y", -radians(deg))), down(RADIUS_MM[3]))),
    },
    {
      centre: () => ring,
      at: (deg) => plus(ring, turned(after(swung, about("z", out * radians(deg))), [RADIUS_MM[4], 0, 0])),
    },
  ];
}

/** Distance from the shoulder to the cuff that motor 5 turns, mm. */
export const RING_MM = 150;

function along(from: Vec, to: Vec, length: number): Vec {
  const d: Vec = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
  const factor = length / Math.hypot(...d);
  return plus(from, [d[0] * factor, d[1] * factor, d[2] * factor]);
}
