import type { Schemas } from "../../lib/api/client";
import { type Angles, type Pose, postureOf } from "../digital-twin/posture";
import { degrees, radians, type Side } from "../digital-twin/vectors";

type Curve = Schemas["RhythmCurve"];
export type SoundMotion = Schemas["SoundMotion"];

/** Bounds of the service (kata.motion.rhythm). */
export const LIMIT_DEG = 20;
const HELD_BACK_DEG = LIMIT_DEG - 0.5;
const SETTLED_DEG = 30;
const AHEAD_DEG = 4;
/** Once the scapula runs ahead, the notice stays until the lead is smaller than this, so that it does not flicker. */
const NO_LONGER_AHEAD_DEG = 3;
const SAME_PLANE_DEG = 20;
const TURN_DEG = 10;
/** The service sends ten states a second. */
const TRAIL = 100;

/** Elevation of the upper arm, upward rotation of the scapula, and plane of elevation (0 at the side, 90 forward). */
export interface ArmPoint {
  elevation_deg: number;
  scapula_deg: number;
  plane_deg: number;
}

/** Return the point of five motor angles, or null if no pose has them. */
export function armPoint(motors: Angles, side: Side): ArmPoint | null {
  const pose = postureOf(motors, side)?.pose_deg;
  return pose ? pointOf(pose) : null;
}

/** Return the point of a pose (kata.motion.shoulder.humerus_direction). */
export function pointOf(pose: Pose): ArmPoint {
  const [phi, psi, abduction, flexion] = pose.map(radians) as [number, number, number, number];
  const lifted = abduction + psi;
  const forward = Math.sin(flexion);
  const outward = Math.cos(flexion) * Math.sin(lifted);
  const up = -Math.cos(flexion) * Math.cos(lifted);
  return {
    elevation_deg: degrees(Math.acos(Math.max(-1, Math.min(1, -up)))),
    scapula_deg: pose[1],
    plane_deg: degrees(
      Math.atan2(
        forward * Math.cos(phi) + outward * Math.sin(phi),
        outward * Math.cos(phi) - forward * Math.sin(phi),
      ),
    ),
  };
}

/** A motion as the page sees it: its last ten seconds, its direction, and its lead over the sound side. */
export interface LiveMotion {
  id: string;
  trail: ArmPoint[];
  direction: Curve["direction"] | null;
  /** The lowest and the highest elevation since the last turn. */
  low_deg: number;
  high_deg: number;
  /** The lead now, degrees; null if it is not known here. */
  lead_deg: number | null;
  ahead: boolean;
  /** The largest lead of the motion above the threshold, and its elevation. */
  largest: { lead_deg: number; elevation_deg: number } | null;
}

const begun = (id: string, point: ArmPoint): LiveMotion => ({
  id,
  trail: [],
  direction: null,
  low_deg: point.elevation_deg,
  high_deg: point.elevation_deg,
  lead_deg: null,
  ahead: false,
  largest: null,
});

/** Return the motion with one more point. Another id begins another motion. */
export function withPoint(
  before: LiveMotion | null,
  point: ArmPoint,
  rhythm: Schemas["RhythmLive"],
  sound: SoundMotion[],
): LiveMotion {
  const id = rhythm.motion_id;
  const motion = before?.id === id ? before : begun(id, point);
  const { direction, low_deg, high_deg } = turned(motion, point.elevation_deg);
  const lead_deg = direction === "raising" ? leadOf(point, rhythm, sound) : null;
  const ahead = lead_deg !== null && lead_deg > (motion.ahead ? NO_LONGER_AHEAD_DEG : AHEAD_DEG);
  const larger = ahead && lead_deg > (motion.largest?.lead_deg ?? AHEAD_DEG);
  return {
    id,
    trail: [...motion.trail, point].slice(-TRAIL),
    direction,
    low_deg,
    high_deg,
    lead_deg,
    ahead,
    largest: larger ? { lead_deg, elevation_deg: point.elevation_deg } : motion.largest,
  };
}

/** A smaller movement than the turn is a hesitation of the hand. */
function turned(motion: LiveMotion, elevation_deg: number) {
  const low_deg = Math.min(motion.low_deg, elevation_deg);
  const high_deg = Math.max(motion.high_deg, elevation_deg);
  if (motion.direction !== "raising" && elevation_deg - low_deg >= TURN_DEG)
    return { direction: "raising" as const, low_deg, high_deg: elevation_deg };
  if (motion.direction !== "lowering" && high_deg - elevation_deg >= TURN_DEG)
    return { direction: "lowering" as const, low_deg: elevation_deg, high_deg };
  return { direction: motion.direction, low_deg, high_deg };
}

/**
 * Return how much farther the scapula has turned than the sound side's at the same elevation while the arm is
 * raised, both since the start of their motion. Return null where the two cannot be compared.
 */
export function leadOf(
  point: ArmPoint,
  start: Pick<Schemas["RhythmLive"], "start_elevation_deg" | "start_scapula_deg">,
  sound: SoundMotion[],
): number | null {
  if (point.elevation_deg < SETTLED_DEG || start.start_elevation_deg > SETTLED_DEG) return null;
  for (const motion of sound) {
    if (motion.start_elevation_deg > SETTLED_DEG) continue;
    const curve = curveLike(motion, "raising", point.plane_deg);
    const scapula_deg = curve && at(curve, point.elevation_deg);
    if (scapula_deg == null) continue;
    // At its limit the apparatus holds the scapula back. A difference there is not caused by the shoulder.
    if (Math.max(scapula_deg, point.scapula_deg) >= HELD_BACK_DEG) return null;
    return point.scapula_deg - start.start_scapula_deg - (scapula_deg - motion.start_scapula_deg);
  }
  return null;
}

/** Return the scapula of a curve at an elevation, or null outside the curve. */
function at({ elevation_deg, scapula_deg }: Curve, elevation: number): number | null {
  const next = elevation_deg.findIndex((one) => one >= elevation);
  const [x1, y1] = [elevation_deg[next], scapula_deg[next]];
  if (x1 === undefined || y1 === undefined) return null;
  const [x0, y0] = [elevation_deg[next - 1], scapula_deg[next - 1]];
  if (x0 === undefined || y0 === undefined) return x1 === elevation ? y1 : null;
  return y0 + ((y1 - y0) * (elevation - x0)) / (x1 - x0);
}

/** Return the curve of a motion in this direction and plane. */
const curveLike = (motion: SoundMotion, direction: Curve["direction"], plane_deg: number) =>
  motion.curves.find(
    (curve) => curve.direction === direction && Math.abs(curve.plane_deg - plane_deg) <= SAME_PLANE_DEG,
  );

/** Return the sound side's curve of the same direction and plane, or null. */
export function soundCurveOf(curve: Curve, sound: SoundMotion[]): Curve | null {
  for (const motion of sound) {
    const found = curveLike(motion, curve.direction, curve.plane_deg);
    if (found) return found;
  }
  return null;
}
