import { Group } from "three";
import { fromLinkage, originOf, outward } from "../posture";
import { plus, type Side, type Vec } from "../vectors";
import { ball, bar, box, limb, motorBody, type Paint, round } from "./parts";

/**
 * Return the parts that do not move: the patient on the chair, and the apparatus's pole, frame and motors 1 and
 * 2.
 */
export function surroundings(side: Side, paint: Paint): Group {
  const group = new Group();
  group.add(patient(side, paint), chair(paint), frame(side, paint));
  return group;
}

function patient(side: Side, paint: Paint): Group {
  const group = new Group();
  const torso = round(
    [
      [1, 440],
      [150, 445],
      [178, 500],
      [158, 600],
      [146, 690],
      [152, 790],
      [164, 890],
      [165, 960],
      [152, 1010],
      [118, 1045],
      [72, 1072],
      [52, 1090],
      [1, 1092],
    ],
    0.62,
    paint.shirt,
  );
  torso.position.x = 26;
  group.add(torso, bar([18, 0, 1060], [30, 0, 1150], 52, paint.skin, 48));
  // The head has a face, so that front and back differ.
  group.add(
    ball([44, 0, 1215], 84, paint.skin, [1.08, 0.88, 1.28]),
    ball([28, 0, 1238], 88, paint.hair, [1.04, 0.92, 1.2]),
    ball([136, 0, 1200], 14, paint.skin, [1.2, 0.8, 1.3]),
    ball([124, 30, 1228], 8, paint.eye),
    ball([124, -30, 1228], 8, paint.eye),
    ball([36, 78, 1208], 20, paint.skin, [0.8, 0.5, 1.3]),
    ball([36, -78, 1208], 20, paint.skin, [0.8, 0.5, 1.3]),
  );
  for (const y of [-92, 92]) {
    group.add(
      limb([30, y, 520], [430, y * 1.15, 500], 72, paint.cloth),
      limb([430, y * 1.15, 500], [440, y * 1.15, 90], 50, paint.cloth),
      box([490, y * 1.15, 35], [240, 84, 66], paint.dark),
    );
  }
  // The other arm rests on the thigh.
  const other = -outward(side);
  const [shoulder, elbow, hand]: Vec[] = [
    [0, other * 175, 1010],
    [10, other * 222, 735],
    [235, other * 120, 600],
  ] as [Vec, Vec, Vec];
  group.add(
    limb([0, other * 70, 1048], shoulder as Vec, 46, paint.shirt),
    ball(shoulder as Vec, 62, paint.shirt),
    limb(shoulder as Vec, elbow as Vec, 44, paint.sleeve),
    limb(elbow as Vec, hand as Vec, 34, paint.skin),
    ball([282, other * 108, 585], 40, paint.skin, [1.3, 0.9, 0.6]),
  );
  return group;
}

function chair(paint: Paint): Group {
  const group = new Group();
  group.add(
    box([110, 0, 425], [460, 430, 40], paint.dark),
    bar([60, 0, 60], [60, 0, 410], 32, paint.metal),
    box([60, 0, 30], [520, 520, 40], paint.metal),
  );
  return group;
}

function frame(side: Side, paint: Paint): Group {
  const group = new Group();
  const origin = originOf(side);
  const at = (v: Vec): Vec => plus(origin, fromLinkage(v, side));
  const strut = (a: Vec, b: Vec, radius = 8) => bar(at(a), at(b), radius, paint.metal);
  // Motor 1 turns about the linkage's z, motor 2 about its x.
  group.add(
    motorBody(at([-10, 20, -90]), at([-10, 20, -26]), at([-10, 20, -2]), 23, paint.motor(1), paint.dark),
    motorBody(at([128, -47, -55]), at([70, -47, -55]), at([46, -47, -55]), 23, paint.motor(2), paint.dark),
    strut([-10, 44, -70], [-10, 130, -70], 10),
    strut([110, -30, -70], [110, 130, -70], 10),
    strut([0, 130, 36], [0, 10, 10], 8),
  );
  // The pole is on the other side and the motor mounts are open, so that the links are visible from behind.
  const [x, y, z] = at([66, 134, -20]);
  const pole: Vec = [-430, -outward(side) * 230, 0];
  const beam = (a: Vec, b: Vec, radius: number) => bar(a, b, radius, paint.metal);
  group.add(
    strut([-10, 130, -70], [110, 130, -70], 9),
    strut([0, 130, 36], [110, 130, -70], 8),
    // The pin about which the apparatus is turned to set it up for the other shoulder.
    bar([x + 10, y, z], [x - 50, y, z], 22, paint.dark),
    beam([x - 40, y, z], [pole[0], pole[1], z], 15),
    beam([pole[0], pole[1], 40], [pole[0], pole[1], 1820], 24),
    box([-210, pole[1], 22], [560, 70, 30], paint.metal),
    box([-430, pole[1] * 0.3, 22], [70, 520, 30], paint.metal),
    // The tool balancer carries the weight while the power is off.
    beam([pole[0], pole[1], 1800], [x, y, 1800], 14),
    bar([x, y - 22, 1745], [x, y + 22, 1745], 46, paint.dark),
    bar([x, y, 1745], [x, y, z], 3, paint.dark),
  );
  return group;
}
