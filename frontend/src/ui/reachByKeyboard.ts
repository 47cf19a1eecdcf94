import { t } from "../lib/i18n";

/**
 * A ref for the viewport of a scrolled area. While its content is larger than the viewport, the keyboard reaches the
 * viewport, which has a name. Without overflow it would be a stop of the Tab key without a use.
 */
export function reachByKeyboard(viewport: HTMLElement | null) {
  if (!viewport) return undefined;
  const update = () => {
    const scrolls =
      viewport.scrollWidth > viewport.clientWidth || viewport.scrollHeight > viewport.clientHeight;
    if (scrolls) {
      viewport.tabIndex = 0;
      viewport.setAttribute("role", "group");
      viewport.setAttribute("aria-label", t("ui:table.scrolled"));
    } else {
      for (const name of ["tabindex", "role", "aria-label"]) viewport.removeAttribute(name);
    }
  };
  update();
  const observer = new ResizeObserver(update);
  observer.observe(viewport);
  if (viewport.firstElementChild) observer.observe(viewport.firstElementChild);
  return () => observer.disconnect();
}
