import type { End, Motor } from "./limits";
import type { ViewName } from "./view";

/** What each motor moves, as a therapist sees it. */
export const MOVES: Record<Motor, string> = {
  1: "Scapula, through the links",
  2: "Scapula, through the links",
  3: "Lifts the arm sideways",
  4: "Swings the arm forward",
  5: "Turns the upper arm",
};

/** The body's angles, in the order of a pose. */
export const BODY = [
  "Scapular abduction",
  "Scapular upward rotation",
  "Shoulder abduction",
  "Shoulder flexion",
  "External rotation",
] as const;

export const VIEW_WORDS: Record<ViewName, string> = {
  corner: "Corner",
  front: "Front",
  side: "Side",
  back: "Back",
  above: "Above",
};

export const AT_END: Record<End, (motor: Motor) => string> = {
  lower: (motor) => `Motor ${motor} is at the lower end of its range.`,
  upper: (motor) => `Motor ${motor} is at the upper end of its range.`,
};

export const NO_ANGLES = "Where the arm is, is not known: it is not drawn.";
export const NO_POSE = "No position of the scapula fits the angles of motors 1 and 2: the arm is not drawn.";
export const NO_3D = "This browser cannot draw in three dimensions. The angles stand beside it in words.";
export const ELBOW = "Body size and elbow are drawn, not measured.";
