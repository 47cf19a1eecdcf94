import { outward } from "./posture";
import { radians, type Side, type Vec } from "./vectors";

/**
 * The camera: azimuth around the patient (0 is in front; positive is towards the patient's left), elevation,
 * and zoom.
 */
export interface View {
  azimuth_deg: number;
  elevation_deg: number;
  near: number;
}
export type ViewName = "corner" | "front" | "side" | "back" | "above";
export const VIEWS: ViewName[] = ["corner", "front", "side", "back", "above"];

const DISTANCE_MM = 2900;
const NEAREST = 3;
const FURTHEST = 0.6;
const STEEPEST_DEG = 89;

/** Return a named view. The views "corner" and "side" are at the treated shoulder. */
export function viewOf(name: ViewName, side: Side): View {
  const out = outward(side);
  switch (name) {
    case "corner":
      return { azimuth_deg: out * 138, elevation_deg: 22, near: 1.45 };
    case "front":
      return { azimuth_deg: out * 18, elevation_deg: 8, near: 1.3 };
    case "side":
      return { azimuth_deg: out * 90, elevation_deg: 6, near: 1.3 };
    case "back":
      return { azimuth_deg: 180, elevation_deg: 10, near: 1.6 };
    case "above":
      return { azimuth_deg: 180, elevation_deg: 80, near: 1.5 };
  }
}

/** Return the view after rotating and zooming, within its bounds. */
export function movedView(view: View, about_deg: number, above_deg: number, zoom = 1): View {
  return {
    azimuth_deg: view.azimuth_deg + about_deg,
    elevation_deg: Math.min(STEEPEST_DEG, Math.max(-20, view.elevation_deg + above_deg)),
    near: Math.min(NEAREST, Math.max(FURTHEST, view.near * zoom)),
  };
}

/** The point that the camera looks at, between the treated shoulder and the head. */
export const lookAtPoint = (side: Side): Vec => [20, outward(side) * 90, 950];

/** Return the camera's position in mm. */
export function cameraPosition(view: View, side: Side): Vec {
  const [x, y, z] = lookAtPoint(side);
  const [about, above] = [radians(view.azimuth_deg), radians(view.elevation_deg)];
  const away = DISTANCE_MM / view.near;
  return [
    x + away * Math.cos(above) * Math.cos(about),
    y + away * Math.cos(above) * Math.sin(about),
    z + away * Math.sin(above),
  ];
}
