import {
  AmbientLight,
  DirectionalLight,
  type Group,
  HemisphereLight,
  type Material,
  Mesh,
  type Object3D,
  PerspectiveCamera,
  Scene,
  Sprite,
  WebGLRenderer,
} from "three";
import type { Limits, Motor } from "../limits";
import { motorsOf } from "../linkage";
import { type Angles, type Posture, postureOf } from "../posture";
import type { Side } from "../vectors";
import { eye, lookedAt, type View } from "../view";
import { Labels } from "./labels";
import { Mover } from "./mover";
import { ghostPaint, solidPaint } from "./parts";
import { Ranges } from "./ranges";
import { room } from "./room";

const SHARPEST = 1.5;

/** Draws the apparatus on a canvas, once for each change and not more often than the screen shows. */
export class Stage {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(30, 1, 100, 12000);
  readonly #side: Side;
  readonly #real: Mover;
  readonly #ghost: Mover;
  readonly #ranges: Ranges;
  readonly #labels = new Labels();
  #angles: Angles | null = null;
  #ghostAngles: Angles | null = null;
  #only: Motor | null = null;
  #frame: number | null = null;
  #ready = false;
  #gone = false;

  /** @throws Error where the browser cannot draw in three dimensions. */
  constructor(canvas: HTMLCanvasElement, side: Side, limits: Limits) {
    this.#renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    // Asking for errors would wait for the graphics' compiler, and with it Stop.
    this.#renderer.debug.checkShaderErrors = false;
    this.#renderer.setPixelRatio(Math.min(window.devicePixelRatio, SHARPEST));
    this.#side = side;
    const paint = solidPaint();
    const rest = restingPosture(side);
    this.#real = new Mover(side, rest, paint);
    this.#ghost = new Mover(side, rest, ghostPaint());
    this.#ranges = new Ranges(limits);
    this.#camera.up.set(0, 0, 1);
    const sun = new DirectionalLight("#ffffff", 1.6);
    sun.position.set(1200, side === "left" ? 1500 : -1500, 2600);
    const back = new DirectionalLight("#ffffff", 1.1);
    back.position.set(-2200, side === "left" ? 900 : -900, 1500);
    this.#scene.add(
      new HemisphereLight("#ffffff", "#8a8f98", 1.3),
      new AmbientLight("#ffffff", 0.25),
      sun,
      back,
    );
    this.#scene.add(room(side, paint), this.#real.group, this.#ghost.group);
    this.#scene.add(this.#ranges.group, this.#labels.group);
    // Compiled beside the page, which answers meanwhile; where the browser cannot do that, with the first drawing.
    const beside = this.#renderer.extensions.has("KHR_parallel_shader_compile");
    const compiled = beside ? this.#renderer.compileAsync(this.#scene, this.#camera) : Promise.resolve();
    void compiled.then(() => {
      this.#ready = true;
      if (!this.#gone) this.#later();
    });
  }

  /** Where the arm is; null while nobody knows: then no arm is drawn. */
  show(angles: Angles | null) {
    this.#angles = angles;
    this.#later();
  }

  /** Where a recording has it. */
  haunt(angles: Angles | null) {
    this.#ghostAngles = angles;
    this.#later();
  }

  /** Only this motor's range, and its number before the others. */
  single(motor: Motor | null) {
    this.#only = motor;
    this.#later();
  }

  look(view: View) {
    this.#camera.position.set(...eye(view, this.#side));
    this.#camera.lookAt(...lookedAt(this.#side));
    this.#later();
  }

  resize(width: number, height: number) {
    if (width === 0 || height === 0) return;
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.#later();
  }

  /** Give everything back; nothing is drawn afterwards. */
  dispose() {
    this.#gone = true;
    if (this.#frame !== null) cancelAnimationFrame(this.#frame);
    this.#scene.traverse(forget);
    this.#renderer.dispose();
    this.#renderer.forceContextLoss();
  }

  #later() {
    if (!this.#ready) return;
    this.#frame ??= requestAnimationFrame(() => {
      this.#frame = null;
      this.#draw();
    });
  }

  #draw() {
    const real = placed(this.#real, this.#angles, this.#side);
    const ghost = placed(this.#ghost, this.#ghostAngles, this.#side);
    // The ranges belong to the arm; on a page without one, to the recording's.
    const [angles, posture] = real ? [this.#angles, real] : [this.#ghostAngles, ghost];
    const known = angles !== null && posture !== null;
    this.#ranges.group.visible = known;
    this.#labels.group.visible = known;
    if (known) {
      this.#ranges.stand(angles, posture, this.#only);
      this.#labels.stand(posture, this.#only);
    }
    this.#renderer.render(this.#scene, this.#camera);
  }
}

function placed(mover: Mover, angles: Angles | null, side: Side): Posture | null {
  const posture = angles && postureOf(angles, side);
  mover.group.visible = posture !== null;
  if (posture) mover.stand(posture);
  return posture;
}

function restingPosture(side: Side): Posture {
  const motors = motorsOf({ phi_deg: 0, psi_deg: 0 }, side);
  const rest = motors && postureOf([...motors, 0, 0, 0], side);
  if (!rest) throw new Error("the links do not close in the middle");
  return rest;
}

function forget(thing: Object3D | Group) {
  if (!(thing instanceof Mesh || thing instanceof Sprite)) return;
  thing.geometry.dispose();
  for (const material of [thing.material].flat() as Material[]) {
    if ("map" in material && material.map) (material.map as { dispose: () => void }).dispose();
    material.dispose();
  }
}
