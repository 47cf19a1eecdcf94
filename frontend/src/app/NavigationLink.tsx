import { Link, type LinkProps } from "@tanstack/react-router";
import { type Permission, useHasPermission } from "../features/auth/hooks";
import classes from "./Shell.module.css";

/** A link of a navigation. It is hidden from users without the permission that its page needs. */
export function NavigationLink(props: {
  to: NonNullable<LinkProps["to"]>;
  label: string;
  needs: Permission;
}) {
  const { to, label, needs } = props;
  if (!useHasPermission(needs)) return null;
  return (
    <Link
      to={to}
      className={classes.page ?? ""}
      activeProps={{ className: classes.here ?? "", "aria-current": "page" }}
      activeOptions={{ exact: to === "/", includeSearch: false }}
    >
      {label}
    </Link>
  );
}
