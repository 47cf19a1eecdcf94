import { useEffect, useRef } from "react";

/**
 * Return the ref of a form whose first marked field gets the focus after a refusal. The pressed button is disabled
 * while the request is sent, and loses the focus.
 */
export function useFocusMarked(error: unknown) {
  const form = useRef<HTMLFormElement>(null);
  useEffect(() => {
    const marked = form.current?.querySelector<HTMLElement>("[aria-invalid=true]");
    if (!error || !marked) return;
    // The browser itself would leave the field below the title of a dialog.
    marked.focus({ preventScroll: true });
    marked.scrollIntoView({ block: "center" });
  }, [error]);
  return form;
}
