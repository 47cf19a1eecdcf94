import { describe, expect, it } from "vitest";
import cases from "./cases.json";
import { motorsOf, scapulaOf } from "./linkage";
import { type Angles, FOREARM_MM, outward, type Posture, postureOf, sweeps, UPPER_ARM_MM } from "./posture";
import { distance, minus, plus, type Side, type Vec } from "./vectors";

const SIDES: Side[] = ["right", "left"];
const mirrored = ([x, y, z]: Vec): Vec => [x, -y, z];

/** Return the posture of the body's angles, as a therapist counts them. */
function at(pose: Angles, side: Side): Posture {
  const motors = motorsOf({ phi_deg: pose[0], psi_deg: pose[1] }, side);
  const posture = motors && postureOf([motors[0], motors[1], pose[2], pose[3], pose[4]], side);
  if (!posture) throw new Error("out of reach");
  return posture;
}

function near(found: Vec, wanted: Vec, within = 1e-6) {
  expect(distance(found, wanted)).toBeLessThan(within);
}

it.each(SIDES)("counts rotation from the forearm straight up when the arm is raised forward: %s", (side) => {
  // The zero of the assessment form (kata/clinic/assessments/rom.py).
  const leaning = (rotation: number) => {
    const { elbow, wrist } = at([0, 0, 0, 90, rotation], side);
    const [, left, up] = minus(wrist, elbow);
    return (Math.atan2(outward(side) * left, up) * 180) / Math.PI;
  };
  for (const rotation of [-80, 0, 25]) expect(leaning(rotation)).toBeCloseTo(rotation, 6);
});

describe("the linkage", () => {
  it.each(cases)("agrees with kata.motion.linkage: $side $pose_deg", ({ side, pose_deg, motors_deg }) => {
    const [phi, psi] = pose_deg as [number, number];
    const [theta1, theta2] = motors_deg as [number, number];
    const motors = motorsOf({ phi_deg: phi, psi_deg: psi }, side as Side);
    expect(motors?.[0]).toBeCloseTo(theta1, 7);
    expect(motors?.[1]).toBeCloseTo(theta2, 7);
    const scapula = scapulaOf(theta1, theta2, side as Side);
    expect(scapula?.phi_deg).toBeCloseTo(phi, 6);
    expect(scapula?.psi_deg).toBeCloseTo(psi, 6);
  });

  it("has no pose for impossible motor angles", () => {
    expect(scapulaOf(170, -170, "right")).toBeNull();
    expect(postureOf([170, -170, 0, 0, 0], "right")).toBeNull();
  });

  it.each(SIDES)("keeps the length of every crank and rod: %s", (side) => {
    for (const phi of [-20, 0, 13, 20]) {
      for (const psi of [-20, -7, 0, 20]) {
        const { links, origin } = at([phi, psi, 0, 0, 0], side);
        expect(distance(links.o1, links.p1)).toBeCloseTo(40, 6);
        expect(distance(links.p1, links.q1)).toBeCloseTo(113, 6);
        expect(distance(links.o2, links.p2)).toBeCloseTo(57, 6);
        expect(distance(links.p2, links.q2)).toBeCloseTo(93, 6);
        expect(distance(origin, links.q1)).toBeCloseTo(96, 6);
        expect(distance(origin, links.q2)).toBeCloseTo(70, 6);
      }
    }
  });

  it.each(SIDES)("turns its board joints with the board: %s", (side) => {
    const rest = at([0, 0, 0, 0, 0], side);
    const moved = at([15, -12, 0, 0, 0], side);
    // The distance between two points that are fixed to the board does not change.
    for (const joint of ["q1", "q2"] as const) {
      const before = distance(rest.links[joint], rest.shoulder);
      expect(distance(moved.links[joint], moved.shoulder)).toBeCloseTo(before, 6);
    }
  });

  it("on the left is the right one turned about X", () => {
    const right = at([9, 5, 0, 0, 0], "right");
    const inside = (posture: Posture, v: Vec) => minus(v, posture.origin);
    // Seen from the apparatus, phi is the same and psi has the opposite sign.
    const left = at([9, -5, 0, 0, 0], "left");
    for (const joint of ["o1", "p1", "q1", "o2", "p2", "q2"] as const) {
      const [x, y, z] = inside(right, right.links[joint]);
      near(inside(left, left.links[joint]), [x, -y, -z]);
    }
  });
});

describe("the arm", () => {
  it.each(cases)("agrees with kata.motion.shoulder: $side $pose_deg", (known) => {
    const posture = at(known.pose_deg as unknown as Angles, known.side as Side);
    const [x, y, z] = known.upper_arm as unknown as Vec;
    near(posture.elbow, plus(posture.shoulder, [UPPER_ARM_MM * x, UPPER_ARM_MM * y, UPPER_ARM_MM * z]), 1e-4);
  });

  it.each(SIDES)("hangs at rest, with the forearm forward: %s", (side) => {
    const { shoulder, elbow, wrist } = at([0, 0, 0, 0, 0], side);
    near(shoulder, [0, outward(side) * 175, 1010]);
    near(elbow, [0, outward(side) * 175, 725]);
    expect(wrist[0]).toBeCloseTo(FOREARM_MM * Math.sin((80 * Math.PI) / 180), 6);
    expect(wrist[1]).toBeCloseTo(outward(side) * 175, 6);
  });

  it.each(SIDES)("abducted by 90 degrees is level and outward: %s", (side) => {
    const { shoulder, elbow } = at([0, 0, 90, 0, 0], side);
    near(minus(elbow, shoulder), [0, outward(side) * UPPER_ARM_MM, 0]);
  });

  it.each(SIDES)("flexed by 90 degrees is level, by 180 upward: %s", (side) => {
    const level = at([0, 0, 0, 90, 0], side);
    near(minus(level.elbow, level.shoulder), [UPPER_ARM_MM, 0, 0]);
    const up = at([0, 0, 0, 180, 0], side);
    near(minus(up.elbow, up.shoulder), [0, 0, UPPER_ARM_MM]);
  });

  it.each(SIDES)("abducted is brought forward by motor 4: %s", (side) => {
    const { shoulder, elbow } = at([0, 0, 90, 90, 0], side);
    near(minus(elbow, shoulder), [UPPER_ARM_MM, 0, 0]);
  });

  it.each(SIDES)("rotated outward moves the hand away from the body: %s", (side) => {
    const out = at([0, 0, 0, 0, 40], side);
    const inside = at([0, 0, 0, 0, -90], side);
    expect(outward(side) * (out.wrist[1] - out.elbow[1])).toBeGreaterThan(100);
    expect(outward(side) * (inside.wrist[1] - inside.elbow[1])).toBeLessThan(-100);
    // Raised forward (3rd position), the hand points up.
    const third = at([0, 0, 0, 90, 0], side);
    expect(third.wrist[2] - third.elbow[2]).toBeGreaterThan(200);
  });

  it.each(SIDES)("follows scapular abduction forward and upward rotation up: %s", (side) => {
    const rest = at([0, 0, 0, 0, 0], side);
    expect(at([15, 0, 0, 0, 0], side).shoulder[0]).toBeGreaterThan(rest.shoulder[0] + 20);
    expect(at([0, 15, 0, 0, 0], side).shoulder[2]).toBeGreaterThan(rest.shoulder[2] + 20);
    const lifted = at([0, 15, 0, 0, 0], side);
    expect(outward(side) * (lifted.elbow[1] - lifted.shoulder[1])).toBeGreaterThan(60);
  });

  it("of the left mirrors the right in every joint", () => {
    for (const { pose_deg } of cases) {
      const right = at(pose_deg as unknown as Angles, "right");
      const left = at(pose_deg as unknown as Angles, "left");
      for (const joint of ["origin", "shoulder", "elbow", "wrist"] as const) {
        near(left[joint], mirrored(right[joint]), 1e-4);
      }
    }
  });
});

describe("a motor's range", () => {
  it.each(SIDES)("passes through the motor's position: %s", (side) => {
    const pose: Angles = [6, -8, 40, 60, -10];
    const posture = at(pose, side);
    const [first, second, third, fourth, fifth] = sweeps(posture);
    const towards = (from: Vec, through: Vec, to: Vec) =>
      distance(from, through) + distance(through, to) - distance(from, to);
    const motors = motorsOf({ phi_deg: pose[0], psi_deg: pose[1] }, side) as [number, number];
    expect(towards(posture.links.o1, posture.links.p1, first?.at(motors[0]) as Vec)).toBeLessThan(1e-6);
    expect(towards(posture.links.o2, posture.links.p2, second?.at(motors[1]) as Vec)).toBeLessThan(1e-6);
    // The point is farther out on the line of the upper arm.
    expect(towards(posture.shoulder, posture.elbow, fourth?.at(pose[3]) as Vec)).toBeLessThan(1e-6);
    const hanging = at([6, -8, 40, 0, 0], side);
    expect(towards(hanging.shoulder, hanging.elbow, third?.at(40) as Vec)).toBeLessThan(1e-6);
    const hand = minus(posture.wrist, posture.elbow);
    const pointing = minus(fifth?.at(-10) as Vec, fifth?.centre(-10) as Vec);
    const down = minus(posture.elbow, posture.shoulder);
    // The point is in one plane with upper arm and forearm.
    const normal: Vec = [
      down[1] * hand[2] - down[2] * hand[1],
      down[2] * hand[0] - down[0] * hand[2],
      down[0] * hand[1] - down[1] * hand[0],
    ];
    expect(
      Math.abs(normal[0] * pointing[0] + normal[1] * pointing[1] + normal[2] * pointing[2]),
    ).toBeLessThan(1e-3);
  });

  it("of motors 3 to 5 on the left mirrors the right", () => {
    const right = sweeps(at([6, 8, 40, 60, -10], "right"));
    const left = sweeps(at([6, 8, 40, 60, -10], "left"));
    for (const motor of [2, 3, 4]) {
      for (const angle of [-20, 0, 35, 120]) {
        near(left[motor]?.at(angle) as Vec, mirrored(right[motor]?.at(angle) as Vec), 1e-4);
      }
    }
  });
});
