import { CylinderGeometry, ExtrudeGeometry, Group, Mesh, type Object3D, Shape, TorusGeometry } from "three";
import {
  FOREARM_MM,
  forearm,
  outward,
  type Posture,
  RING_MM,
  shoulderFromOrigin,
  UPPER_ARM_MM,
} from "../posture";
import { minus, plus, type Side, type Vec } from "../vectors";
import { ball, bar, box, limb, motorBody, type Paint, place, span } from "./parts";

/** The parts that the five motors move: links, board, scapula, and the arm in its cuff. */
export class MovingParts {
  readonly group = new Group();
  readonly #board = new Group();
  readonly #lifted = new Group();
  readonly #swung = new Group();
  readonly #arm = new Group();
  readonly #crank1: Object3D;
  readonly #crank2: Object3D;
  readonly #rod1: Object3D;
  readonly #rod2: Object3D;
  readonly #joints: Object3D[];
  readonly #yoke: Object3D;

  constructor(side: Side, rest: Posture, paint: Paint) {
    this.#crank1 = bar([0, 0, 0], [0, 40, 0], 8, paint.motor(1));
    this.#crank2 = bar([0, 0, 0], [0, 57, 0], 8, paint.motor(2));
    this.#rod1 = bar([0, 0, 0], [0, 113, 0], 5, paint.motor(1));
    this.#rod2 = bar([0, 0, 0], [0, 93, 0], 5, paint.motor(2));
    this.#joints = [1, 2, 3, 4].map(() => ball([0, 0, 0], 10, paint.dark));
    this.#yoke = new Mesh(new CylinderGeometry(46, 50, 1, 16), paint.shirt);
    this.#fillBoard(side, rest, paint);
    this.#fillLifted(side, paint);
    this.#fillSwung(side, paint);
    this.#fillArm(side, paint);
    const links = [this.#crank1, this.#crank2, this.#rod1, this.#rod2, ...this.#joints];
    const neck = ball(yokeFrom(side), 50, paint.shirt);
    this.group.add(this.#board, this.#lifted, this.#swung, this.#arm, ...links, this.#yoke, neck);
    this.setPosture(rest);
  }

  /** Place all parts for a posture. */
  setPosture(posture: Posture) {
    const { links, shoulder, origin } = posture;
    place(this.#board, origin, posture.board);
    place(this.#lifted, shoulder, posture.lifted);
    place(this.#swung, shoulder, posture.swung);
    place(this.#arm, shoulder, posture.arm);
    span(this.#crank1, links.o1, links.p1);
    span(this.#rod1, links.p1, links.q1);
    span(this.#crank2, links.o2, links.p2);
    span(this.#rod2, links.p2, links.q2);
    [links.p1, links.q1, links.p2, links.q2].forEach((at, n) => {
      this.#joints[n]?.position.set(...at);
    });
    span(this.#yoke, yokeFrom(posture.side), shoulder, true);
  }

  /**
   * Build the board in the frame of O: open bars that leave the links visible, the scapula with its plate, and
   * motor 3.
   */
  #fillBoard(side: Side, rest: Posture, paint: Paint) {
    const out = outward(side);
    const shoulder = shoulderFromOrigin(side);
    const [q1, q2] = [minus(rest.links.q1, rest.origin), minus(rest.links.q2, rest.origin)];
    const corner: Vec = [0, out * 96, shoulder[2]];
    const join = (a: Vec, b: Vec) => bar(a, b, 7, paint.metal);
    const behind = plus(shoulder, [-140 + 34, 0, 0]);
    this.#board.add(
      ball([0, 0, 0], 14, paint.dark),
      join([0, 0, 0], q1),
      join([0, 0, 0], q2),
      join(q1, q2),
      join([0, 0, 0], corner),
      join(q2, corner),
      join(corner, behind),
      join([0, out * 40, 4], [56, out * 46, -4]),
      scapula(side, paint),
      box([58, out * 46, -10], [6, 66, 84], paint.plate),
      motorBody(
        behind,
        plus(shoulder, [-84, 0, 0]),
        plus(shoulder, [-62, 0, 0]),
        27,
        paint.motor(3),
        paint.dark,
      ),
    );
  }

  /** Build the part from motor 3 behind the shoulder to motor 4 outside it. */
  #fillLifted(side: Side, paint: Paint) {
    const out = outward(side);
    const three = paint.motor(3);
    this.#lifted.add(
      ball([-70, 0, 0], 13, three),
      bar([-70, 0, 0], [-70, out * 128, 0], 10, three),
      ball([-70, out * 128, 0], 10, three),
      bar([-70, out * 128, 0], [0, out * 128, 0], 10, three),
      motorBody([0, out * 158, 0], [0, out * 104, 0], [0, out * 84, 0], 27, paint.motor(4), paint.dark),
    );
  }

  /** Build the part from motor 4 along the arm to the rail of the cuff, with motor 5 and its pinion. */
  #fillSwung(side: Side, paint: Paint) {
    const out = outward(side);
    const four = paint.motor(4);
    this.#swung.add(
      ball([0, out * 88, 0], 13, four),
      bar([0, out * 88, 0], [0, out * 96, -RING_MM + 10], 10, four),
      box([0, out * 92, -RING_MM], [60, 26, 44], four),
      motorBody(
        [0, out * 112, -RING_MM - 74],
        [0, out * 112, -RING_MM - 20],
        [0, out * 112, -RING_MM],
        21,
        paint.motor(5),
        paint.dark,
      ),
      bar([0, out * 90, -RING_MM - 6], [0, out * 90, -RING_MM + 6], 15, paint.dark),
    );
  }

  /**
   * Build the parts that motor 5 turns: the arm, the cuff with its gear, which is open on one side, and the arm
   * fixer below it.
   */
  #fillArm(side: Side, paint: Paint) {
    const out = outward(side);
    const five = paint.motor(5);
    const elbow: Vec = [0, 0, -UPPER_ARM_MM];
    const wrist = plus(elbow, forearm(FOREARM_MM));
    const palm = plus(elbow, forearm(FOREARM_MM + 62));
    const thumb = plus(elbow, forearm(FOREARM_MM + 40));
    const ring = new Mesh(new TorusGeometry(66, 10, 10, 40, (5 / 3) * Math.PI), five);
    ring.position.z = -RING_MM;
    ring.rotation.z = Math.PI / 6;
    const fixer = new Mesh(new CylinderGeometry(54, 52, 62, 24, 1, true), five);
    fixer.rotation.x = Math.PI / 2;
    fixer.position.z = -RING_MM - 44;
    this.#arm.add(
      ball([0, 0, 0], 62, paint.shirt),
      limb([0, 0, -10], [0, 0, -130], 50, paint.sleeve),
      limb([0, 0, -60], elbow, 42, paint.skin),
      limb(elbow, wrist, 34, paint.skin),
      ring,
      fixer,
      bar([40, 0, -RING_MM], [40, 0, -RING_MM - 60], 8, five),
      bar([-40, 0, -RING_MM], [-40, 0, -RING_MM - 60], 8, five),
      // The edge of the hand points down, the thumb up and inward.
      limb(wrist, palm, 26, paint.skin),
      limb(thumb, plus(thumb, [18, -out * 12, 44]), 11, paint.skin),
      limb(palm, plus(palm, forearm(56)), 19, paint.skin),
    );
  }
}

/** Return the point between neck and shoulder where the shirt's yoke begins. */
const yokeFrom = (side: Side): Vec => [10, outward(side) * 62, 1036];

/** Return the shoulder blade on the back, between board and ribs, in the frame of O. */
function scapula(side: Side, paint: Paint): Object3D {
  const out = outward(side);
  const outline = new Shape();
  // Medial border, inferior angle, neck and acromion; x is outward, y is up.
  const points = [
    [6, 44],
    [2, 10],
    [26, -104],
    [40, -110],
    [84, -6],
    [116, 22],
    [104, 44],
    [60, 30],
    [28, 54],
  ] as const;
  points.forEach(([across, up], n) => {
    if (n === 0) outline.moveTo(out * across, up);
    else outline.lineTo(out * across, up);
  });
  outline.closePath();
  const geometry = new ExtrudeGeometry(outline, { depth: 9, bevelEnabled: false });
  // Drawn in x and y with its thickness along z, then turned to y and z with its thickness along x.
  geometry.rotateX(Math.PI / 2);
  geometry.rotateZ(Math.PI / 2);
  const mesh = new Mesh(geometry, paint.bone);
  mesh.position.x = 50;
  return mesh;
}
