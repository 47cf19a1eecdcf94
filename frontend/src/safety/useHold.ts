import { type KeyboardEvent, type MouseEvent, type PointerEvent, useEffect, useRef, useState } from "react";

export const HOLD_MS = 1000;
const SECOND_PRESS_MS = 5000;

/** Says whether the button is held, or waits for a second press. */
export type Holding = "no" | "held" | "again";

const isActivationKey = ({ key }: KeyboardEvent) => key === "Enter" || key === " ";

/**
 * Detect a deliberate hold: a pointer or an activation key stays down for one second. An earlier release has no
 * effect. Voice and switch control cannot hold, so with them a second press confirms. Spread the handlers on a
 * button.
 */
export function useHold(enabled: boolean, onHeld: () => void) {
  const [holding, setHolding] = useState<Holding>("no");
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const setNext = (next: Holding, ms = 0, after?: () => void) => {
    clearTimeout(timer.current);
    setHolding(next);
    if (after) timer.current = setTimeout(after, ms);
  };
  const release = () => {
    if (holding === "held") setNext("no");
  };
  const hold = () => {
    const confirm = () => {
      setNext("no");
      onHeld();
    };
    // If the page hung, it handles a waiting release before this second timer.
    setNext("held", HOLD_MS, () => setNext("held", 0, confirm));
  };
  // If the command becomes impossible during the hold, it is not sent.
  useEffect(() => {
    if (!enabled) {
      clearTimeout(timer.current);
      setHolding("no");
    }
  }, [enabled]);
  useEffect(() => () => clearTimeout(timer.current), []);
  const handlers = {
    onPointerDown: ({ button }: PointerEvent) => {
      if (button === 0) hold();
    },
    onPointerUp: release,
    onPointerLeave: release,
    onPointerCancel: release,
    onBlur: release,
    onKeyDown: (event: KeyboardEvent) => {
      if (!isActivationKey(event)) return;
      event.preventDefault();
      if (!event.repeat) hold();
    },
    onKeyUp: (event: KeyboardEvent) => {
      if (!isActivationKey(event)) return;
      event.preventDefault();
      release();
    },
    onClick: ({ detail }: MouseEvent) => {
      // Pointer clicks have a count above 0; synthetic clicks (voice, switch control) have 0.
      if (detail > 0) return;
      if (holding === "again") {
        setNext("no");
        onHeld();
      } else {
        setNext("again", SECOND_PRESS_MS, () => setHolding("no"));
      }
    },
    // Prevented, because a long touch would open a menu.
    onContextMenu: (event: MouseEvent) => event.preventDefault(),
  };
  return { holding, handlers };
}
