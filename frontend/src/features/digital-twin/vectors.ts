/** A position or direction in the room, millimetres: x forward from the patient, y to the patient's left, z up. */
export type Vec = readonly [number, number, number];
/** A rotation matrix, by rows. */
export type Rotation = readonly [Vec, Vec, Vec];
export type Side = "left" | "right";

export const radians = (deg: number) => (deg * Math.PI) / 180;
export const degrees = (rad: number) => (rad * 180) / Math.PI;

export const plus = (a: Vec, b: Vec): Vec => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const minus = (a: Vec, b: Vec): Vec => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const dot = (a: Vec, b: Vec) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const distance = (a: Vec, b: Vec) => Math.sqrt(dot(minus(a, b), minus(a, b)));

/** Return the rotated vector. */
export const turned = (by: Rotation, v: Vec): Vec => [dot(by[0], v), dot(by[1], v), dot(by[2], v)];

const column = (of: Rotation, n: 0 | 1 | 2): Vec => [of[0][n], of[1][n], of[2][n]];

/** Return the rotation that applies `right` first, then `left`. */
export function after(left: Rotation, right: Rotation): Rotation {
  const row = (of: Vec): Vec => [
    dot(of, column(right, 0)),
    dot(of, column(right, 1)),
    dot(of, column(right, 2)),
  ];
  return [row(left[0]), row(left[1]), row(left[2])];
}

/** Return a right-handed rotation about an axis of the room. */
export function about(axis: "x" | "y" | "z", rad: number): Rotation {
  const [c, s] = [Math.cos(rad), Math.sin(rad)];
  switch (axis) {
    case "x":
      return [
        [1, 0, 0],
        [0, c, -s],
        [0, s, c],
      ];
    case "y":
      return [
        [c, 0, s],
        [0, 1, 0],
        [-s, 0, c],
      ];
    case "z":
      return [
        [c, -s, 0],
        [s, c, 0],
        [0, 0, 1],
      ];
  }
}
