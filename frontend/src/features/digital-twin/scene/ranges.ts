import { Group, InstancedMesh, MeshBasicMaterial, Object3D, SphereGeometry } from "three";
import type { SceneColours } from "../colours";
import { type Limits, limitsReached, MOTORS, type Motor } from "../limits";
import type { Angles, Posture } from "../posture";
import { sweeps } from "../posture";

const STEPS = 24;
/** Radii in mm of a dot on the curve, of a limit, of a reached limit, and of the motor's position. */
const DOT = 5;
const END = 12;
const REACHED = 22;
const NOW = 15;
/** Scale of the dots of motors 1 and 2, because these motors turn short cranks. */
const SMALL = 0.45;

/** Draws the motors' ranges as dotted curves between the limits, with a larger dot at the motor's position. */
export class Ranges {
  readonly group = new Group();
  readonly #dots: InstancedMesh<SphereGeometry, MeshBasicMaterial>[];
  readonly #limits: Limits;
  readonly #place = new Object3D();

  constructor(limits: Limits) {
    this.#limits = limits;
    const ball = new SphereGeometry(1, 10, 8);
    this.#dots = MOTORS.map(() => {
      const dots = new InstancedMesh(ball, new MeshBasicMaterial(), STEPS + 2);
      dots.frustumCulled = false;
      this.group.add(dots);
      return dots;
    });
  }

  setColours({ motors }: SceneColours) {
    for (const motor of MOTORS) this.#dots[motor - 1]?.material.color.set(motors[motor]);
  }

  setPosture(angles: Angles, posture: Posture, only: Motor | null) {
    const curves = sweeps(posture);
    const ends = limitsReached(angles, this.#limits);
    for (const motor of MOTORS) {
      const axis = motor - 1;
      const [dots, range, curve] = [this.#dots[axis], this.#limits[axis], curves[axis]];
      if (!dots || !range || !curve) continue;
      const scale = motor <= 2 ? SMALL : 1;
      dots.visible = only === null || only === motor;
      if (!dots.visible) continue;
      for (let n = 0; n <= STEPS; n += 1) {
        const end = n === 0 ? "lower" : n === STEPS ? "upper" : null;
        const size = end === null ? DOT : ends[axis] === end ? REACHED : END;
        this.#put(
          dots,
          n,
          curve.at(range.min_deg + (n / STEPS) * (range.max_deg - range.min_deg)),
          scale * size,
        );
      }
      this.#put(dots, STEPS + 1, curve.at(angles[axis] as number), scale * NOW);
      dots.instanceMatrix.needsUpdate = true;
    }
  }

  #put(dots: InstancedMesh, n: number, at: readonly [number, number, number], size: number) {
    this.#place.position.set(...at);
    this.#place.scale.setScalar(size);
    this.#place.updateMatrix();
    dots.setMatrixAt(n, this.#place.matrix);
  }
}
