import {
  BoxGeometry,
  CapsuleGeometry,
  CylinderGeometry,
  Group,
  LatheGeometry,
  type Material,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  type Object3D,
  SphereGeometry,
  Vector2,
  Vector3,
} from "three";
import { PARTS, type Part, type SceneColours } from "../colours";
import { MOTORS, type Motor } from "../limits";
import type { Rotation, Vec } from "../vectors";

/** The materials of all parts. A ghost has only one material, so that users do not mistake it for the patient. */
export interface Paint extends Record<Part, MeshLambertMaterial> {
  motor: (motor: Motor) => MeshLambertMaterial;
}

/** Return a paint with a material for each part. `setColours` gives them their colours. */
export function solidPaint(): Paint {
  const motors = MOTORS.map(() => new MeshLambertMaterial());
  return paintOf(
    () => new MeshLambertMaterial(),
    (motor) => motors[motor - 1] as MeshLambertMaterial,
  );
}

export function ghostPaint(): Paint {
  const ghost = new MeshLambertMaterial({ transparent: true, opacity: 0.32, depthWrite: false });
  return paintOf(
    () => ghost,
    () => ghost,
  );
}

function paintOf(part: () => MeshLambertMaterial, motor: Paint["motor"]): Paint {
  const parts = Object.fromEntries(PARTS.map((name) => [name, part()])) as Record<Part, MeshLambertMaterial>;
  return { ...parts, motor };
}

/** Give a solid paint and a ghost's paint the colours of a scheme. */
export function setColours(solid: Paint, ghost: Paint, colours: SceneColours) {
  for (const part of PARTS) solid[part].color.set(colours.parts[part]);
  for (const motor of MOTORS) solid.motor(motor).color.set(colours.motors[motor]);
  ghost.dark.color.set(colours.ghost);
}

const UP = new Vector3(0, 1, 0);

/** Place an object that lies along its own y axis between two points. */
export function span(thing: Object3D, from: Vec, to: Vec, stretch = false) {
  const [a, b] = [new Vector3(...from), new Vector3(...to)];
  const way = b.clone().sub(a);
  thing.position.copy(a).addScaledVector(way, 0.5);
  if (stretch) thing.scale.set(1, way.length(), 1);
  thing.quaternion.setFromUnitVectors(UP, way.normalize());
}

/** Return a round bar between two points. */
export function bar(from: Vec, to: Vec, radius: number, paint: Material, thinner = radius): Mesh {
  const length = new Vector3(...from).distanceTo(new Vector3(...to));
  const mesh = new Mesh(new CylinderGeometry(thinner, radius, length, 14), paint);
  span(mesh, from, to);
  return mesh;
}

/** Return a limb: a bar with round ends at the two points. */
export function limb(from: Vec, to: Vec, radius: number, paint: Material): Mesh {
  const length = new Vector3(...from).distanceTo(new Vector3(...to));
  const mesh = new Mesh(new CapsuleGeometry(radius, length, 6, 16), paint);
  span(mesh, from, to);
  return mesh;
}

export function ball(at: Vec, radius: number, paint: Material, shape: Vec = [1, 1, 1]): Mesh {
  const mesh = new Mesh(new SphereGeometry(radius, 20, 14), paint);
  mesh.position.set(...at);
  mesh.scale.set(...shape);
  return mesh;
}

export function box(at: Vec, size: Vec, paint: Material): Mesh {
  const mesh = new Mesh(new BoxGeometry(...size), paint);
  mesh.position.set(...at);
  return mesh;
}

/** Return a body of revolution about z, given by radii at heights and flattened from front to back. */
export function round(profile: [radius: number, z: number][], flat: number, paint: Material): Mesh {
  const points = profile.map(([radius, z]) => new Vector2(radius, z));
  const geometry = new LatheGeometry(points, 32);
  geometry.rotateX(Math.PI / 2);
  geometry.scale(flat, 1, 1);
  geometry.computeVertexNormals();
  return new Mesh(geometry, paint);
}

/** Return a motor: a round body and its shaft. */
export function motorBody(
  from: Vec,
  to: Vec,
  shaft: Vec,
  radius: number,
  paint: Material,
  dark: Material,
): Group {
  const group = new Group();
  group.add(bar(from, to, radius, paint), bar(to, shaft, 7, dark));
  return group;
}

/** Set the position and rotation of a group. */
export function place(group: Group, at: Vec, turn: Rotation) {
  const [x, y, z] = turn;
  group.matrixAutoUpdate = false;
  group.matrix = new Matrix4().set(...x, at[0], ...y, at[1], ...z, at[2], 0, 0, 0, 1);
  group.matrixWorldNeedsUpdate = true;
}
