import {
  AmbientLight,
  DirectionalLight,
  HemisphereLight,
  PerspectiveCamera,
  Scene,
  WebGLRenderer,
} from "three";
import { cameraPosition, lookAtPoint } from "../camera";
import { SCENE_COLOURS, type Scheme } from "../colours";
import type { Limits } from "../limits";
import { motorsOf } from "../linkage";
import { type Angles, type Posture, postureOf } from "../posture";
import type { Side } from "../vectors";
import { Labels } from "./labels";
import { MovingParts } from "./movingParts";
import { ghostPaint, setColours, solidPaint } from "./parts";
import type { Picture } from "./picture";
import { Ranges } from "./ranges";
import { surroundings } from "./surroundings";

const SHARPEST = 1.5;

/** Draws the apparatus on a canvas on request. */
export class Stage {
  /** True without a graphics card. */
  readonly inSoftware: boolean;
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(30, 1, 100, 12000);
  readonly #side: Side;
  readonly #real: MovingParts;
  readonly #ghost: MovingParts;
  readonly #ranges: Ranges;
  readonly #labels = new Labels();
  readonly #pixel = new Uint8Array(4);
  readonly #solid = solidPaint();
  readonly #transparent = ghostPaint();
  #size = "";
  #scheme: Scheme | null = null;

  /**
   * `density`: screen pixels per page pixel.
   * @throws Error if the browser cannot draw in 3D.
   */
  constructor(canvas: OffscreenCanvas, side: Side, limits: Limits, density: number) {
    const [context, software] = contextOf(canvas);
    this.inSoftware = software;
    this.#renderer = new WebGLRenderer({ canvas, context });
    // Checking for errors would wait for the shader compiler.
    this.#renderer.debug.checkShaderErrors = false;
    this.#renderer.setPixelRatio(software ? 1 : Math.min(density, SHARPEST));
    this.#side = side;
    const rest = restingPosture(side);
    this.#real = new MovingParts(side, rest, this.#solid);
    this.#ghost = new MovingParts(side, rest, this.#transparent);
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
    this.#scene.add(surroundings(side, this.#solid), this.#real.group, this.#ghost.group);
    this.#scene.add(this.#ranges.group, this.#labels.group);
    this.#setScheme("light");
  }

  /** Compile the shaders in parallel if the browser can; otherwise the first drawing compiles them. */
  async prepare() {
    if (this.#renderer.extensions.has("KHR_parallel_shader_compile")) {
      await this.#renderer.compileAsync(this.#scene, this.#camera);
    }
  }

  /** Draw a picture. Returns when it is drawn, because the duration sets the pause before the next picture. */
  draw({ width, height, view, scheme, only, real: realAngles, ghost: ghostAngles }: Picture) {
    this.#fit(width, height);
    this.#setScheme(scheme);
    this.#camera.position.set(...cameraPosition(view, this.#side));
    this.#camera.lookAt(...lookAtPoint(this.#side));
    const real = placed(this.#real, realAngles, this.#side);
    const ghost = placed(this.#ghost, ghostAngles, this.#side);
    // The ranges are drawn for the real arm, or for the recording's arm if there is no real one.
    const [angles, posture] = real ? [realAngles, real] : [ghostAngles, ghost];
    const known = angles !== null && posture !== null;
    this.#ranges.group.visible = known;
    this.#labels.group.visible = known;
    if (known) {
      this.#ranges.setPosture(angles, posture, only);
      this.#labels.setPosture(posture, only);
    }
    this.#renderer.render(this.#scene, this.#camera);
    // Reading a pixel waits until the graphics process has drawn.
    const gl = this.#renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, this.#pixel);
  }

  #setScheme(scheme: Scheme) {
    if (scheme === this.#scheme) return;
    this.#scheme = scheme;
    const colours = SCENE_COLOURS[scheme];
    setColours(this.#solid, this.#transparent, colours);
    this.#ranges.setColours(colours);
    this.#labels.setColours(colours);
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

/** Names of software renderers in Chromium, Linux, Windows and Firefox. */
const IN_SOFTWARE = /swiftshader|llvmpipe|softpipe|basic render|software/i;

/**
 * Return the drawing context, and whether it draws in software. In software there is no antialiasing, because
 * it would cost more than all other work.
 * @throws Error if the browser cannot draw in 3D.
 */
function contextOf(canvas: OffscreenCanvas): [WebGL2RenderingContext, software: boolean] {
  // A context's antialiasing cannot be changed, so a separate context is used to find out the renderer.
  const software = IN_SOFTWARE.test(rendererName(newContext(new OffscreenCanvas(1, 1), false)));
  return [newContext(canvas, !software), software];
}

function newContext(canvas: OffscreenCanvas, antialias: boolean): WebGL2RenderingContext {
  const gl = canvas.getContext("webgl2", { alpha: true, antialias });
  if (!gl) throw new Error("this browser cannot draw in 3D");
  return gl;
}

function rendererName(gl: WebGL2RenderingContext): string {
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return name;
}

function placed(parts: MovingParts, angles: Angles | null, side: Side): Posture | null {
  const posture = angles && postureOf(angles, side);
  parts.group.visible = posture !== null;
  if (posture) parts.setPosture(posture);
  return posture;
}

function restingPosture(side: Side): Posture {
  const motors = motorsOf({ phi_deg: 0, psi_deg: 0 }, side);
  const rest = motors && postureOf([...motors, 0, 0, 0], side);
  if (!rest) throw new Error("the links do not close at the middle pose");
  return rest;
}
