import type { Motor } from "./limits";

/** Each motor, and what it alone moves. Red, yellow and cyan are kept for alarms. */
export const MOTOR_COLOURS: Record<Motor, string> = {
  1: "#5b4fc7",
  2: "#a2458f",
  3: "#a85512",
  4: "#5f6b14",
  5: "#2f7d4f",
};
/** What is meant to happen has the colour of a setpoint. */
export const GHOST = "#2f4fd0";
