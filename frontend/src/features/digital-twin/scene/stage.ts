import {
  AmbientLight,
  DirectionalLight,
  HemisphereLight,
  PerspectiveCamera,
  Scene,
  WebGLRenderer,
} from "three";
import type { Limits } from "../limits";
import { motorsOf } from "../linkage";
import { type Angles, type Posture, postureOf } from "../posture";
import type { Side } from "../vectors";
import { eye, lookedAt } from "../view";
import { Labels } from "./labels";
import { Mover } from "./mover";
import { ghostPaint, solidPaint } from "./parts";
import type { Picture } from "./picture";
import { Ranges } from "./ranges";
import { room } from "./room";

const SHARPEST = 1.5;

/** Draws the apparatus on a canvas, when it is told to. */
export class Stage {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(30, 1, 100, 12000);
  readonly #side: Side;
  readonly #real: Mover;
  readonly #ghost: Mover;
  readonly #ranges: Ranges;
  readonly #labels = new Labels();
  readonly #pixel = new Uint8Array(4);
  #size = "";

  /**
   * `density`: pixels of the screen for one of the page.
   * @throws Error where the browser cannot draw in three dimensions.
   */
  constructor(canvas: OffscreenCanvas, side: Side, limits: Limits, density: number) {
    const [context, software] = contextOf(canvas);
    this.#renderer = new WebGLRenderer({ canvas, context });
    // Asking for errors would wait for the graphics' compiler.
    this.#renderer.debug.checkShaderErrors = false;
    this.#renderer.setPixelRatio(software ? 1 : Math.min(density, SHARPEST));
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
  }

  /** Compiled beside what else the graphics draw; where the browser cannot do that, with the first drawing. */
  async prepare() {
    if (this.#renderer.extensions.has("KHR_parallel_shader_compile")) {
      await this.#renderer.compileAsync(this.#scene, this.#camera);
    }
  }

  /** Returns when it has been drawn: how long that took is what the next one is put off by. */
  draw({ width, height, view, only, real: realAngles, ghost: ghostAngles }: Picture) {
    this.#fit(width, height);
    this.#camera.position.set(...eye(view, this.#side));
    this.#camera.lookAt(...lookedAt(this.#side));
    const real = placed(this.#real, realAngles, this.#side);
    const ghost = placed(this.#ghost, ghostAngles, this.#side);
    // The ranges belong to the arm; on a page without one, to the recording's.
    const [angles, posture] = real ? [realAngles, real] : [ghostAngles, ghost];
    const known = angles !== null && posture !== null;
    this.#ranges.group.visible = known;
    this.#labels.group.visible = known;
    if (known) {
      this.#ranges.stand(angles, posture, only);
      this.#labels.stand(posture, only);
    }
    this.#renderer.render(this.#scene, this.#camera);
    // What is drawn elsewhere, and later, is waited for by asking what came of it.
    const gl = this.#renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, this.#pixel);
  }

  #fit(width: number, height: number) {
    const size = `${width} ${height}`;
    if (size === this.#size || width === 0 || height === 0) return;
    this.#size = size;
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
  }
}

/** What browsers call drawing without a graphics card: Chromium, Linux, Windows, Firefox. */
const IN_SOFTWARE = /swiftshader|llvmpipe|softpipe|basic render|software/i;

/**
 * To draw with, and whether that is done in software: then without smooth edges, which cost more than all the rest.
 * @throws Error where the browser cannot draw in three dimensions.
 */
function contextOf(canvas: OffscreenCanvas): [WebGL2RenderingContext, software: boolean] {
  // A context keeps what it was made with, so that another one is asked.
  const software = IN_SOFTWARE.test(drawnBy(begun(new OffscreenCanvas(1, 1), false)));
  return [begun(canvas, !software), software];
}

function begun(canvas: OffscreenCanvas, antialias: boolean): WebGL2RenderingContext {
  const gl = canvas.getContext("webgl2", { alpha: true, antialias });
  if (!gl) throw new Error("this browser draws nothing in three dimensions");
  return gl;
}

function drawnBy(gl: WebGL2RenderingContext): string {
  const told = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(told ? told.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return name;
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
