import { CanvasTexture, Group, Sprite, SpriteMaterial, SRGBColorSpace } from "three";
import type { SceneColours } from "../colours";
import { MOTORS, type Motor } from "../limits";
import { fromLinkage, outward, type Posture, RING_MM } from "../posture";
import { plus, turned, type Vec } from "../vectors";

const PIXELS = 64;
const SIZE_MM = 58;

/** The numbers beside the motors. A part that is in front of a motor also hides the motor's number. */
export class Labels {
  readonly group = new Group();
  readonly #sprites: Sprite[];

  constructor() {
    this.#sprites = MOTORS.map(() => {
      const sprite = new Sprite(new SpriteMaterial({ transparent: true, alphaTest: 0.1 }));
      sprite.scale.setScalar(SIZE_MM);
      this.group.add(sprite);
      return sprite;
    });
  }

  setColours(colours: SceneColours) {
    for (const motor of MOTORS) {
      const material = this.#sprites[motor - 1]?.material;
      material?.map?.dispose();
      if (material) material.map = number(motor, colours);
    }
  }

  setPosture(posture: Posture, only: Motor | null) {
    const out = outward(posture.side);
    const fixed = (v: Vec) => plus(posture.origin, fromLinkage(v, posture.side));
    const places: Vec[] = [
      fixed([-14, 44, -122]),
      fixed([120, 0, -128]),
      plus(posture.shoulder, turned(posture.board, [-124, 0, 46])),
      plus(posture.shoulder, turned(posture.lifted, [-10, out * 196, 24])),
      plus(posture.shoulder, turned(posture.swung, [0, out * 172, -RING_MM - 50])),
    ];
    for (const motor of MOTORS) {
      const [sprite, at] = [this.#sprites[motor - 1], places[motor - 1]];
      if (!sprite || !at) continue;
      sprite.position.set(...at);
      sprite.material.opacity = only === null || only === motor ? 1 : 0.25;
    }
  }
}

/** Return a motor's number in a disc of the motor's colour. */
function number(motor: Motor, { motors, onMotor }: SceneColours): CanvasTexture<OffscreenCanvas> {
  const canvas = new OffscreenCanvas(PIXELS, PIXELS);
  const draw = canvas.getContext("2d");
  if (draw) {
    draw.beginPath();
    draw.arc(PIXELS / 2, PIXELS / 2, PIXELS / 2 - 3, 0, 2 * Math.PI);
    draw.fillStyle = motors[motor];
    draw.fill();
    draw.lineWidth = 4;
    draw.strokeStyle = onMotor;
    draw.stroke();
    draw.fillStyle = onMotor;
    draw.font = "bold 42px sans-serif";
    draw.textAlign = "center";
    draw.textBaseline = "middle";
    draw.fillText(String(motor), PIXELS / 2, PIXELS / 2 + 3);
  }
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return texture;
}
