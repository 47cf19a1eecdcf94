import { crankEnd, type LinkPoints, linkPoints, scapulaOf } from "./linkage";
import { about, after, plus, type Rotation, radians, type Side, turned, type Vec } from "./vectors";

/**
 * Where everything is, worked out of the five motor angles.
 *
 * Motor 3 turns about X through the shoulder's centre and carries motor 4, which turns about Y while the arm hangs; motor
 * 5 turns the upper arm about itself. All of it sits on the scapula's board, whose yaw and roll come on top
 * (backend/kata/motion/shoulder.py). The left body is the right one reflected in the sagittal plane; the left
 * apparatus is the right one turned by 180 degrees about X (backend/kata/motion/sides.py).
 *
 * How large a patient is and how the elbow is bent, no motor tells: those are drawn, not measured.
 */
export interface Posture {
  side: Side;
  /** Scapular abduction, scapular upward rotation, shoulder abduction, flexion, external rotation; degrees. */
  pose_deg: Pose;
  /** O, about which the board turns. */
  origin: Vec;
  links: LinkPoints;
  /** The shoulder joint's centre, in which the axes of motors 3, 4 and 5 meet. */
  shoulder: Vec;
  elbow: Vec;
  wrist: Vec;
  /** How the board, and with it the scapula, is turned. */
  board: Rotation;
  /** What motor 3 carries. */
  lifted: Rotation;
  /** What motor 4 carries. */
  swung: Rotation;
  /** What motor 5 turns: the upper arm. */
  arm: Rotation;
}

export type Pose = readonly [number, number, number, number, number];
/** Five motor angles, degrees, in axis order. */
export type Angles = readonly [number, number, number, number, number];

/** Of somebody 1.65 m tall. */
export const UPPER_ARM_MM = 285;
export const FOREARM_MM = 245;
/** From hanging straight; so that one sees which way the upper arm is turned. */
export const ELBOW_BENT_DEG = 80;
const SHOULDER_OUT_MM = 175;
const SHOULDER_UP_MM = 1010;
/** O behind the shoulder's centre, nearer to the spine, and a little lower. Ours: the paper does not say. */
const ORIGIN_FROM_SHOULDER = { behind: 140, inward: 115, below: 20 } as const;

/** +1 to the patient's left, -1 to the right. */
export const outward = (side: Side) => (side === "left" ? 1 : -1);

/** O of the apparatus that serves this side. */
export function originOf(side: Side): Vec {
  const { behind, inward, below } = ORIGIN_FROM_SHOULDER;
  return [-behind, outward(side) * (SHOULDER_OUT_MM - inward), SHOULDER_UP_MM - below];
}

/** From O to the shoulder's centre while phi and psi are 0. */
export function shoulderFromOrigin(side: Side): Vec {
  const { behind, inward, below } = ORIGIN_FROM_SHOULDER;
  return [behind, outward(side) * inward, below];
}

/**
 * A direction of the linkage's frame in the room. Its x points to the spine, its y backward and its z up on the right;
 * turned by 180 degrees about X on the left. It is the one way in which phi carries the shoulder forward and psi lifts it.
 */
export function fromLinkage(v: Vec, side: Side): Vec {
  const turnedOver = side === "left" ? -1 : 1;
  return [-v[1], turnedOver * v[0], turnedOver * v[2]];
}

/** Where everything is at these motor angles; null where no pose of the scapula has those of motors 1 and 2. */
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

/** Along the forearm from the elbow, in the upper arm's frame. */
export const forearm = (length: number): Vec => {
  const bent = radians(ELBOW_BENT_DEG);
  return [length * Math.sin(bent), 0, -length * Math.cos(bent)];
};

/** How far from its centre each motor's range is drawn, mm: beside each other, none over another. */
const RADIUS_MM = [58, 75, 330, 390, 150] as const;

/** What one motor moves, seen as a point that runs along a curve: where it would be if this motor alone went to an angle. */
export interface Sweep {
  centre: (angle_deg: number) => Vec;
  at: (angle_deg: number) => Vec;
}

/** The curve of each motor, from a posture. Motors 1 and 2: their cranks' ends. 3: the arm, hanging. 4: the arm. 5: the forearm. */
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
      // Where the arm would hang, were it not for motor 4: raised forward, it lies along motor 3's axis, and draws no curve.
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

/** From the shoulder down to the cuff that motor 5 turns. */
export const RING_MM = 150;

function along(from: Vec, to: Vec, length: number): Vec {
  const d: Vec = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
  const factor = length / Math.hypot(...d);
  return plus(from, [d[0] * factor, d[1] * factor, d[2] * factor]);
}
