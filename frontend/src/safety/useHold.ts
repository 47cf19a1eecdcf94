import { type KeyboardEvent, type MouseEvent, type PointerEvent, useEffect, useRef, useState } from "react";

export const HOLD_MS = 1000;
const AGAIN_WITHIN_MS = 5000;

/** Whether it is held, and whether it has been asked to be pressed once more. */
export type Holding = "no" | "held" | "again";

/**
 * Meant, not brushed against: a pointer, or the key that presses a button, stays down for a second. Let go earlier, nothing has happened.
 * Whoever presses by voice or by a switch cannot hold: there, a second press says it. The handlers are spread on a button.
 */
export function useHold(enabled: boolean, onHeld: () => void) {
  const [holding, setHolding] = useState<Holding>("no");
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const then = (next: Holding, ms = 0, after?: () => void) => {
    clearTimeout(timer.current);
    setHolding(next);
    if (after) timer.current = setTimeout(after, ms);
  };
  const letGo = () => {
    if (holding === "held") then("no");
  };
  const hold = () => {
    const meant = () => {
      then("no");
      onHeld();
    };
    // A page that hung meanwhile hears first that the hand has let go: what it was told by then comes before a new timer.
    then("held", HOLD_MS, () => then("held", 0, meant));
  };
  // What has become impossible is not done by a hand that is still there.
  useEffect(() => {
    if (!enabled) {
      clearTimeout(timer.current);
      setHolding("no");
    }
  }, [enabled]);
  useEffect(() => () => clearTimeout(timer.current), []);
  const presses = ({ key }: KeyboardEvent) => key === "Enter" || key === " ";
  const handlers = {
    onPointerDown: ({ button }: PointerEvent) => {
      if (button === 0) hold();
    },
    onPointerUp: letGo,
    onPointerLeave: letGo,
    onPointerCancel: letGo,
    onBlur: letGo,
    onKeyDown: (event: KeyboardEvent) => {
      if (!presses(event)) return;
      event.preventDefault();
      if (!event.repeat) hold();
    },
    onKeyUp: (event: KeyboardEvent) => {
      if (!presses(event)) return;
      event.preventDefault();
      letGo();
    },
    onClick: ({ detail }: MouseEvent) => {
      // A pointer counts its clicks; a program that clicks for somebody does not. Keys are taken above.
      if (detail > 0) return;
      if (holding === "again") {
        then("no");
        onHeld();
      } else {
        then("again", AGAIN_WITHIN_MS, () => setHolding("no"));
      }
    },
    // A long touch would open a menu.
    onContextMenu: (event: MouseEvent) => event.preventDefault(),
  };
  return { holding, handlers };
}
