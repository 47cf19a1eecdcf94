import type { Motor } from "./limits";

/** The colour of each motor and of the part that it moves. Red, yellow and cyan are reserved for alarms. */
export const MOTOR_COLOURS: Record<Motor, string> = {
  1: "#5b4fc7",
  2: "#a2458f",
  3: "#a85512",
  4: "#5f6b14",
  5: "#2f7d4f",
};
/** The ghost has the colour of a setpoint. */
export const GHOST = "#2f4fd0";
