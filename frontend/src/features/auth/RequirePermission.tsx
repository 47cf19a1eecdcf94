import type { ReactNode } from "react";
import { type Permission, useHasPermission } from "./hooks";

/** Shows its content only to users with the permission. The service enforces it independently. */
export function RequirePermission({ permission, children }: { permission: Permission; children: ReactNode }) {
  return useHasPermission(permission) ? children : null;
}
