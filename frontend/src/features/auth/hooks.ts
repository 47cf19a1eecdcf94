import { useSyncExternalStore } from "react";
import type { Me } from "../../lib/api/client";
import { useStation } from "../../lib/live/hooks";
import { type AuthState, authStore } from "./authState";

export type Permission = Me["permissions"][number];

export const useAuthState = (): AuthState => useSyncExternalStore(authStore.subscribe, authStore.get);

/** Return the signed-in user, or null when signed out or locked. */
export function useMe(): Me | null {
  const auth = useAuthState();
  return auth.is === "in" ? auth.me : null;
}

/** Return the user's name for records and signatures; empty if no user is signed in. */
export const useUserName = (): string => useMe()?.name ?? "";

/** True if the user has the permission. The service enforces it independently. */
export const useHasPermission = (permission: Permission): boolean =>
  useMe()?.permissions.includes(permission) ?? false;

/** True if the user may work at the station. A user without assigned stations works at all of them. */
export const worksAt = (me: Me, station: string): boolean =>
  me.stations.length === 0 || me.stations.includes(station);

/** True if the user may operate this station's apparatus. */
export function useMayOperate(): boolean {
  const me = useMe();
  const station = useStation();
  const permitted = useHasPermission("operate");
  return permitted && me !== null && (station === null || worksAt(me, station.name));
}
