import { Link, type LinkProps } from "@tanstack/react-router";
import { useHasPermission } from "../features/auth/hooks";
import type { Page } from "./pages";
import classes from "./Shell.module.css";
import { useCurrentMark } from "./useCurrentMark";

export type NavigationPage = Page & { to: NonNullable<LinkProps["to"]> };

/** A link of a navigation. It is hidden from users without the permission that its page needs. */
export function NavigationLink(page: NavigationPage) {
  const mark = useCurrentMark(page);
  if (!useHasPermission(page.needs)) return null;
  return (
    <Link to={page.to} className={classes.page ?? ""} {...mark}>
      {page.label}
    </Link>
  );
}
