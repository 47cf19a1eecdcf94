import type { ReactNode } from "react";
import { type Permission, useMay } from "./hooks";

/** Shown to whoever may do it. Whoever does it all the same is refused by the service. */
export function RequirePermission({ permission, children }: { permission: Permission; children: ReactNode }) {
  return useMay(permission) ? children : null;
}
