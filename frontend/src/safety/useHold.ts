import { type KeyboardEvent, type MouseEvent, type PointerEvent, useEffect, useRef, useState } from "react";

export const HOLD_MS = 1000;
const SECOND_PRESS_MS = 5000;

/** Says whether the button is held, or waits for a second press. */
export type Holding = "no" | "held" | "again";

const isActivationKey = ({ key }: KeyboardEvent) => key === "Enter" || key === " ";

/** A finger that rests on the edge of a button rolls this many pixels. */
const ROLL_PX = 12;

const PRIMARY_BUTTON = 1;

/** True if the pointer is beside the place. */
const isBeside = (place: DOMRect, { clientX, clientY }: PointerEvent) =>
  clientX < place.left - ROLL_PX ||
  clientX > place.right + ROLL_PX ||
  clientY < place.top - ROLL_PX ||
  clientY > place.bottom + ROLL_PX;

/** Return a signal that aborts when the pointer or key is released, or the window loses the focus or is hidden. */
function untilReleased(): AbortSignal {
  const released = new AbortController();
  const { signal } = released;
  const release = () => released.abort();
  for (const event of ["pointerup", "pointercancel", "keyup"])
    window.addEventListener(event, release, { capture: true, signal });
  const onMove = ({ buttons }: globalThis.PointerEvent) => {
    if ((buttons & PRIMARY_BUTTON) === 0) release();
  };
  window.addEventListener("pointermove", onMove, { capture: true, signal });
  window.addEventListener("blur", release, { signal });
  document.addEventListener("visibilitychange", release, { signal });
  return signal;
}

/**
 * Detect a deliberate hold: a pointer or an activation key stays down for one second. An earlier release has no
 * effect, nor has a pointer that slides off the place that the button had when it was pressed. The button captures the
 * pointer, so the hold continues if only the button moves, because texts above it change. The hold ends without effect
 * if `subject`, what the button acts on, changes during it. Voice and switch control cannot hold, so with them a second
 * press confirms. Spread the handlers on a button.
 *
 * `onHeld` gets a signal that aborts at the release, also if the button has disappeared. After a second press it is aborted.
 */
export function useHold(enabled: boolean, subject: string, onHeld: (released: AbortSignal) => void) {
  const [holding, setHolding] = useState<Holding>("no");
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const place = useRef<DOMRect | null>(null);
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
      onHeld(untilReleased());
    };
    // If the page hung, it handles a waiting release before this second timer.
    setNext("held", HOLD_MS, () => setNext("held", 0, confirm));
  };
  // If the command becomes impossible or another one during the hold, it is not sent.
  // biome-ignore lint/correctness/useExhaustiveDependencies: a changed subject must end the hold
  useEffect(() => {
    clearTimeout(timer.current);
    setHolding("no");
  }, [enabled, subject]);
  useEndOfHold(holding === "held", () => setNext("no"));
  useEffect(() => () => clearTimeout(timer.current), []);
  const handlers = {
    onPointerDown: ({ button, currentTarget, pointerId }: PointerEvent) => {
      if (button !== 0) return;
      place.current = currentTarget.getBoundingClientRect();
      currentTarget.setPointerCapture(pointerId);
      hold();
    },
    onPointerMove: (event: PointerEvent) => {
      // While another button of a mouse is down, the release of the primary one is only a move.
      const down = (event.buttons & PRIMARY_BUTTON) !== 0;
      if (!down || (place.current && isBeside(place.current, event))) release();
    },
    // A captured pointer does not leave the button.
    onPointerLeave: release,
    onLostPointerCapture: release,
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
        onHeld(AbortSignal.abort());
      } else {
        setNext("again", SECOND_PRESS_MS, () => setHolding("no"));
      }
    },
    // Prevented, because a long touch would open a menu.
    onContextMenu: (event: MouseEvent) => event.preventDefault(),
  };
  return { holding, handlers };
}

/** Call `end` during a hold if any pointer is released or cancelled, or if the window loses the focus or is hidden. */
function useEndOfHold(held: boolean, end: () => void) {
  const latest = useRef(end);
  latest.current = end;
  useEffect(() => {
    if (!held) return;
    const listening = new AbortController();
    const { signal } = listening;
    const stop = () => latest.current();
    window.addEventListener("pointerup", stop, { capture: true, signal });
    window.addEventListener("pointercancel", stop, { capture: true, signal });
    window.addEventListener("blur", stop, { signal });
    document.addEventListener("visibilitychange", stop, { signal });
    return () => listening.abort();
  }, [held]);
}
