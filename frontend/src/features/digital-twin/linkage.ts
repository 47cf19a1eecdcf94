import geometry from "./geometry.json";
import { degrees, radians, type Side, type Vec } from "./vectors";

/**
 * The scapula's parallel links, with the equations and branch of backend/kata/motion/linkage.py. The lengths are
 * those of the MuJoCo model (geometry.json, written by docs.generate). Tests compare the two with the same cases
 * (cases.json).
 *
 * All points are in the linkage's frame with its origin in O: x and z lie in the board, y is its normal.
 */
type Lengths = (typeof geometry.legs)[number];

function lengths({ oq_mm, w_deg, op_mm, qp_mm, oo_mm }: Lengths) {
  return { oq: oq_mm, w: radians(w_deg), op: op_mm, qp: qp_mm, oo: oo_mm as unknown as Vec };
}

interface Leg {
  oq: number;
  w: number;
  op: number;
  qp: number;
  oo: Vec;
  /** Return the vector from Oi to Pi, the end of the crank, at an angle. */
  crank: (theta: number) => Vec;
  /** Return the coefficients in V of the sine and the cosine of theta. */
  parts: (v: Vec) => [number, number];
}

const [one, two] = geometry.legs as [Lengths, Lengths];
const ONE: Leg = {
  ...lengths(one),
  crank: (t) => [one.op_mm * Math.sin(t), one.op_mm * Math.cos(t), 0],
  parts: (v) => [v[0], v[1]],
};
const TWO: Leg = {
  ...lengths(two),
  crank: (t) => [0, two.op_mm * Math.sin(t), -two.op_mm * Math.cos(t)],
  parts: (v) => [v[1], -v[2]],
};
/** Range of phi and psi in degrees. The search covers slightly more. */
const WITHIN_DEG = 45;
const END = radians(WITHIN_DEG + 1);
/** Tolerance between the given motor angles and those of a found pose. A larger difference means another branch. */
const CLOSED_DEG = 1e-6;
const HALVINGS = 46;

/** Scapular abduction and upward rotation in degrees, with the body's signs. */
export interface Scapula {
  phi_deg: number;
  psi_deg: number;
}

/**
 * The joints of the two legs. O1 and O2 are fixed, P1 and P2 are the crank ends, and Q1 and Q2 are on the
 * board.
 */
export interface LinkPoints {
  o1: Vec;
  p1: Vec;
  q1: Vec;
  o2: Vec;
  p2: Vec;
  q2: Vec;
}

/** The sign of psi. The turned apparatus rolls the scapula in the opposite direction. */
const rollSign = (side: Side) => (side === "left" ? -1 : 1);

const sum = (a: Vec, b: Vec): Vec => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];

function onBoard(leg: Leg, phi: number, psi: number): Vec {
  const out = leg.oq * Math.sin(psi + leg.w);
  return [out * Math.cos(phi), out * Math.sin(phi), leg.oq * Math.cos(psi + leg.w)];
}

/** Return theta in radians on the assembled branch; NaN if the links cannot close. */
function closed(leg: Leg, phi: number, psi: number): number {
  const q = onBoard(leg, phi, psi);
  const v: Vec = [leg.oo[0] - q[0], leg.oo[1] - q[1], leg.oo[2] - q[2]];
  const [a, b] = leg.parts(v);
  const c = (v[0] ** 2 + v[1] ** 2 + v[2] ** 2 + leg.op ** 2 - leg.qp ** 2) / (2 * leg.op);
  const angle = Math.atan2(a, b) + Math.acos(-c / Math.hypot(a, b));
  return angle > Math.PI ? angle - 2 * Math.PI : angle;
}

/** Return the component of OP along OQ when the rod joins P and Q. */
const reach = (leg: Leg, p: Vec) =>
  (p[0] ** 2 + p[1] ** 2 + p[2] ** 2 + leg.oq ** 2 - leg.qp ** 2) / (2 * leg.oq);

/** Return the angles of motors 1 and 2 for a scapula pose, in degrees; null if the links cannot close. */
export function motorsOf(scapula: Scapula, side: Side): [number, number] | null {
  const phi = radians(scapula.phi_deg);
  const psi = radians(rollSign(side) * scapula.psi_deg);
  const found: [number, number] = [degrees(closed(ONE, phi, psi)), degrees(closed(TWO, phi, psi))];
  return found.some(Number.isNaN) ? null : found;
}

/** Return the scapula's pose at these angles of motors 1 and 2, or null if no pose has them. */
export function scapulaOf(theta1_deg: number, theta2_deg: number, side: Side): Scapula | null {
  const p1 = sum(ONE.oo, ONE.crank(radians(theta1_deg)));
  const p2 = sum(TWO.oo, TWO.crank(radians(theta2_deg)));
  const [reach1, reach2] = [reach(ONE, p1), reach(TWO, p2)];
  // Leg 2 gives psi for each phi. The remaining gap is that of leg 1.
  const psiOf = (phi: number) => {
    const out = p2[0] * Math.cos(phi) + p2[1] * Math.sin(phi);
    const stroke = Math.acos(Math.min(1, Math.max(-1, reach2 / Math.hypot(out, p2[2]))));
    return Math.atan2(out, p2[2]) - stroke - TWO.w;
  };
  const gap = (phi: number) => {
    const q = onBoard(ONE, phi, psiOf(phi));
    return (p1[0] * q[0] + p1[1] * q[1] + p1[2] * q[2]) / ONE.oq - reach1;
  };
  let [low, high] = [-END, END];
  const below = Math.sign(gap(low));
  if (below === Math.sign(gap(high))) return null;
  for (let n = 0; n < HALVINGS; n += 1) {
    const middle = (low + high) / 2;
    if (Math.sign(gap(middle)) === below) low = middle;
    else high = middle;
  }
  const phi = (low + high) / 2;
  const scapula = { phi_deg: degrees(phi), psi_deg: rollSign(side) * degrees(psiOf(phi)) };
  if (Math.max(Math.abs(scapula.phi_deg), Math.abs(scapula.psi_deg)) > WITHIN_DEG) return null;
  const back = motorsOf(scapula, side);
  const same =
    back !== null &&
    Math.abs(back[0] - theta1_deg) < CLOSED_DEG &&
    Math.abs(back[1] - theta2_deg) < CLOSED_DEG;
  return same ? scapula : null;
}

/** Return the joints at a scapula pose and these angles of motors 1 and 2, in degrees. */
export function linkPoints(scapula: Scapula, theta1_deg: number, theta2_deg: number, side: Side): LinkPoints {
  const phi = radians(scapula.phi_deg);
  const psi = radians(rollSign(side) * scapula.psi_deg);
  return {
    o1: ONE.oo,
    p1: crankEnd(1, theta1_deg),
    q1: onBoard(ONE, phi, psi),
    o2: TWO.oo,
    p2: crankEnd(2, theta2_deg),
    q2: onBoard(TWO, phi, psi),
  };
}

/** Return a crank's end at an angle. */
export function crankEnd(motor: 1 | 2, theta_deg: number): Vec {
  const leg = motor === 1 ? ONE : TWO;
  return sum(leg.oo, leg.crank(radians(theta_deg)));
}
