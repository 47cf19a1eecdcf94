import { Group } from "@mantine/core";
import type { ReactNode } from "react";
import classes from "./ui.module.css";

/**
 * The buttons that end a step. If the step is longer than the screen, they stay at its lower edge. A card around them
 * needs the class CARD_OF_STEP.
 */
export function StepActions({ children }: { children: ReactNode }) {
  return (
    <Group className={classes.stepActions ?? ""} justify="space-between" align="end">
      {children}
    </Group>
  );
}

/** The class of a card in which the buttons of a step stay on the screen. */
export const CARD_OF_STEP = classes.cardOfStep ?? "";
