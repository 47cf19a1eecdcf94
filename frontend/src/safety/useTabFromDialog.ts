import { type RefObject, useEffect } from "react";

const DIALOG = '[role="dialog"][aria-modal="true"]';

/**
 * Let Tab reach Stop from an open dialog, which otherwise keeps Tab within itself. Tab goes from the dialog's last
 * control to Stop, and from Stop to the first control. With Shift, it goes in the opposite direction.
 */
export function useTabFromDialog(stop: RefObject<HTMLElement | null>) {
  useEffect(() => {
    let before: Element | null = null;

    // This runs before the dialog handles the key.
    const onCapture = (event: KeyboardEvent) => {
      before = event.key === "Tab" ? document.activeElement : null;
      // If the dialog itself has the focus, it moves the focus to its first or last control.
      if (before && before === stop.current)
        [...document.querySelectorAll<HTMLElement>(DIALOG)].at(-1)?.focus();
    };

    // This runs after the dialog has moved the focus.
    const onBubble = (event: KeyboardEvent) => {
      const now = document.activeElement;
      if (!before || !now || !event.defaultPrevented || !before.closest(DIALOG)?.contains(now)) return;
      const beyond = event.shiftKey ? Node.DOCUMENT_POSITION_FOLLOWING : Node.DOCUMENT_POSITION_PRECEDING;
      const wrapped = now === before || (before.compareDocumentPosition(now) & beyond) !== 0;
      if (wrapped) stop.current?.focus();
    };

    window.addEventListener("keydown", onCapture, { capture: true });
    window.addEventListener("keydown", onBubble);
    return () => {
      window.removeEventListener("keydown", onCapture, { capture: true });
      window.removeEventListener("keydown", onBubble);
    };
  }, [stop]);
}
