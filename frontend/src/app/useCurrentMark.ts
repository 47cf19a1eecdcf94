import { useRouterState } from "@tanstack/react-router";
import { useMe } from "../features/auth/hooks";
import type { Page } from "./pages";
import classes from "./Shell.module.css";

export const CURRENT = { className: classes.here ?? "", "aria-current": "page" } as const;

/** Return the properties of a link that mark it as the current one on its page, on the pages below it and on its parts. */
export function useCurrentMark({
  to,
  parts = [],
  partsWithout,
}: Pick<Page, "to" | "parts" | "partsWithout">) {
  const permissions = useMe()?.permissions ?? [];
  const isOn = useIsOn(parts);
  const onPart = isOn && !(partsWithout && permissions.includes(partsWithout));
  return {
    activeProps: CURRENT,
    inactiveProps: onPart ? CURRENT : {},
    activeOptions: { exact: to === "/", includeSearch: false },
  };
}

/** Return true on a page whose address has one of these starts. */
export const useIsOn = (starts: readonly string[]): boolean =>
  useRouterState({ select: ({ location }) => starts.some((start) => location.pathname.startsWith(start)) });
