import type { Motor } from "./limits";

/** Parts of the apparatus and the patient that have a colour of their own. */
export const PARTS = [
  "skin",
  "shirt",
  "sleeve",
  "hair",
  "eye",
  "bone",
  "metal",
  "dark",
  "plate",
  "cloth",
] as const;
export type Part = (typeof PARTS)[number];

/** The computed colour scheme of the page. */
export type Scheme = "light" | "dark";

/** The colours of the drawing in one scheme. */
export interface SceneColours {
  /** The colour of each motor and of the part that it moves. */
  motors: Record<Motor, string>;
  /** A motor's number on the motor's colour. */
  onMotor: string;
  /** The ghost has the colour of a setpoint. */
  ghost: string;
  /** The background behind the drawing, from top to bottom. */
  background: [string, string];
  parts: Record<Part, string>;
}

/** Red, yellow and cyan are reserved for alarms. */
export const SCENE_COLOURS: Record<Scheme, SceneColours> = {
  light: {
    motors: { 1: "#5b4fc7", 2: "#a2458f", 3: "#a85512", 4: "#5f6b14", 5: "#2f7d4f" },
    onMotor: "#ffffff",
    ghost: "#2f4fd0",
    background: ["#f1f3f5", "#dee2e6"],
    parts: {
      skin: "#d8b194",
      shirt: "#a9b6c9",
      sleeve: "#94a4bb",
      hair: "#4a4039",
      eye: "#3c434b",
      bone: "#efe6d2",
      metal: "#aab2bb",
      dark: "#3c434b",
      plate: "#f7f8fa",
      cloth: "#5d6b80",
    },
  },
  dark: {
    motors: { 1: "#978ef0", 2: "#d585c4", 3: "#d98c4c", 4: "#9aa94c", 5: "#63b586" },
    onMotor: "#141414",
    ghost: "#9db2ff",
    background: ["#17181b", "#25272c"],
    parts: {
      skin: "#c8a389",
      shirt: "#8391a8",
      sleeve: "#73829b",
      hair: "#5f5349",
      eye: "#25272c",
      bone: "#cfc6b2",
      metal: "#9aa3ad",
      dark: "#7a838e",
      plate: "#c9cdd3",
      cloth: "#7a879b",
    },
  },
};
